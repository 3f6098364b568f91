//! Run of an application, from its options to its report and exit code.
//! This is `slate run`, for the command and for programs that are robots.

#[macro_use]
mod complain;

mod bridges;
mod causes;
mod check;
pub mod clock;
mod console;
mod dds;
mod display;
mod error;
mod finding;
mod folder;
mod groot;
mod mission;
mod network;
pub mod number;
mod observation;
mod options;
pub mod output;
mod printed_error;
mod robot;
mod ros;
mod ros1;
mod ros2;
mod run;
mod run_history;
pub mod scene;
mod stay;
#[cfg(feature = "console")]
mod trails;
mod unfed;
mod warnings;

use std::sync::Arc;

pub use check::check_tables;
pub use console::open_browser;
pub use error::RunError;
pub use finding::ConfigurationFinding;
pub use folder::Folder;
pub use mission::{Finished, MissionOptions, MissionRun};
pub use observation::{JudgeMetrics, JudgeVerdict, Observation};
pub use options::{ApplicationOptions, MAXIMUM_SEED, ModeName, RunOptions, parse_rate};
pub use printed_error::PrintedError;
pub use robot::RunRobot;
pub use run::{RunContext, Supervision, run};
pub use run_history::RunHistory;
use slate_module::Plugin;
use slate_runtime::configuration::{Configuration, Database};
pub use stay::DEBOUNCE;

/// Names at the top of a configuration that belong to applications.
pub const EXTRA_TABLES: [&str; 8] = ["world", "report", "console", "network", "dds", "groot", "ros1", "ros2"];

/// Settings of applications that may be paths.
pub const PATHS: [&str; 17] = [
    "world.arena",
    "world.robots.*.model",
    "modules.*.params.log_file",
    "modules.*.params.yaml_filename",
    "robots.*.modules.*.params.yaml_filename",
    "modules.*.params.graph_filename",
    "robots.*.modules.*.params.graph_filename",
    "modules.*.params.mission_filename",
    "modules.*.params.plan_filename",
    "modules.*.params.program_filename",
    "modules.*.params.skill_filename",
    "modules.*.params.tree_filename",
    "robots.*.modules.*.params.mission_filename",
    "robots.*.modules.*.params.plan_filename",
    "robots.*.modules.*.params.program_filename",
    "robots.*.modules.*.params.skill_filename",
    "robots.*.modules.*.params.tree_filename",
];

/// Application to run.
pub struct Application {
    /// Name of the run.
    pub name: String,
    /// Configuration at the start.
    pub configuration: Arc<Configuration>,
    /// Holds the configuration while it changes.
    pub database: Database,
    /// Kinds of modules.
    pub plugins: Vec<Plugin>,
}

impl Application {
    /// Creates an application with the current configuration of a database.
    pub fn new(name: &str, database: Database, plugins: Vec<Plugin>) -> Self {
        Self { name: name.into(), configuration: database.current(), database, plugins }
    }
}
