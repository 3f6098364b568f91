//! Missions: plans as Petri nets, checked, drawn and generated.

mod check;
mod svg;

use std::path::{Path, PathBuf};

use clap::Subcommand;
use slate_petri_net::{
    NetError, PetriNet, generate_net, parse_linear_plan, parse_rules, read_pnml, write_pnml,
};

use crate::failure::Failure;
use crate::graph::write;
use crate::output;

#[derive(Debug, Subcommand)]
pub enum MissionVerb {
    /// Check a Petri Net Plan and its sub-plans for defects (exit code 7 if one is found)
    Check {
        /// Plan in PNML
        file: PathBuf,
        /// Action of the robot; repeatable [default: every action is known]
        #[arg(long, value_name = "NAME")]
        action: Vec<String>,
        /// Number of markings after which a net is given up
        #[arg(long, value_name = "NUMBER", default_value_t = 100_000)]
        states: usize,
        /// Print the findings as JSON
        #[arg(long)]
        json: bool,
    },
    /// Draw a Petri Net Plan as SVG
    Show {
        /// Plan in PNML
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

/// Runs the command; returns the exit code.
pub fn mission(verb: &MissionVerb) -> Result<u8, Failure> {
    match verb {
        MissionVerb::Check { file, action, states, json } => check::check(file, action, *states, *json),
        MissionVerb::Show { file, out } => {
            put(&svg::draw(&read_pnml(file)?), out.as_deref())?;
            Ok(0)
        }
        MissionVerb::Generate { file, rules, out } => {
            put(&write_pnml(&generate(file, rules.as_deref())?), out.as_deref())?;
            Ok(0)
        }
    }
}

/// Generates the net of a linear plan.
fn generate(plan: &Path, rules: Option<&Path>) -> Result<PetriNet, Failure> {
    let read = |path: &Path| {
        std::fs::read_to_string(path).map_err(|source| Failure::File { path: path.into(), source })
    };
    let of_file = |path: &Path, error: NetError| Failure::Net(error.of_file(path));
    let steps = parse_linear_plan(&read(plan)?).map_err(|error| of_file(plan, error))?;
    let rules = match rules {
        Some(path) => parse_rules(&read(path)?).map_err(|error| of_file(path, error))?,
        None => Vec::new(),
    };
    let name = plan.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    Ok(generate_net(name.split('.').next().unwrap_or(name), &steps, &rules)?)
}

/// Writes a file, or prints it.
fn put(text: &str, out: Option<&Path>) -> Result<(), Failure> {
    match out {
        Some(path) => write(path, text).map_err(|source| Failure::File { path: path.into(), source }),
        None => {
            output::line(text.trim_end());
            Ok(())
        }
    }
}
