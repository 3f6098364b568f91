//! Measured figures and their text.

use serde_json::json;
use slate_evaluation::local_planning::LocalPlannerKind;
use slate_evaluation::slam::SlamMethod;
use slate_evaluation::{
    DataError, Evaluation, Figure, exploration, local_planning, localization, mrclam, planning, slam,
};

use super::{
    EvaluateVerb, ExplorationOptions, LocalPlanningOptions, LocalizationMethod, LocalizationOptions,
    MethodArgument, PlannerArgument, SlamOptions,
};
use crate::failure::{ASSERTION_FALSE, Failure};
use crate::output;

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

/// Prints the figures; returns the exit code.
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
