//! Exploration of buildings that are unknown: a TurtleBot3 Burger as in Explore-Bench (Xu et al., 2022), with its
//! pose known and a laser without noise.

mod building;
mod drive;

use std::path::Path;

use slate_exploration::GoalSelection;

use crate::trials::each;
use crate::{DataError, Evaluation, Figure, FigureGoal};
use building::UnknownBuilding;
use drive::{ExplorationRun, ROBOT_RADIUS, explore};

/// Explores all buildings of a folder's `maps` from that many starts, by information gain and to the nearest frontier.
///
/// # Errors
/// The folder has no building, or one that can't be used.
pub fn evaluate(folder: &Path, starts: u64) -> Result<Vec<Evaluation>, DataError> {
    let buildings = UnknownBuilding::read_folder(&folder.join("maps"), ROBOT_RADIUS)?;
    Ok(buildings.iter().map(|building| evaluate_building(building, starts)).collect())
}

fn evaluate_building(building: &UnknownBuilding, starts: u64) -> Evaluation {
    let nearest = runs(building, GoalSelection::NearestFrontier, starts);
    let views = runs(building, GoalSelection::NextBestView, starts);
    let (mut figures, mut notes) = (Vec::new(), Vec::new());
    for (name, runs) in [("nearest frontier", &nearest), ("next best view", &views)] {
        let failed = |run: &&(u64, ExplorationRun)| run.1.time_to_99.is_none();
        let failed: Vec<u64> = runs.iter().filter(failed).map(|(seed, _)| *seed).collect();
        figures.push(
            Figure::new(format!("{name}: runs that end below 99 %"), failed.len() as f64)
                .with_goal(FigureGoal::AtMost(0.0)),
        );
        figures.push(Figure::new(format!("{name}: mean T90, s"), mean(runs, |run| run.time_to_90)));
        figures.push(Figure::new(format!("{name}: mean T99, s"), mean(runs, |run| run.time_to_99)));
        let length = mean(runs, |run| Some(run.path_length));
        figures.push(Figure::new(format!("{name}: mean path length, m"), length));
        if !failed.is_empty() {
            notes.push(format!("{name}: seeds that end below 99 %: {failed:?}"));
        }
    }
    type TimeOf = fn(&ExplorationRun) -> Option<f64>;
    let times: [(&str, TimeOf); 2] = [("T90", |run| run.time_to_90), ("T99", |run| run.time_to_99)];
    for (name, time) in times {
        let under = 100.0 * (1.0 - mean(&views, time) / mean(&nearest, time));
        let figure = Figure::new(format!("{name} under that of nearest frontier, %"), under);
        figures.push(figure.with_goal(FigureGoal::AtLeast(10.0)));
    }
    Evaluation { name: building.name.clone(), figures, notes }
}

/// Runs of all seeds, in their order.
fn runs(building: &UnknownBuilding, selection: GoalSelection, starts: u64) -> Vec<(u64, ExplorationRun)> {
    let runs = each(starts as usize, |seed| Some((seed, explore(building, selection, seed)?)));
    runs.into_iter().flatten().collect()
}

fn mean(runs: &[(u64, ExplorationRun)], of: impl Fn(&ExplorationRun) -> Option<f64>) -> f64 {
    let values: Vec<f64> = runs.iter().filter_map(|(_, run)| of(run)).collect();
    values.iter().sum::<f64>() / values.len() as f64
}
