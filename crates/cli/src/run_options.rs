//! Options of the verbs that run an application.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use clap_complete::ArgValueCompleter;
use slate::runtime::{Mode, Rate};

use crate::{complete, number};

/// The greatest seed that a configuration can hold.
pub const MAXIMUM_SEED: u64 = i64::MAX as u64;

#[derive(Debug, Args)]
pub struct ApplicationOptions {
    /// How modules are scheduled
    #[arg(long, value_enum, default_value_t = ModeName::Staged)]
    pub mode: ModeName,

    /// Worker threads for independent modules; the result does not depend on them
    #[arg(long, default_value_t = 0, value_parser = number::whole::<u8>(0, 64))]
    pub workers: u8,

    /// Override a setting, such as `robots.r2.modules.planner.params.careful_linear_velocity=0.08`; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<String>,

    /// Configuration of this machine, which overrides the main one
    #[arg(long, value_name = "FILE")]
    pub host: Option<PathBuf>,

    /// Print a summary as JSON in the last line of stdout
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct RunOptions {
    /// Example or configuration file [default with --resume: that of the snapshot]
    #[arg(required_unless_present = "resume", add = ArgValueCompleter::new(complete::of_configurations))]
    pub name: Option<String>,

    /// Agent of the file [default: all]
    #[arg(long, value_name = "NAME", requires = "name")]
    pub agent: Option<String>,

    #[command(flatten)]
    pub common: ApplicationOptions,

    /// Run without the live display; several agents never have one
    #[arg(long)]
    pub headless: bool,

    /// Open the web console in a browser
    #[arg(long)]
    pub open: bool,

    /// Keep the agent until Ctrl-C when its mission has ended
    #[arg(long)]
    pub stay: bool,

    /// Speed of simulated time: `realtime`, a factor, or `max` (staged mode only) [default: realtime; max for a single
    /// headless staged agent]
    #[arg(long, value_parser = parse_rate, allow_hyphen_values = true)]
    pub rate: Option<Rate>,

    /// Seed of the random numbers
    #[arg(long, value_parser = number::whole::<u64>(0, MAXIMUM_SEED))]
    pub seed: Option<u64>,

    /// Resume from a snapshot
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,

    /// Folder of the report; of several agents, each has a subfolder [default: runs/<name>-<seed>]
    #[arg(long)]
    pub out: Option<PathBuf>,

    /// Start with disarmed actuators, also in a simulator, until `slate arm`
    #[arg(long)]
    pub disarmed: bool,

    /// Start as one of several agents: wait for the others, and end with the supervisor
    #[arg(long, hide = true)]
    pub supervised: bool,

    /// Serve the web console of several agents
    #[arg(long, hide = true)]
    pub watched: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModeName {
    /// In the main loop, stage by stage; in lockstep with a simulator
    Staged,
    /// Each block in its own thread
    Threaded,
}

impl ModeName {
    pub fn mode(self) -> Mode {
        match self {
            Self::Staged => Mode::Staged,
            Self::Threaded => Mode::Threaded,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Staged => "staged",
            Self::Threaded => "threaded",
        }
    }
}

pub fn parse_rate(text: &str) -> Result<Rate, String> {
    match text {
        "max" => Ok(Rate::Max),
        "realtime" => Ok(Rate::REALTIME),
        factor => match factor.trim_end_matches('x').parse::<f64>() {
            Ok(factor) if factor.is_finite() && factor > 0.0 => Ok(Rate::Times(factor)),
            _ => Err("expected `realtime`, `max` or a positive factor such as 5".into()),
        },
    }
}
