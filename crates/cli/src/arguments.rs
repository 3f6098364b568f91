use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::ArgValueCompleter;
use slate::runtime::{Mode, Rate};

use crate::api::ApiOptions;
use crate::bag::BagVerb;
use crate::browse::ConsoleOptions;
use crate::check::CheckOptions;
use crate::complete::{self, Shell};
use crate::config::ConfigVerb;
use crate::connection::AgentOption;
use crate::doctor::DoctorOptions;
use crate::features::{HELP, VERSION};
use crate::goal::GoalOptions;
use crate::graph::GraphOptions;
use crate::interface::InterfaceVerb;
use crate::link::{LinkOptions, UnlinkOptions};
use crate::log::LogOptions;
use crate::mcp::McpOptions;
use crate::module::ModuleVerb;
use crate::new::NewOptions;
use crate::output::Colour;
use crate::peers::PeersOptions;
use crate::plugin::PluginVerb;
use crate::record::RecordVerb;
use crate::replay::{ReplayOptions, TryOptions};
use crate::report::ReportOptions;
use crate::send::SendOptions;
use crate::snapshot::SnapshotVerb;
use crate::stat::StatOptions;
use crate::stop::{ArmOptions, ResetOptions, StopOptions};
use crate::teleop::TeleopOptions;
use crate::top::TopOptions;
use crate::trace::TraceOptions;
use crate::tree::TreeOptions;
use crate::wait::WaitOptions;
use crate::watch::WatchOptions;

/// The greatest seed that a configuration can hold.
pub const MAXIMUM_SEED: u64 = i64::MAX as u64;

/// Slate: an architecture for autonomous robots, everything the robot knows at a URL, and runs that repeat bit for bit.
#[derive(Debug, Parser)]
#[command(name = "slate", version, long_version = VERSION.as_str(), about, long_about = None)]
#[command(after_help = HELP.as_str())]
pub struct Arguments {
    #[command(subcommand)]
    pub verb: Verb,

    /// When what is printed has colours; `auto` is on a terminal, unless `NO_COLOR` says otherwise.
    #[arg(long, global = true, value_enum, value_name = "WHEN", default_value_t = Colour::Auto)]
    pub color: Colour,
}

