//! Missions: Petri nets, behavior trees, Golog programs and skills in Lua.
//! They are checked, drawn and generated.

#[cfg(feature = "missions")]
mod check;
#[cfg(feature = "missions")]
mod findings;
#[cfg(feature = "missions")]
mod golog;
#[cfg(feature = "missions")]
mod nets;
#[cfg(feature = "missions")]
mod paper;
#[cfg(feature = "lua")]
mod skills;
#[cfg(feature = "lua")]
mod skills_svg;
#[cfg(feature = "missions")]
mod svg;
#[cfg(feature = "missions")]
mod tree;
#[cfg(feature = "missions")]
mod tree_svg;

use std::path::PathBuf;

use clap::Subcommand;

#[cfg(feature = "missions")]
pub use nets::mission;

#[cfg(not(feature = "missions"))]
use crate::failure::Failure;

#[derive(Debug, Subcommand)]
pub enum MissionVerb {
    /// Check a Petri Net Plan, a behavior tree, a Golog program or skills
    /// for defects (exit code 7 for an error)
    Check {
        /// Plan in PNML, behavior tree in the XML of BehaviorTree.CPP,
        /// theory `.golog`, or skills in Lua
        file: PathBuf,
        /// Action of the robot; repeatable [default: every action is known]
        #[arg(long, value_name = "NAME")]
        action: Vec<String>,
        /// Maximum number of markings to explore
        #[arg(long, value_name = "NUMBER", default_value_t = 100_000)]
        states: usize,
        /// Print the findings as JSON
        #[arg(long)]
        json: bool,
    },
    /// Draw a Petri Net Plan, a behavior tree, a Golog program or skills as SVG
    Show {
        /// Plan in PNML, behavior tree in the XML of BehaviorTree.CPP,
        /// theory `.golog`, or skills in Lua
        file: PathBuf,
        /// Output file [default: stdout]
        #[arg(long, short, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Generate a Petri Net Plan from a linear plan and execution rules
    Generate {
        /// Linear plan, such as `goto_1_2|30; look`
        file: PathBuf,
        /// Execution rules
        #[arg(long, value_name = "FILE")]
        rules: Option<PathBuf>,
        /// Output file [default: stdout]
        #[arg(long, short, value_name = "FILE")]
        out: Option<PathBuf>,
    },
}

/// Reports that the feature is not built in.
#[cfg(not(feature = "missions"))]
pub fn mission(_verb: &MissionVerb) -> Result<u8, Failure> {
    Err(Failure::NotBuilt { what: "`slate mission`".into(), feature: "missions" })
}
