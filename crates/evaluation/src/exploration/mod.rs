//! Exploration of unknown buildings.
//! A TurtleBot3 Burger as in Explore-Bench (Xu et al., 2022), with its pose known and a laser without noise.

mod building;
mod drive;

use std::path::Path;

use slate_exploration::GoalSelection;

use crate::trials::each;
use crate::{DataError, Evaluation, Figure, FigureGoal};
use building::UnknownBuilding;
use drive::{ExplorationRun, ROBOT_RADIUS, explore};

/// Explores all buildings of a folder's `maps` from `starts` starts.
/// By information gain and to the nearest frontier.
///
/// # Errors
/// The folder has no building, or one that can't be used.
pub fn evaluate(folder: &Path, starts: u64) -> Result<Vec<Evaluation>, DataError> {
    let buildings = UnknownBuilding::read_folder(&folder.join("maps"), ROBOT_RADIUS)?;
    Ok(buildings.iter().map(|building| evaluate_building(building, starts)).collect())
}

type ExplorationRuns = Vec<Option<ExplorationRun>>;

fn evaluate_building(building: &UnknownBuilding, starts: u64) -> Evaluation {
    let nearest = runs(building, GoalSelection::NearestFrontier, starts);
    let views = runs(building, GoalSelection::NextBestView, starts);
    // Of both the same starts.
    let is_finished = |run: &Option<ExplorationRun>| run.is_some_and(|run| run.time_to_99.is_some());
    let both: Vec<bool> = nearest.iter().zip(&views).map(|(a, b)| is_finished(a) && is_finished(b)).collect();
    let mean = |runs: &ExplorationRuns, of: TimeOf| {
        let finished = runs.iter().zip(&both).filter(|(_, is_finished)| **is_finished);
        let values: Vec<f64> = finished.filter_map(|(run, _)| of(run.as_ref()?)).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let (mut figures, mut notes) = (Vec::new(), Vec::new());
    for (name, runs) in [("nearest frontier", &nearest), ("next best view", &views)] {
        let failed: Vec<usize> = (0..runs.len()).filter(|seed| !is_finished(&runs[*seed])).collect();
        figures.push(
            Figure::new(format!("{name}: runs that end below 99 %"), failed.len() as f64)
                .with_goal(FigureGoal::AtMost(0.0)),
        );
        let length: TimeOf = |run| Some(run.path_length);
        for (what, of) in TIMES.into_iter().chain([("path length, m", length)]) {
            figures.push(Figure::new(format!("{name}: mean {what}"), mean(runs, of)));
        }
        if !failed.is_empty() {
            notes.push(format!("{name}: seeds that end below 99 %: {failed:?}"));
        }
    }
    for (name, time) in TIMES {
        let under = 100.0 * (1.0 - mean(&views, time) / mean(&nearest, time));
        let figure = Figure::new(format!("{name} under that of nearest frontier, %"), under);
        figures.push(figure.with_goal(FigureGoal::AtLeast(10.0)));
    }
    Evaluation { name: building.name.clone(), figures, notes }
}

type TimeOf = fn(&ExplorationRun) -> Option<f64>;
const TIMES: [(&str, TimeOf); 2] = [("T90, s", |run| run.time_to_90), ("T99, s", |run| run.time_to_99)];

/// Returns the runs of all seeds, in their order.
fn runs(building: &UnknownBuilding, selection: GoalSelection, starts: u64) -> ExplorationRuns {
    each(starts as usize, |seed| explore(building, selection, seed))
}
