//! Behavior of R2: patrols the corners, with a new plan for each.
//! Section 6.5 of the paper.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::prelude::*;
use slate_wheeled::analyzes::Surroundings;
use slate_wheeled::goals::Goals;
use slate_wheeled::navigator::{Navigator, must_replan};

/// Percepts and outputs of the Plan.
#[ports]
pub struct PatrolPorts {
    range: Noticed<Surroundings>,
    position: Noticed<Position>,
    orientation: Noticed<Orientation>,
    /// Corners, from Knowledge.
    goals: Input<Goals>,
    /// Next corner.
    goal: Output<Point2>,
}

/// Parameters of the patrol: velocities.
#[params]
pub struct PatrolParams {
    #[param(default = 0.4, range = 0.0..=3.0, unit = "m/s", doc = "maximum linear velocity in free space")]
    pub max_linear_velocity: f64,
    #[param(default = 0.3, range = 0.0..=3.0, unit = "m/s", doc = "maximum linear velocity in crowded space")]
    careful_linear_velocity: f64,
    #[param(default = 0.08, range = 0.001..=1.0, unit = "m", doc = "distance from a corner at which it counts as reached")]
    pub goal_tolerance: f64,
    #[param(default = 20.0, range = 0.1..=1e6, unit = "s", doc = "time without progress after which it leaves a corner for the next lap")]
    progress_timeout: f64,
}

/// Less than this is not nearer, meters.
const NEARER: f64 = 0.05;

/// State of the Plan.
#[derive(Default, Serialize, Deserialize)]
pub struct PatrolMemory {
    #[serde(alias = "journey")]
    navigator: Navigator,
    /// Index of the next corner.
    corner: usize,
    /// Nearest distance to that corner, meters, and its time, seconds.
    nearest: Option<(f64, f64)>,
}

/// Visits the four corners again and again.
pub struct PatrolPlanner;

impl Plan for PatrolPlanner {
    const NAME: &'static str = "patrol_planner";
    const DOC: &'static str = "Sends the robot to the four corners, one after the other, again and again.";
    type Noticed = PatrolPorts;
    type Params = PatrolParams;
    type State = PatrolMemory;

    fn run(
        memory: &mut PatrolMemory,
        noticed: &PatrolPorts,
        situation: &Situation<'_>,
        params: &PatrolParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let room_changed = memory.navigator.update(&noticed.range, &noticed.position, &noticed.orientation);
        let Some(goals) = noticed.goals.get() else { return };
        let Some(mut corner) = goals.get(memory.corner) else { return };
        let has_arrived = Navigator::has_arrived(situation) && memory.navigator.is_goal(corner);
        if has_arrived || memory.is_stuck(corner, params, now.seconds()) {
            memory.corner = (memory.corner + 1) % goals.list.len();
            memory.nearest = None;
            corner = goals.get(memory.corner).unwrap_or(corner);
        }
        noticed.goal.set(corner);
        if memory.navigator.position().is_none() {
            return;
        }
        let speeds = [params.max_linear_velocity, params.careful_linear_velocity];
        let is_changed = room_changed || memory.navigator.is_outdated(corner, speeds);
        if situation.needs_plan() || must_replan(is_changed, situation) {
            memory.navigator.send_goal(corner, speeds, params.goal_tolerance, plan);
        }
    }
}

impl PatrolMemory {
    /// Returns true if it has come no nearer to the corner for too long.
    /// It plans without knowledge of obstacles there.
    fn is_stuck(&mut self, corner: Point2, params: &PatrolParams, time: f64) -> bool {
        let Some((x, y)) = self.navigator.position() else { return false };
        let distance = math::hypot(corner.x - x, corner.y - y);
        let (nearest, since) = *self.nearest.get_or_insert((distance, time));
        if distance < nearest - NEARER {
            self.nearest = Some((distance, time));
        }
        time - since > params.progress_timeout
    }
}
