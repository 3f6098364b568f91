//! R2's behaviour: one goal after the other, a new plan for each.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::prelude::*;
use slate_wheeled::actions::{SetWheelSpeed, Speeds};
use slate_wheeled::analyzes::Surroundings;
use slate_wheeled::journey::{Journey, must_change};

/// Percepts and outputs of the Plan.
#[ports]
pub struct PatrolNoticing {
    range: Noticed<Surroundings>,
    position: Noticed<Position>,
    orientation: Noticed<Orientation>,
    /// Present goal.
    goal: Output<Point2>,
}

/// Where and how fast the robot goes.
#[params]
pub struct PatrolParams {
    #[param(default = 2.0, range = 0.0..=1000.0, unit = "m", doc = "x of the corners, on both sides of the origin")]
    pub corner_x: f64,
    #[param(default = 2.0, range = 0.0..=1000.0, unit = "m", doc = "y of the corners, on both sides of the origin")]
    corner_y: f64,
    #[param(default = 0.4, range = 0.0..=3.0, unit = "m/s", doc = "maximum linear velocity in free space")]
    pub max_linear_velocity: f64,
    #[param(default = 0.3, range = 0.0..=3.0, unit = "m/s", doc = "maximum linear velocity in crowded space")]
    careful_linear_velocity: f64,
    #[param(default = 0.08, range = 0.001..=1.0, unit = "m", doc = "distance from a corner at which it counts as reached")]
    goal_tolerance: f64,
    #[param(default = 10.0, range = 0.1..=1e6, unit = "s", doc = "time without progress after which it makes room for another robot")]
    progress_timeout: f64,
}

/// The order in which the authors' robot visits the corners: signs of x and y.
const CORNERS: [(f64, f64); 4] = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];

/// Position to make room: fraction of the way from the origin to the corner, out of range of sonars at the corner.
const ASIDE: f64 = 0.4;
/// Time before the next attempt, seconds.
const ROOM_TIME: f64 = 12.0;
/// Less than this is not nearer, metres.
const NEARER: f64 = 0.05;

/// State of the Plan.
#[derive(Default, Serialize, Deserialize)]
pub struct PatrolMemory {
    journey: Journey,
    /// Which corner is next.
    corner: usize,
    /// How near it came to that corner, metres, and when, seconds.
    nearest: Option<(f64, f64)>,
    /// Until when it makes room, seconds.
    aside: Option<f64>,
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
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let time = now.seconds();
        let room_changed = memory.journey.notice(&noticed.range, &noticed.position, &noticed.orientation);
        let has_arrived = Journey::has_arrived(situation);
        if has_arrived && memory.aside.is_none() {
            memory.corner = (memory.corner + 1) % CORNERS.len();
            memory.nearest = None;
        }
        let (east, north) = CORNERS[memory.corner];
        let corner = Point2 { x: east * params.corner_x, y: north * params.corner_y };
        let was_aside = memory.aside.is_some();
        let Some((x, y)) = memory.journey.position() else {
            noticed.goal.set(corner);
            return;
        };
        memory.make_room(math::hypot(corner.x - x, corner.y - y), params.progress_timeout, time);
        let (goal, left) = match memory.aside {
            Some(until) => (Point2 { x: ASIDE * corner.x, y: ASIDE * corner.y }, until - time),
            None => (corner, 0.0),
        };
        noticed.goal.set(goal);
        if has_arrived && left > 0.0 {
            plan.replace(SetWheelSpeed::request(Speeds { left: 0.0, right: 0.0, duration: left }));
            return;
        }
        let turns = memory.aside.is_some() != was_aside && !situation.is_reactive();
        let speeds = [params.max_linear_velocity, params.careful_linear_velocity];
        let is_changed = room_changed || memory.journey.is_outdated(goal, speeds);
        if turns || situation.needs_plan() || must_change(is_changed, situation) {
            memory.journey.go(goal, speeds, params.goal_tolerance, plan);
        }
    }
}

impl PatrolMemory {
    /// This robot may block another in the corner, which leaves when it has room.
    fn make_room(&mut self, distance: f64, patience: f64, time: f64) {
        if let Some(until) = self.aside {
            if time >= until - 1e-9 {
                (self.aside, self.nearest) = (None, None);
            }
            return;
        }
        let (nearest, since) = *self.nearest.get_or_insert((distance, time));
        if distance < nearest - NEARER {
            self.nearest = Some((distance, time));
        } else if time - since > patience {
            self.aside = Some(time + ROOM_TIME);
        }
    }
}
