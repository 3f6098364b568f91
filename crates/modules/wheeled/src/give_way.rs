//! A reflex of who stands somewhere: it gives way when another robot comes too near, and no farther than it must.

use slate_plugin::interfaces::{Orientation, Point2, Position, Sightings};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::WheeledModel;

/// Where it stands, and who comes.
#[ports]
pub struct GiveWaySensors {
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
    #[stale(after = "200ms")]
    position: Input<Position>,
    #[stale(after = "200ms")]
    orientation: Input<Orientation>,
    /// The place that it holds, from its knowledge.
    goal: Input<Point2>,
    /// The robot's body, from its knowledge.
    robot: Input<WheeledModel>,
}

/// How near is too near.
#[params]
pub struct GiveWayParams {
    #[param(default = 0.95, range = 0.0..=10.0, unit = "m", doc = "another robot whose middle is nearer than this is too near")]
    near: f64,
    #[param(default = 0.22, range = 0.0..=10.0, unit = "m", doc = "it gives way no farther from its place than this")]
    leash: f64,
    #[param(default = 0.2, range = 0.0..=5.0, unit = "m/s", doc = "how fast it gives way")]
    speed: f64,
}

/// Within this angle a robot is ahead or behind and not beside, radians.
const ALONG: f64 = 1.2;
/// A command holds for this long unless it is renewed, seconds.
const HOLD: f64 = 0.1;

/// Backs away from who comes ahead, and goes ahead of who comes behind.
pub struct GiveWayModel;

impl ReactiveModel for GiveWayModel {
    const NAME: &'static str = "give_way_model";
    const DOC: &'static str = "Gives way when another robot comes too near to the place that this one holds.";
    const RANK: i32 = 1;
    type Sensors = GiveWaySensors;
    type Params = GiveWayParams;
    type State = ();

    fn run(_: &mut (), sensors: &GiveWaySensors, params: &GiveWayParams, _: &Tick) -> Option<ActionRequest> {
        let nearest = sensors.robots.fresh()?.list.iter().find(|seen| seen.range.is_finite())?;
        let (position, orientation) = (sensors.position.fresh()?, sensors.orientation.fresh()?);
        let (goal, robot) = (sensors.goal.fresh()?, sensors.robot.fresh()?);
        if nearest.range >= params.near {
            return None;
        }
        let bearing = nearest.bearing;
        let linear = match bearing.abs() {
            ahead if ahead < ALONG => -params.speed,
            behind if behind > std::f64::consts::PI - ALONG => params.speed,
            // Who comes from the side passes, or stops: there is no way to make room.
            _ => return None,
        };
        // Where it would be in a moment.
        let way = linear * 0.5;
        let x = position.x + way * math::cos(orientation.theta) - goal.x;
        let y = position.y + way * math::sin(orientation.theta) - goal.y;
        if math::hypot(x, y) > params.leash {
            return None;
        }
        let wheels = robot.wheels_for(linear, 0.0);
        Some(AvoidObstacle::request(Evasion {
            angle: 0.0,
            left: wheels.left,
            right: wheels.right,
            duration: HOLD,
        }))
    }
}
