//! Options of the verbs that run an application.

use std::io::IsTerminal;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use slate_runtime::{Mode, Rate};

use crate::number;

/// Maximum seed that a configuration can hold.
pub const MAXIMUM_SEED: u64 = i64::MAX as u64;

#[allow(missing_docs, reason = "a comment here would become the help of each verb that has these options")]
#[derive(Debug, Args)]
pub struct ApplicationOptions {
    /// Scheduling of the modules
    #[arg(long, value_enum, default_value_t = ModeName::Staged)]
    pub mode: ModeName,

    /// Worker threads for independent modules; the result does not depend on them
    #[arg(long, default_value_t = 0, value_parser = number::whole::<u8>(0, 64))]
    pub workers: u8,

    /// Override a setting,
    /// such as `robots.r2.modules.planner.params.careful_linear_velocity=0.08`; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<String>,

    /// Configuration of this machine, which overrides the main one
    #[arg(long, value_name = "FILE")]
    pub host: Option<PathBuf>,

    /// Print a summary as JSON in the last line of stdout
    #[arg(long)]
    pub json: bool,
}

#[allow(missing_docs, reason = "as above")]
#[derive(Debug, Args)]
pub struct RunOptions {
    #[allow(missing_docs, reason = "see above")]
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

    /// Speed of simulated time: `realtime`, a factor, or `max` (staged mode only)
    /// [default: realtime; max for a single headless staged agent]
    #[arg(long, value_parser = parse_rate, allow_hyphen_values = true)]
    pub rate: Option<Rate>,

    /// Seed of the random numbers
    #[arg(long, value_parser = number::whole::<u64>(0, MAXIMUM_SEED))]
    pub seed: Option<u64>,

    /// Resume from a snapshot
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,

    /// Folder of the report; of several agents, each has a subfolder
    /// [default: runs/NAME-SEED]
    #[arg(long)]
    pub out: Option<PathBuf>,

    /// Start with disarmed actuators, also in a simulator, until `slate arm`
    #[arg(long)]
    pub disarmed: bool,
}

impl RunOptions {
    /// Returns whether the run has a live display that owns the terminal.
    pub fn owns_terminal(&self) -> bool {
        !self.headless && std::io::stdout().is_terminal()
    }

    /// Returns the program's settings that apply unless overridden.
    /// Files and the command line override them.
    pub fn defaults(&self) -> Vec<String> {
        vec![format!("log.targets.console={}", !self.owns_terminal())]
    }

    /// Settings of the command line, with the seed.
    pub fn sets(&self) -> Vec<String> {
        let seed = self.seed.map(|seed| format!("agent.seed={seed}"));
        self.common.set.iter().cloned().chain(seed).collect()
    }
}

/// Scheduling mode of the modules.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModeName {
    /// In the main loop, stage by stage; in lockstep with a simulator
    Staged,
    /// Each block in its own thread
    Threaded,
}

impl ModeName {
    /// Returns the mode of the agent.
    pub fn mode(self) -> Mode {
        match self {
            Self::Staged => Mode::Staged,
            Self::Threaded => Mode::Threaded,
        }
    }

    /// Returns the name as an argument.
    pub fn name(self) -> &'static str {
        match self {
            Self::Staged => "staged",
            Self::Threaded => "threaded",
        }
    }
}

/// Parses the pace of simulated time.
///
/// # Errors
/// If it is neither `realtime`, `max` nor a positive factor.
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
