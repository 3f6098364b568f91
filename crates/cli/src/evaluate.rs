//! Algorithms on published data.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use serde_json::json;
use slate_evaluation::local_planning::LocalPlannerKind;
use slate_evaluation::slam::SlamMethod;
use slate_evaluation::{
    DataError, Evaluation, Figure, exploration, local_planning, localization, mrclam, planning, slam,
};

use crate::failure::{ASSERTION_FALSE, Failure};
use crate::output;

#[derive(Debug, Subcommand)]
pub enum EvaluateVerb {
    /// A*, Theta* and D* Lite on the MovingAI benchmarks
    Planning(EvaluateOptions),

    /// Monte Carlo localization in a hospital and an office, and a Kalman filter on MRCLAM
    Localization(LocalizationOptions),

    /// SLAM on the log of the Intel Research Lab
    Slam(SlamOptions),

    /// Local planners in the worlds of the BARN challenge
    #[command(name = "local_planning")]
    LocalPlanning(LocalPlanningOptions),

    /// Exploration of Explore-Bench's buildings and a hospital
    Exploration(ExplorationOptions),
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
    /// Folder with maps/hospital_section.png of Stage and mrclam; without it, in the office alone
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,

    /// Evaluate one method alone
    #[arg(long, value_enum)]
    method: Option<LocalizationMethod>,

    /// Number of starts from which an unknown pose is searched
    #[arg(long, value_name = "NUMBER", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    starts: u32,

    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum LocalizationMethod {
    /// Monte Carlo localization in buildings
    MonteCarlo,
    /// Extended Kalman filter on MRCLAM
    KalmanFilter,
}

#[derive(Debug, Args)]
pub struct SlamOptions {
    #[command(flatten)]
    common: EvaluateOptions,

    /// Method of SLAM
    #[arg(long, value_enum, default_value = "graph")]
    method: MethodArgument,

    /// Write the map, as ROS's map.yaml with an image beside it
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum MethodArgument {
    /// Pose graph with loop closure
    Graph,
    /// Rao-Blackwellized particle filter
    ParticleFilter,
}

#[derive(Debug, Args)]
pub struct LocalPlanningOptions {
    #[command(flatten)]
    common: EvaluateOptions,

    /// Local planner
    #[arg(long, value_enum, default_value = "mppi")]
    planner: PlannerArgument,

    /// Seed of the laser's noise and of the planner
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum PlannerArgument {
    /// Model predictive path integral control
    Mppi,
    /// Dynamic window approach with the parameters published with the challenge
    Dwa,
}

#[derive(Debug, Args)]
pub struct ExplorationOptions {
    #[command(flatten)]
    common: EvaluateOptions,

    /// Number of starts in each building
    #[arg(long, value_name = "NUMBER", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    starts: u32,
}

fn evaluate_localization(options: &LocalizationOptions) -> Result<Vec<Evaluation>, DataError> {
    let LocalizationOptions { data, method, starts, .. } = options;
    let mut evaluations = match method {
        Some(LocalizationMethod::KalmanFilter) => Vec::new(),
        _ => localization::evaluate(data.as_deref(), *starts as usize)?,
    };
    if let Some(data) = data
        && *method != Some(LocalizationMethod::MonteCarlo)
    {
        evaluations.extend(mrclam::evaluate(&data.join("mrclam"))?);
    }
    Ok(evaluations)
}

/// Prints the figures; returns what the process ends with.
pub fn evaluate(verb: &EvaluateVerb) -> Result<u8, Failure> {
    let (is_json, evaluations) = match verb {
        EvaluateVerb::Planning(options) => (options.json, planning::evaluate(&options.data)?),
        EvaluateVerb::Localization(options) => (options.json, evaluate_localization(options)?),
        EvaluateVerb::Slam(SlamOptions { common, method, map }) => {
            let method = match method {
                MethodArgument::Graph => SlamMethod::Graph,
                MethodArgument::ParticleFilter => SlamMethod::ParticleFilter,
            };
            (common.json, vec![slam::evaluate(&common.data, method, map.as_deref())?])
        }
        EvaluateVerb::LocalPlanning(LocalPlanningOptions { common, planner, seed }) => {
            let kind = match planner {
                PlannerArgument::Mppi => LocalPlannerKind::Mppi,
                PlannerArgument::Dwa => LocalPlannerKind::Dwa,
            };
            (common.json, vec![local_planning::evaluate(&common.data, kind, *seed)?])
        }
        EvaluateVerb::Exploration(ExplorationOptions { common, starts }) => {
            (common.json, exploration::evaluate(&common.data, u64::from(*starts))?)
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
