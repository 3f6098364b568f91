//! Algorithms on published data.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use serde_json::json;
use slate_evaluation::slam::{self, SlamMethod};
use slate_evaluation::{Evaluation, Figure, planning};

use crate::failure::{ASSERTION_FALSE, Failure};
use crate::output;

#[derive(Debug, Subcommand)]
pub enum EvaluateVerb {
    /// A*, Theta* and D* Lite on the MovingAI benchmarks
    Planning(EvaluateOptions),
    /// SLAM on the log of the Intel Research Lab
    Slam(SlamOptions),
}

#[derive(Debug, Args)]
pub struct EvaluateOptions {
    /// Folder with the data as it is published
    #[arg(long, value_name = "FOLDER")]
    data: PathBuf,

    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
pub struct SlamOptions {
    #[command(flatten)]
    evaluate: EvaluateOptions,

    /// Method of SLAM
    #[arg(long, value_enum, default_value_t = MethodName::Graph)]
    method: MethodName,

    /// Write the map, as ROS's map.yaml with an image beside it
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
}

/// A method of SLAM, as it is typed.
#[derive(Clone, Copy, Debug, ValueEnum)]
#[value(rename_all = "snake_case")]
enum MethodName {
    /// Pose graph with loop closure
    Graph,
    /// Rao-Blackwellized particle filter
    ParticleFilter,
}

/// Prints the figures; returns what the process ends with.
pub fn evaluate(verb: &EvaluateVerb) -> Result<u8, Failure> {
    match verb {
        EvaluateVerb::Planning(options) => print(&planning::evaluate(&options.data)?, options),
        EvaluateVerb::Slam(SlamOptions { evaluate, method, map }) => {
            let method = match method {
                MethodName::Graph => SlamMethod::Graph,
                MethodName::ParticleFilter => SlamMethod::ParticleFilter,
            };
            print(&[slam::evaluate(&evaluate.data, method, map.as_deref())?], evaluate)
        }
    }
}

fn print(evaluations: &[Evaluation], options: &EvaluateOptions) -> Result<u8, Failure> {
    if options.json {
        output::document("slate.evaluation/1", &json!({ "evaluations": evaluations }));
    } else {
        evaluations.iter().for_each(|evaluation| output::line(text(evaluation)));
    }
    let is_reached = evaluations.iter().flat_map(|evaluation| &evaluation.figures).all(Figure::is_reached);
    Ok(if is_reached { 0 } else { ASSERTION_FALSE })
}

fn text(evaluation: &Evaluation) -> String {
    let lines = evaluation.figures.iter().map(|figure| {
        let verdict = if figure.is_reached() { "" } else { ", NOT reached" };
        let goal = figure.goal.map_or_else(String::new, |goal| format!("  ({goal}{verdict})"));
        // Counts have no decimals.
        let decimals = if figure.value.fract() == 0.0 { 0 } else { 3 };
        format!("\n  {:<55}{:>10.decimals$}{goal}", figure.name, figure.value)
    });
    evaluation.name.clone() + &lines.collect::<String>()
}
