//! The deliberative behaviour: straight to the goal, as if nothing stood in the way.

use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

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

/// What the Plan remembers.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Memory {
    /// Whether it drives with care.
    crowded: bool,
    /// Where the robot was last told to be.
    position: Option<(f64, f64)>,
    /// Whether it was told which way the robot looks.
    oriented: bool,
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
        let was = memory.crowded;
        if let Some(surroundings) = noticed.range.newest() {
            memory.crowded = surroundings.crowded.get();
        }
        if let Some(position) = noticed.position.newest() {
            memory.position = Some((position.x, position.y));
        }
        memory.oriented |= noticed.orientation.newest().is_some();
        // Without a goal and a pose there is nothing to plan.
        let (Some(goal), Some((x, y)), true) = (noticed.goal.fresh(), memory.position, memory.oriented)
        else {
            return;
        };
        // The Analyze tells steps of some centimetres, so an arrival is known from the action's end.
        let arrived = situation.ended().any(|ended| {
            ended.kind.as_str() == GoToOrigin::KIND && ended.ending == slate_plugin::mapek::Ending::COMPLETED
        });
        if arrived {
            memory.position = Some((goal.x, goal.y));
            return;
        }
        let away = math::hypot(goal.x - x, goal.y - y) > params.tolerance;
        let speed = if memory.crowded { params.careful_speed } else { params.speed };
        // A reflex leaves the robot elsewhere, so the plan is made anew from there; a change of room changes the speed.
        let changed = was != memory.crowded && !situation.is_reactive() && !situation.is_idle();
        if (away && situation.needs_plan()) || changed {
            plan.replace(GoToOrigin::request(Leg {
                x: goal.x,
                y: goal.y,
                speed,
                tolerance: params.tolerance,
            }));
        }
    }
}
