//! R2's behaviour: one goal after the other, a new plan for each.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;
use slate_wheeled::analyzes::Surroundings;
use slate_wheeled::journey::{Journey, changes_speed};

/// What the Plan notices, and what it lets others know.
#[ports]
pub struct PatrolNoticing {
    range: Noticed<Surroundings>,
    position: Noticed<Position>,
    orientation: Noticed<Orientation>,
    /// Where it goes now.
    goal: Output<Point2>,
}

/// Where and how fast the robot goes.
#[params]
pub struct PatrolParams {
    #[param(default = 2.0, range = 0.0..=1000.0, unit = "m", doc = "corners are so far to the east and west of the origin")]
    east: f64,
    #[param(default = 2.0, range = 0.0..=1000.0, unit = "m", doc = "corners are so far to the north and south of the origin")]
    north: f64,
    #[param(default = 0.4, range = 0.0..=1.2, unit = "m/s", doc = "speed where there is room")]
    speed: f64,
    #[param(default = 0.3, range = 0.0..=1.2, unit = "m/s", doc = "speed where it is crowded")]
    careful_speed: f64,
    #[param(default = 0.08, range = 0.001..=1.0, unit = "m", doc = "a corner is reached within this distance")]
    tolerance: f64,
}

/// The order in which the authors' robot visits the corners: signs of x and y.
const CORNERS: [(f64, f64); 4] = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];

/// What the Plan remembers.
#[derive(Default, Serialize, Deserialize)]
pub struct PatrolMemory {
    journey: Journey,
    /// Which corner is next.
    corner: usize,
}

/// Visits the four corners again and again.
pub struct PatrolPlanner;

impl Plan for PatrolPlanner {
    const NAME: &'static str = "patrol_planner";
    const DOC: &'static str = "Sends the robot to the four corners, one after the other.";
    type Noticed = PatrolNoticing;
    type Params = PatrolParams;
    type State = PatrolMemory;

    fn run(
        memory: &mut PatrolMemory,
        noticed: &PatrolNoticing,
        situation: &Situation<'_>,
        params: &PatrolParams,
        _: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let room_changed = memory.journey.notice(&noticed.range, &noticed.position, &noticed.orientation);
        if Journey::has_arrived(situation) {
            memory.corner = (memory.corner + 1) % CORNERS.len();
        }
        let (east, north) = CORNERS[memory.corner];
        let goal = Point2 { x: east * params.east, y: north * params.north };
        noticed.goal.set(goal);
        if memory.journey.position().is_none() {
            return;
        }
        if situation.needs_plan() || changes_speed(room_changed, situation) {
            memory.journey.go(goal, [params.speed, params.careful_speed], params.tolerance, plan);
        }
    }
}
