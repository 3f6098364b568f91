//! Reflex of a robot that holds a position: gives way to another robot that comes too close.

use slate_plugin::interfaces::{
    Echo, Orientation, Point2, Pose2, Position, Sighting, Sightings, SonarPlacement, SonarScan,
};
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::WheeledModel;

/// Sensors and knowledge of the reflex.
#[ports]
pub struct GiveWaySensors {
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
    /// Obstacles in its way.
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    #[stale(after = "200ms")]
    position: Input<Position>,
    #[stale(after = "200ms")]
    orientation: Input<Orientation>,
    /// Position to hold, from Knowledge.
    goal: Input<Point2>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Parameters of [`GiveWayModel`].
#[params]
pub struct GiveWayParams {
    #[param(default = 0.95, range = 0.0..=10.0, unit = "m", doc = "distance of another robot's center below which it gives way")]
    min_separation: f64,
    #[param(default = 0.22, range = 0.0..=10.0, unit = "m", doc = "maximum distance from the position to hold")]
    max_displacement: f64,
    #[param(default = 0.2, range = 0.0..=5.0, unit = "m/s", doc = "linear velocity")]
    linear_velocity: f64,
    #[param(default = 0.15, range = 0.0..=10.0, unit = "m", doc = "minimum range of the sonars in its direction")]
    min_clearance: f64,
}

/// Angle within which a robot is ahead or behind, not beside, radians.
const ALONG: f64 = 1.2;
/// Duration of a command unless it is renewed, seconds.
const HOLD: f64 = 0.1;

/// Moves away from a robot ahead or behind.
pub struct GiveWayModel;

impl ReactiveModel for GiveWayModel {
    const NAME: &'static str = "give_way_model";
    const DOC: &'static str = "Gives way to a robot that comes too close to the position to hold.";
    const RANK: i32 = 1;
    type Sensors = GiveWaySensors;
    type Params = GiveWayParams;
    type State = ();

    fn run(_: &mut (), sensors: &GiveWaySensors, params: &GiveWayParams, _: &Tick) -> Option<ActionRequest> {
        let robots = sensors.robots.fresh()?;
        let (goal, robot) = (sensors.goal.fresh()?, sensors.robot.fresh()?);
        let pose = robot.estimated_pose().or_else(|| {
            let (position, orientation) = (sensors.position.fresh()?, sensors.orientation.fresh()?);
            Some(Pose2 { x: position.x, y: position.y, theta: orientation.theta })
        })?;
        // NaN is nowhere.
        let near = |seen: &&Sighting| seen.range < params.min_separation && seen.bearing.is_finite();
        let side = |seen: &Sighting| match seen.bearing.abs() {
            ahead if ahead < ALONG => Some(-params.linear_velocity),
            behind if behind > std::f64::consts::PI - ALONG => Some(params.linear_velocity),
            // A robot from the side passes, or stops: this one can't make room.
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
            echo.heard.get() && echo.range < params.min_clearance && math::cos(placement.theta) * linear > 0.0
        };
        if scan.echoes.iter().zip(scan.placements.iter()).any(heard) {
            return None;
        }
        // Where it would be in a moment.
        let way = linear * 0.5;
        let x = pose.x + way * math::cos(pose.theta) - goal.x;
        let y = pose.y + way * math::sin(pose.theta) - goal.y;
        if math::hypot(x, y) > params.max_displacement {
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
