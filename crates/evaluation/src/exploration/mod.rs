//! Exploration of buildings that are unknown: a TurtleBot3 Burger as in Explore-Bench (Xu et al., 2022), with its
//! pose known and a laser without noise.

mod building;
mod drive;

use std::path::Path;

use slate_exploration::GoalSelection;

use crate::{DataError, Evaluation, Figure, FigureGoal};
use building::Building;
use drive::{ExplorationRun, ROBOT_RADIUS, explore};

/// Explores all buildings of a folder's `maps` from that many starts, by information gain and to the nearest frontier.
///
/// # Errors
/// The folder has no building, or one that can't be used.
pub fn evaluate(folder: &Path, starts: u64) -> Result<Vec<Evaluation>, DataError> {
    let buildings = Building::read_folder(&folder.join("maps"), ROBOT_RADIUS)?;
    Ok(buildings.iter().map(|building| evaluate_building(building, starts)).collect())
}

fn evaluate_building(building: &Building, starts: u64) -> Evaluation {
    let nearest = runs(building, GoalSelection::NearestFrontier, starts);
    let views = runs(building, GoalSelection::NextBestView, starts);
    let mut figures = of_runs("nearest frontier", &nearest);
    figures.extend(of_runs("next best view", &views));
    type TimeOf = fn(&ExplorationRun) -> Option<f64>;
    let times: [(&str, TimeOf); 2] = [("T90", |run| run.time_to_90), ("T99", |run| run.time_to_99)];
    for (name, time) in times {
        let under = 100.0 * (1.0 - mean(&views, time) / mean(&nearest, time));
        let figure = Figure::new(format!("{name} under that of nearest frontier, %"), under);
        figures.push(figure.with_goal(FigureGoal::AtLeast(10.0)));
    }
    Evaluation { name: building.name.clone(), figures, notes: failed }
}

fn runs(building: &Building, selection: GoalSelection, starts: u64) -> Vec<ExplorationRun> {
    (0..starts).filter_map(|seed| explore(building, selection, seed)).collect()
}

fn of_runs(name: &str, runs: &[ExplorationRun]) -> Vec<Figure> {
    let missed = runs.iter().filter(|run| run.time_to_99.is_none()).count();
    vec![
        Figure::new(format!("{name}: runs that end below 99 %"), missed as f64)
            .with_goal(FigureGoal::AtMost(0.0)),
        Figure::new(format!("{name}: mean T90, s"), mean(runs, |run| run.time_to_90)),
        Figure::new(format!("{name}: mean T99, s"), mean(runs, |run| run.time_to_99)),
        Figure::new(format!("{name}: mean path length, m"), mean(runs, |run| Some(run.path_length))),
    ]
}

fn mean(runs: &[ExplorationRun], of: impl Fn(&ExplorationRun) -> Option<f64>) -> f64 {
    let values: Vec<f64> = runs.iter().filter_map(of).collect();
    values.iter().sum::<f64>() / values.len() as f64
}
