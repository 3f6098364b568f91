//! Global planners on the MovingAI benchmarks.

mod any_angle;
mod unknown;

use std::path::Path;
use std::time::Instant;

use slate_planning::{AStar, ThetaStar};

use crate::figures::percentile;
use crate::movingai::{Benchmark, PathProblem, read_folder};
use crate::{DataError, Evaluation, Figure, FigureGoal};

pub use any_angle::shortest_any_angle;

/// Lengths in scenarios have six significant digits.
const DIGITS: f64 = 5e-6;
/// Sample size: problems of a map for the costly comparisons.
/// They are compared with the shortest path of any angle, and driven in unknown space; spread evenly over the file.
const SAMPLE: usize = 60;

/// Evaluates A*, Theta* and D* Lite on all maps of a folder.
/// Or of its folder `movingai`, a table for each.
///
/// # Errors
/// The folder has no benchmark, or an invalid one.
pub fn evaluate(folder: &Path) -> Result<Vec<Evaluation>, DataError> {
    let own = folder.join("movingai");
    let folder = if own.is_dir() { &own } else { folder };
    Ok(read_folder(folder)?.iter().map(evaluate_map).collect())
}

fn evaluate_map(benchmark: &Benchmark) -> Evaluation {
    let name = benchmark.map.file_stem().unwrap_or_default().to_string_lossy();
    let mut figures = exact_lengths(benchmark);
    figures.extend(any_angle_lengths(benchmark));
    figures.extend(unknown::evaluate(&benchmark.grid, &sample(&benchmark.problems)));
    Evaluation {
        name: format!("{name} ({} x {} cells)", benchmark.grid.width(), benchmark.grid.height()),
        figures,
        notes: Vec::new(),
    }
}

/// Returns the problems that are not trivial, thinned.
fn sample(problems: &[PathProblem]) -> Vec<&PathProblem> {
    let count = problems.len().min(SAMPLE);
    (0..count).map(|k| &problems[(k + 1) * problems.len() / count - 1]).collect()
}

fn exact_lengths(benchmark: &Benchmark) -> Vec<Figure> {
    let mut planner = AStar::default();
    let mut wrong = 0;
    let mut times = Vec::new();
    for problem in &benchmark.problems {
        let (found, took) =
            timed(|| planner.search(&benchmark.grid, problem.start, problem.goal).map(|path| path.cost()));
        times.push(took);
        let tolerance = DIGITS * problem.length + 1e-9;
        wrong += usize::from(found.is_none_or(|found| (found - problem.length).abs() > tolerance));
    }
    vec![
        Figure::new("problems", benchmark.problems.len() as f64),
        Figure::new("A*: lengths that are not the file's", wrong as f64).with_goal(FigureGoal::AtMost(0.0)),
        Figure::new("A*: median time, ms", percentile(&mut times, 0.5)).with_goal(FigureGoal::AtMost(5.0)),
        Figure::new("A*: 99th percentile, ms", percentile(&mut times, 0.99)),
    ]
}

fn any_angle_lengths(benchmark: &Benchmark) -> Vec<Figure> {
    let mut planner = ThetaStar::default();
    let (mut times, mut excess, mut missed) = (Vec::new(), Vec::new(), 0);
    for problem in &benchmark.problems {
        let search = || planner.search(&benchmark.grid, problem.start, problem.goal).map(|path| path.cost());
        let (found, took) = timed(search);
        times.push(took);
        missed += usize::from(found.is_none());
    }
    for problem in sample(&benchmark.problems) {
        let found = planner.search(&benchmark.grid, problem.start, problem.goal).map(|path| path.cost());
        let shortest = shortest_any_angle(&benchmark.grid, problem.start, problem.goal);
        if let (Some(found), Some(shortest)) = (found, shortest)
            && shortest > 0.0
        {
            excess.push(100.0 * (found / shortest - 1.0));
        }
    }
    let mean = excess.iter().sum::<f64>() / excess.len().max(1) as f64;
    vec![
        Figure::new("Theta*: problems without a path", missed as f64).with_goal(FigureGoal::AtMost(0.0)),
        Figure::new("Theta*: mean excess over the shortest path, %", mean).with_goal(FigureGoal::AtMost(1.0)),
        Figure::new("Theta*: largest excess, %", percentile(&mut excess, 1.0))
            .with_goal(FigureGoal::AtMost(1.0)),
        Figure::new("Theta*: median time, ms", percentile(&mut times, 0.5)),
    ]
}

/// Returns the result of work, and its time in ms.
#[allow(
    clippy::disallowed_methods,
    reason = "the time that a search takes is measured, and no module sees it"
)]
pub(crate) fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let start = Instant::now();
    let result = work();
    (result, 1e3 * start.elapsed().as_secs_f64())
}