#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Runs an example or a configuration until its mission ends.
    Run(RunOptions),
    /// Runs many seeds of an example and reports how they went.
    Batch(BatchOptions),
    /// Records a running agent, and saves its last seconds.
    #[command(subcommand)]
    Record(RecordVerb),
    /// Plays a recording in an agent, controls one that is played, or makes a recorded run again and compares.
    Replay(ReplayOptions),
    /// Runs one module on a recording, and says what it writes, how long it takes, and how that compares.
    Try(TryOptions),
    /// Writes a page about a run, with its pictures and tables.
    Report(ReportOptions),
    /// Lists the examples.
    Examples {
        /// Prints the list as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Writes plugins, shows what they are, and changes which of them a running agent has.
    #[command(subcommand)]
    Plugin(PluginVerb),
    /// Lists the modules of a running agent, and switches them on and off.
    #[command(subcommand)]
    Module(ModuleVerb),
    /// Links an input of a running agent to another property, or lists the links.
    Link(LinkOptions),
    /// Takes the link of an input of a running agent away.
    Unlink(UnlinkOptions),
    /// Lists the other agents that a running agent knows, and what goes to and fro.
    Peers(PeersOptions),
    /// Records what the modules of a running agent do when, for Perfetto.
    Trace(TraceOptions),
    /// Takes snapshots of a running agent, lets it go on from one, and shows what is in one.
    #[command(subcommand)]
    Snapshot(SnapshotVerb),
    /// Shows, checks, repairs, copies, compares and draws recordings.
    #[command(subcommand)]
    Bag(BagVerb),
    /// Shows and changes the configuration of a running agent.
    #[command(subcommand)]
    Config(ConfigVerb),
    /// Shows the log of a running agent.
    Log(LogOptions),
    /// Reads a property of a running agent, or a field of one.
    Get {
        /// Its URL, such as `/loop/histogram` or `/r2/planner/state/ticks`.
        #[arg(add = ArgValueCompleter::new(complete::of_properties))]
        url: String,
        /// Prints value, sequence and time as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Sets a parameter, an input without a link, or whether a module is on.
    Set {
        /// Its URL, such as `/r2/planner/params/speed` or `/mission/target`.
        #[arg(add = ArgValueCompleter::new(complete::of_properties))]
        url: String,
        /// What it shall be: a number, a text, or JSON such as `{"x": 1.5, "y": 0}`.
        #[arg(allow_negative_numbers = true)]
        value: String,
        /// Prints what changes as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Sends a message to what takes them.
    Send(SendOptions),
    /// Shows the values of properties as they come.
    #[command(visible_alias = "echo")]
    Watch(WatchOptions),
    /// Waits until a value is as it shall be; ends with 6 when it is not in time.
    Wait(WaitOptions),
    /// Measures in the agent how often values come; ends with 7 when that is not as it shall be.
    #[command(visible_aliases = ["hz", "bw"])]
    Stat(StatOptions),
    /// Shows the properties of a running agent as a tree.
    Tree(TreeOptions),
    /// Shows how long the modules of a running agent take, how even they are, and what they miss.
    Top(TopOptions),
    /// Writes a project that is tested, built and run at once.
    New(NewOptions),
    /// Writes interfaces, shows how they are laid out, and compares versions of them.
    #[command(subcommand)]
    Interface(InterfaceVerb),
    /// Says what is wrong with a configuration, without running it; ends with 7 when something is.
    Check(CheckOptions),
    /// Prints what makes a shell complete commands, such as `source <(slate completions bash)`.
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// Explains the code of a mistake, such as S006, or lists all codes.
    Explain {
        /// The codes.
        codes: Vec<String>,
        /// Prints them as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Writes pages for `man` into a folder.
    Man {
        /// The folder.
        folder: PathBuf,
    },
    /// Looks whether this computer is fit to run a robot; ends with 7 when it is not.
    Doctor(DoctorOptions),
    /// Draws modules and links of a configuration, or of a running agent.
    Graph(GraphOptions),
    /// Lists the agents of this machine.
    Ps {
        /// Prints the list as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Lists the properties of a running agent.
    List {
        /// Which of them, such as `/r2/planner/*` or `/**/timing`; all unless given.
        #[arg(add = ArgValueCompleter::new(complete::of_properties))]
        pattern: Option<String>,
        /// Prints the list as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Prints the link of a running agent's web console, which has a secret in it, or opens it.
    Console(ConsoleOptions),
    /// Calls an operation of a running agent's HTTP API, or lists them; the secret is found by itself.
    Api(ApiOptions),
    /// Lets a language model use a running agent over the Model Context Protocol, on stdin and stdout or over HTTP.
    Mcp(McpOptions),
    /// Sets where a robot of a running agent is to go.
    Goal(GoalOptions),
    /// Drives a robot of a running agent by keys; it stops when none is pressed.
    Teleop(TeleopOptions),
    /// Stops all actuators of the agents that run here, or of one, until `reset` and `arm`. It is no emergency stop.
    Stop(StopOptions),
    /// Ends a stop of the actuators of a running agent.
    Reset(ResetOptions),
    /// Lets commands through to the actuators of a running agent, or to one.
    Arm(ArmOptions),
}

#[derive(Debug, Args)]
pub struct Common {
    /// How modules are run.
    #[arg(long, value_enum, default_value_t = ModeName::Staged)]
    pub mode: ModeName,

    /// Threads that help the main loop with independent modules; the result is the same.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(..=64))]
    pub workers: u8,

    /// Sets a value of the configuration, such as `robots.r2.modules.planner.params.careful_speed=0.08`; may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<String>,

    /// A file with the settings of this computer; they go over those of the configuration.
    #[arg(long, value_name = "FILE")]
    pub host: Option<PathBuf>,

    /// Prints a summary as the last line of stdout, as JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct RunOptions {
    /// An example by name, or a configuration file; with --resume, that of the snapshot unless given.
    #[arg(required_unless_present = "resume", add = ArgValueCompleter::new(complete::of_configurations))]
    pub name: Option<String>,

    /// One of the agents that the file describes; all of them unless given.
    #[arg(long, value_name = "NAME", requires = "name")]
    pub agent: Option<String>,

    #[command(flatten)]
    pub common: Common,

    /// No live display; several agents have none.
    #[arg(long)]
    pub headless: bool,

    /// Opens the web console in a browser.
    #[arg(long)]
    pub open: bool,

    /// Stays when the mission has ended, until Ctrl-C, also without a browser.
    #[arg(long)]
    pub stay: bool,

    /// How fast time goes: `realtime`, a factor, or `max` (staged mode only); headless staged runs of a simulator go as
    /// fast as they can, unless they are one of several agents. A robot without a simulator goes with the wall clock.
    #[arg(long, value_parser = parse_rate, allow_hyphen_values = true)]
    pub rate: Option<Rate>,

    /// What random numbers begin with.
    #[arg(long, value_parser = clap::value_parser!(u64).range(..=MAXIMUM_SEED))]
    pub seed: Option<u64>,

    /// Goes on from a snapshot.
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,

    /// Where the report goes; `runs/<name>-<seed>` unless given. Of several agents, each has a folder in it.
    #[arg(long)]
    pub out: Option<PathBuf>,

    /// The actuators wait for `slate arm`, also those of a simulator.
    #[arg(long)]
    pub disarmed: bool,

    /// One of several agents that are started together: it waits for the others, and ends with the one that starts it.
    #[arg(long, hide = true)]
    pub supervised: bool,

    /// The one of several agents that has a web console, as a person watches them.
    #[arg(long, hide = true)]
    pub watched: bool,
}

#[derive(Debug, Args)]
pub struct BatchOptions {
    /// An example by name, or a configuration file.
    #[arg(add = ArgValueCompleter::new(complete::of_configurations))]
    pub name: String,

    #[command(flatten)]
    pub common: Common,

    /// How many runs.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..))]
    pub runs: u64,

    /// The seed of the first run; the others follow.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=MAXIMUM_SEED))]
    pub seed: u64,

    /// How many runs are made at once; the figures are the same. As many as there are cores unless given, in threaded
    /// mode one.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModeName {
    /// On the main loop, stage by stage; in lockstep with a simulator.
    Staged,
    /// Blocks on threads of their own.
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
