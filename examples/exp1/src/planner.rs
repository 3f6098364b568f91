//! The deliberative behaviour: straight to the goal, as if nothing stood in the way.

use slate::interfaces::{Orientation, Point2, Position};
use slate::mapek::prelude::*;
use slate::prelude::*;

use crate::actions::{GoToOrigin, Leg};
use crate::analyzes::Surroundings;

/// What the Plan notices, and what it knows.
#[ports]
pub struct Noticing {
    range: Noticed<Surroundings>,
    position: Noticed<Position>,
    orientation: Noticed<Orientation>,
    /// Where the robot shall go, from the robot's knowledge.
    goal: Input<Point2>,
}

/// How fast the robot goes.
#[params]
pub struct GoToOriginParams {
    #[param(default = 0.4, range = 0.0..=1.2, unit = "m/s", doc = "speed where there is room")]
    speed: f64,
    #[param(default = 0.3, range = 0.0..=1.2, unit = "m/s", doc = "speed where it is crowded")]
    careful_speed: f64,
    #[param(default = 0.05, range = 0.001..=1.0, unit = "m", doc = "the goal is reached within this distance")]
    tolerance: f64,
}

/// Whether the robot drives with care.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Caution {
    crowded: bool,
}

/// Sends the robot to its goal, and again from wherever a reflex has left it.
pub struct GoToOriginPlanner;

impl Plan for GoToOriginPlanner {
    const NAME: &'static str = "go_to_origin_planner";
    const DOC: &'static str = "Sends the robot to its goal.";
    type Noticed = Noticing;
    type Params = GoToOriginParams;
    type State = Caution;

    fn run(
        caution: &mut Caution,
        noticed: &Noticing,
        situation: &Situation<'_>,
        params: &GoToOriginParams,
        _: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let was = caution.crowded;
        if let Some(surroundings) = noticed.range.newest() {
            caution.crowded = surroundings.crowded.get();
        }
        // Without a position there is nothing to plan from.
        let Some(goal) = noticed.goal.fresh() else { return };
        let arrived = situation.ended().any(|ended| {
            ended.kind.as_str() == GoToOrigin::KIND && ended.ending == slate::mapek::Ending::COMPLETED
        });
        if arrived {
            return;
        }
        let speed = if caution.crowded { params.careful_speed } else { params.speed };
        // A reflex leaves the robot elsewhere, so the plan is made anew from there; a change of room changes the speed.
        if situation.needs_plan() || (was != caution.crowded && !situation.is_reactive()) {
            plan.replace(GoToOrigin::request(Leg {
                x: goal.x,
                y: goal.y,
                speed,
                tolerance: params.tolerance,
            }));
        }
    }
}
