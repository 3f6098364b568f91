//! Local planners in the worlds of the BARN challenge.

mod jackal;
mod navigation;
mod settings;

use std::path::Path;

use slate_interfaces::{Point2, Pose2};
use slate_module::math::{self, max};

use crate::barn::{BarnWorld, read_folder};
use crate::trials::each;
use crate::{DataError, Evaluation, Figure, FigureGoal};

use jackal::Jackal;
use navigation::{BarnNavigation, PERIOD};

/// Start and goal of all worlds, m and rad.
const START: Pose2 = Pose2 { x: -2.25, y: 3.0, theta: std::f64::consts::FRAC_PI_2 };
const GOAL: Point2 = Point2 { x: -2.25, y: 13.0 };
/// Distance from the goal at which a run succeeds, m.
const GOAL_TOLERANCE: f64 = 1.0;
/// Time of a run, s.
const TIMEOUT: f64 = 100.0;
/// Speed of the best path's time, m/s.
const FASTEST: f64 = 2.0;

/// Published success rates of DWA by the challenge's authors.
/// Its 50 test worlds with 10 runs each, and the same run again.
const PUBLISHED_DWA_SUCCESS: [f64; 2] = [0.85, 0.88];
const PUBLISHED_DWA_SCORE: [f64; 2] = [0.159, 0.169];

/// Local planner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocalPlannerKind {
    /// Model predictive path integral control, [`slate_local_planning::Mppi`].
    Mppi,
    /// Dynamic window approach, [`slate_local_planning::Dwa`].
    Dwa,
}

/// End of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// Goal reached.
    Success,
    /// Contact with a cylinder.
    Collision,
    /// Time limit exceeded.
    Timeout,
}

/// Run in a world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarnRun {
    /// Number of the world.
    pub world: u32,
    /// End of the run.
    pub end: RunEnd,
    /// End time of the run, s.
    pub time: f64,
    /// Score of the challenge, 0 to 0.5.
    pub score: f64,
}

/// Evaluates a local planner in all worlds of a folder, with noise of that seed.
///
/// # Errors
/// The folder has no worlds, or invalid ones.
pub fn evaluate(folder: &Path, kind: LocalPlannerKind, seed: u64) -> Result<Evaluation, DataError> {
    let worlds = read_folder(folder)?;
    let runs = each(worlds.len(), |at| run(&worlds[at as usize], kind, seed));
    let runs: Vec<BarnRun> = runs.into_iter().flatten().collect();
    Ok(summary(&runs, kind))
}

/// Drives in a world; `None` if the planner's settings are invalid.
pub fn run(world: &BarnWorld, kind: LocalPlannerKind, seed: u64) -> Option<BarnRun> {
    let mut robot = Jackal::new(world, seed, START)?;
    let mut navigation = BarnNavigation::new(kind, seed, &START, GOAL)?;
    let (mut cycle, mut end) = (0_u32, RunEnd::Timeout);
    while f64::from(cycle) * PERIOD < TIMEOUT {
        let command = navigation.step(&mut robot, f64::from(cycle) * PERIOD);
        robot.drive(command, PERIOD);
        cycle += 1;
        let pose = robot.state.pose;
        if robot.has_collided {
            end = RunEnd::Collision;
            break;
        }
        if math::hypot(pose.x - GOAL.x, pose.y - GOAL.y) <= GOAL_TOLERANCE {
            end = RunEnd::Success;
            break;
        }
    }
    let time = f64::from(cycle) * PERIOD;
    Some(BarnRun { world: world.number, end, time, score: score(world, end, time) })
}

/// Returns the score of the challenge: success x T / clip(time, 2 T, 8 T).
/// T is the time of the best path at full speed.
fn score(world: &BarnWorld, end: RunEnd, time: f64) -> f64 {
    let best = world.path_length / FASTEST;
    if end == RunEnd::Success { best / math::clamp(time, 2.0 * best, 8.0 * best) } else { 0.0 }
}

fn summary(runs: &[BarnRun], kind: LocalPlannerKind) -> Evaluation {
    let all = runs.len().max(1) as f64;
    let count = |end: RunEnd| runs.iter().filter(|run| run.end == end).count() as f64;
    let times = runs.iter().filter(|run| run.end == RunEnd::Success).map(|run| run.time);
    let sum: f64 = times.sum();
    let mean_score = runs.iter().map(|run| run.score).sum::<f64>() / all;
    let success = count(RunEnd::Success) / all;
    let mut figures = goals(kind, success, mean_score);
    figures.extend([
        Figure::new("worlds", runs.len() as f64),
        Figure::new("collision", count(RunEnd::Collision) / all),
        Figure::new("time-out", count(RunEnd::Timeout) / all),
    ]);
    if sum > 0.0 {
        figures.push(Figure::new("mean time to the goal, s", sum / count(RunEnd::Success)));
    }
    let failed = runs.iter().filter(|run| run.end != RunEnd::Success).map(|run| {
        let end = if run.end == RunEnd::Collision { "collision" } else { "time-out" };
        format!("world {}: {end} after {:.1} s", run.world, run.time)
    });
    let notes = failed.collect();
    let planner = match kind {
        LocalPlannerKind::Mppi => "MPPI",
        LocalPlannerKind::Dwa => "DWA",
    };
    Evaluation { name: format!("{planner} in BARN worlds, own physics"), figures, notes }
}

fn goals(kind: LocalPlannerKind, success: f64, score: f64) -> Vec<Figure> {
    let rate = Figure::new("success", success);
    let scored = Figure::new("score, at most 0.5", score);
    if kind == LocalPlannerKind::Mppi {
        return vec![rate.with_goal(FigureGoal::AtLeast(0.95)), scored.with_goal(FigureGoal::AtLeast(0.42))];
    }
    // Difference of the physics from the challenge's.
    let apart = |name: &str, value: f64, [low, high]: [f64; 2]| {
        let distance = max(0.0, max(low - value, value - high));
        Figure::new(format!("{name}: distance from the published {low} to {high}"), distance)
            .with_goal(FigureGoal::AtMost(0.05))
    };
    vec![
        rate,
        scored,
        apart("success", success, PUBLISHED_DWA_SUCCESS),
        apart("score", score, PUBLISHED_DWA_SCORE),
    ]
}
