//! Algorithms on published data.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde_json::json;
use slate_evaluation::{Evaluation, Figure, localization, planning};

use crate::failure::{ASSERTION_FALSE, Failure};
use crate::output;

#[derive(Debug, Subcommand)]
pub enum EvaluateVerb {
    /// A*, Theta* and D* Lite on the MovingAI benchmarks
    Planning(EvaluateOptions),

    /// Monte Carlo localization in a hospital and an office
    Localization(LocalizationOptions),
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
pub struct LocalizationOptions {
    /// Folder with maps/hospital_section.png of Stage; without it, in the office alone
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,

    /// Number of starts from which an unknown pose is searched
    #[arg(long, value_name = "NUMBER", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    starts: u32,

    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

/// Prints the figures; returns what the process ends with.
pub fn evaluate(verb: &EvaluateVerb) -> Result<u8, Failure> {
    let (is_json, evaluations) = match verb {
        EvaluateVerb::Planning(options) => (options.json, planning::evaluate(&options.data)?),
        EvaluateVerb::Localization(options) => {
            (options.json, localization::evaluate(options.data.as_deref(), options.starts as usize)?)
        }
    };
    if is_json {
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
    let notes = evaluation.notes.iter().map(|note| format!("\n  {note}"));
    evaluation.name.clone() + &lines.chain(notes).collect::<String>()
}
