//! The deliberative behaviour: straight to the goal, as if nothing stood in the way.

use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::analyzes::Surroundings;
use crate::journey::{Journey, must_change};
use crate::locate_robot::Located;

/// What the Plan notices, and what it knows.
#[ports]
pub struct Noticing {
    range: Noticed<Surroundings>,
    position: Noticed<Position>,
    orientation: Noticed<Orientation>,
    /// Another robot, if there is a sensor that sees some.
    other: Noticed<Located>,
    /// Where the robot shall go, from the robot's knowledge.
    goal: Input<Point2>,
}

/// How fast the robot goes.
#[params]
pub struct GoToOriginParams {
    #[param(default = 0.4, range = 0.0..=3.0, unit = "m/s", doc = "speed where there is room")]
    speed: f64,
    #[param(default = 0.3, range = 0.0..=3.0, unit = "m/s", doc = "speed where it is crowded, or another robot is near")]
    careful_speed: f64,
    #[param(default = 0.05, range = 0.001..=1.0, unit = "m", doc = "the goal is reached within this distance")]
    tolerance: f64,
    #[param(default = 0.15, range = 0.001..=10.0, unit = "m", doc = "who has arrived stays until it is farther away than this")]
    leave: f64,
}

/// What the Plan remembers.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Memory {
    journey: Journey,
    /// Whether it was at the goal, and has not been moved away since.
    arrived: bool,
}

/// Sends the robot to its goal, and again from wherever a reflex has left it.
pub struct GoToOriginPlanner;

impl Plan for GoToOriginPlanner {
    const NAME: &'static str = "go_to_origin_planner";
    const DOC: &'static str = "Sends the robot to its goal.";
    type Noticed = Noticing;
    type Params = GoToOriginParams;
    type State = Memory;

    fn run(
        memory: &mut Memory,
        noticed: &Noticing,
        situation: &Situation<'_>,
        params: &GoToOriginParams,
        _: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let room_changed = memory.journey.notice(&noticed.range, &noticed.position, &noticed.orientation);
        let met = memory.journey.meet(&noticed.other);
        // Without a goal and a pose there is nothing to plan.
        let (Some(goal), Some((x, y))) = (noticed.goal.fresh(), memory.journey.position()) else {
            return;
        };
        if Journey::has_arrived(situation) && memory.journey.leads_to(*goal) {
            memory.journey.arrive();
            memory.arrived = true;
            return;
        }
        let distance = math::hypot(goal.x - x, goal.y - y);
        memory.arrived &= distance <= params.leave && memory.journey.leads_to(*goal);
        let away = !memory.arrived && distance > params.tolerance;
        let speeds = [params.speed, params.careful_speed];
        let is_changed = room_changed || met || memory.journey.is_outdated(*goal, speeds);
        // A reflex leaves the robot elsewhere, so the plan is made anew from there.
        if (away && situation.needs_plan()) || must_change(is_changed, situation) {
            memory.journey.go(*goal, speeds, params.tolerance, plan);
        }
    }
}
