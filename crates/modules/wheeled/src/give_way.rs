//! A reflex of who stands somewhere: it gives way when another robot comes too near, and no farther than it must.

use slate_plugin::interfaces::{
    Echo, Orientation, Point2, Position, Sighting, Sightings, SonarPlacement, SonarScan,
};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::WheeledModel;

/// Where it stands, and who comes.
#[ports]
pub struct GiveWaySensors {
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
    /// What is in the way that it would give.
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
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
    #[param(default = 0.15, range = 0.0..=10.0, unit = "m", doc = "it stays when a sonar that looks its way hears something nearer than this")]
    room: f64,
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
        let robots = sensors.robots.fresh()?;
        let (position, orientation) = (sensors.position.fresh()?, sensors.orientation.fresh()?);
        let (goal, robot) = (sensors.goal.fresh()?, sensors.robot.fresh()?);
        // What is no number is nowhere.
        let near = |seen: &&Sighting| seen.range < params.near && seen.bearing.is_finite();
        let side = |seen: &Sighting| match seen.bearing.abs() {
            ahead if ahead < ALONG => Some(-params.speed),
            behind if behind > std::f64::consts::PI - ALONG => Some(params.speed),
            // Who comes from the side passes, or stops: there is no way to make room.
            _ => None,
        };
        let mut ways = robots.list.iter().filter(near).filter_map(side);
        let linear = ways.next()?;
        // Between two there is no way either.
        if ways.any(|way| way != linear) {
            return None;
        }
        // Sonars may look elsewhere, but not be silent altogether.
        let scan = sensors.sonar.fresh()?;
        let heard = |(echo, placement): (&Echo, &SonarPlacement)| {
            echo.heard.get() && echo.range < params.room && math::cos(placement.theta) * linear > 0.0
        };
        if scan.echoes.iter().zip(scan.placements.iter()).any(heard) {
            return None;
        }
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
