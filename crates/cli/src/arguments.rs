//! Verbs of the command.

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use clap_complete::ArgValueCompleter;
use slate_run::output::ColorChoice;

use crate::api::ApiOptions;
use crate::bag::BagVerb;
use crate::batch::BatchOptions;
use crate::browse::ConsoleOptions;
use crate::check::CheckOptions;
use crate::complete::{self, Shell};
use crate::config::ConfigVerb;
use crate::connection::AgentOption;
use crate::doctor::DoctorOptions;
use crate::evaluate::EvaluateVerb;
use crate::features::{HELP, VERSION};
use crate::goal::GoalOptions;
use crate::graph::GraphOptions;
use crate::interface::InterfaceVerb;
use crate::link::{LinkOptions, UnlinkOptions};
use crate::log::LogOptions;
use crate::map::MapVerb;
use crate::mcp::McpOptions;
use crate::mission::MissionVerb;
use crate::module::ModuleVerb;
use crate::new::NewOptions;
use crate::peers::PeersOptions;
use crate::plugin::PluginVerb;
use crate::record::RecordVerb;
use crate::replay::{ReplayOptions, TryOptions};
use crate::report::ReportOptions;
use crate::ros::RosVerb;
use crate::run_options::RunVerb;
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

/// Create, run, inspect and control robots
#[derive(Debug, Parser)]
#[command(name = "slate", version, long_version = VERSION.as_str(), long_about = None)]
#[command(after_help = HELP.as_str())]
pub struct Arguments {
    #[command(subcommand)]
    pub verb: Verb,

    /// When to use colors; `auto`: on a terminal, unless NO_COLOR is set
    #[arg(long, global = true, value_enum, value_name = "WHEN", default_value_t = ColorChoice::Auto)]
    pub color: ColorChoice,
}

#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Create a project that builds, tests and runs
    New(NewOptions),
    /// Create interfaces, show their layout and compare versions
    #[command(subcommand)]
    Interface(InterfaceVerb),
    /// Create, inspect, load and reload plugins
    #[command(subcommand)]
    Plugin(PluginVerb),
    /// Check a configuration without running it (exit code 7 if it has errors)
    Check(CheckOptions),
    /// Draw the graph of modules and links
    Graph(GraphOptions),
    /// List the examples
    Examples {
        /// Print the list as JSON
        #[arg(long)]
        json: bool,
    },
    /// Run an example or a configuration until its mission ends
    Run(RunVerb),
    /// Run an example with many seeds and summarize the results
    Batch(BatchOptions),
    /// Write a report about a run, with plots and tables
    Report(ReportOptions),
    /// List the agents running on this machine
    Ps {
        /// Print the list as JSON
        #[arg(long)]
        json: bool,
    },
    /// List, describe, enable and disable modules
    #[command(subcommand)]
    Module(ModuleVerb),
    /// Link an input to a property, or list the links
    Link(LinkOptions),
    /// Remove the link of an input
    Unlink(UnlinkOptions),
    /// List the peers of an agent and the properties shared with them
    Peers(PeersOptions),
    /// Show duration, jitter, load and overruns of the modules
    Top(TopOptions),
    /// Record a timing trace for Perfetto
    Trace(TraceOptions),
    /// Show the log of a running agent
    Log(LogOptions),
    /// List the properties
    List {
        /// Path whose subtree is listed, such as `/r2`,
        /// or a pattern such as `/**/timing` [default: all]
        #[arg(add = ArgValueCompleter::new(complete::of_properties))]
        pattern: Option<String>,
        /// Print the list as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Show the properties as a tree
    Tree(TreeOptions),
    /// Print the value of a property or a field
    Get {
        /// URL, such as `/loop/histogram` or `/r2/planner/state/ticks`
        #[arg(add = ArgValueCompleter::new(complete::of_properties))]
        url: String,
        /// Print value, sequence number and time as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Set a parameter or an unlinked input, or enable a module
    Set {
        /// URL, such as `/r2/planner/params/max_linear_velocity` or `/mission/target`
        #[arg(add = ArgValueCompleter::new(complete::of_properties))]
        url: String,
        /// New value: a number, a string, TOML such as `{ x = 1.5, y = 0.0 }`, or JSON
        #[arg(allow_negative_numbers = true)]
        value: String,
        /// Print the changes as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Send a message to an inbox
    Send(SendOptions),
    /// Print the values of properties as they arrive
    #[command(visible_alias = "echo")]
    Watch(WatchOptions),
    /// Wait until a condition holds (exit code 6 on timeout)
    Wait(WaitOptions),
    /// Measure rate, jitter, size and bandwidth (exit code 7 outside --min and --max)
    #[command(visible_aliases = ["hz", "bw"])]
    Stat(StatOptions),
    /// Show, change and save the configuration of a running agent
    #[command(subcommand)]
    Config(ConfigVerb),
    /// Set the goal of a robot
    Goal(GoalOptions),
    /// Drive a robot with the keyboard; it stops when no key is pressed
    Teleop(TeleopOptions),
    /// Stop all actuators until `reset` and `arm`; not an emergency stop
    Stop(StopOptions),
    /// Reset a stop
    Reset(ResetOptions),
    /// Arm the actuators, so that commands reach them
    Arm(ArmOptions),
    /// Record a running agent, or save its last seconds
    #[command(subcommand)]
    Record(RecordVerb),
    /// Inspect, verify, repair, convert, compare and plot recordings
    #[command(subcommand)]
    Bag(BagVerb),
    /// Replay a recording, control a replay, or repeat a recorded run and compare
    Replay(ReplayOptions),
    /// Run one module on a recording and compare its outputs with the recorded ones
    Try(TryOptions),
    /// Save, restore and inspect snapshots
    #[command(subcommand)]
    Snapshot(SnapshotVerb),
    /// Save a map of a running agent
    #[command(subcommand)]
    Map(MapVerb),
    /// Check, draw and generate missions:
    /// Petri Net Plans, behavior trees, Golog programs, skills in Lua
    #[command(subcommand)]
    Mission(MissionVerb),
    /// Print the link of the web console, which contains a token, or open it
    Console(ConsoleOptions),
    /// Call an operation of the HTTP API, or list all operations
    Api(ApiOptions),
    /// Serve an agent to a language model
    /// over the Model Context Protocol on stdio or HTTP
    Mcp(McpOptions),
    /// Check that this machine can run a robot (exit code 7 if not)
    Doctor(DoctorOptions),
    /// Evaluate algorithms on public datasets (exit code 7 if a goal is missed)
    #[command(subcommand)]
    Evaluate(EvaluateVerb),
    /// List nodes, topics and services of ROS 2, and print and measure topics
    #[command(subcommand)]
    Ros(RosVerb),
    /// Explain an error code such as S006, or list all codes
    Explain {
        /// Error codes
        codes: Vec<String>,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Print a script for shell completion, as in `source <(slate completions bash)`
    Completions {
        /// Shell
        shell: Shell,
    },
    /// Write man pages into a folder
    Man {
        /// Folder
        folder: PathBuf,
    },
}
