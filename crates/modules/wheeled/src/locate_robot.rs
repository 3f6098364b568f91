//! Position of another robot from range and bearing: `P3dxPositonAnalyze` of the paper (section 6.4).

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Pose2, Position, Sightings};
use slate_plugin::prelude::*;

use crate::tracks::placed;

/// Sensor that detects other robots.
#[ports]
pub struct RobotSensor {
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
}

/// Monitors detections of other robots.
pub struct RobotMonitor;

impl Monitor for RobotMonitor {
    const NAME: &'static str = "robot_monitor";
    const DOC: &'static str = "Monitors detections of other robots.";
    type Sensors = RobotSensor;
    type Params = ();
    type State = ();
    type Value = Sightings;

    fn interpret(_: &mut (), sensors: &RobotSensor, _: &(), _: &Tick) -> Option<Sightings> {
        sensors.robots.fresh().copied()
    }
}

/// Position of another robot.
#[interface]
#[derive(PartialEq)]
pub struct Located {
    /// x in the map frame.
    #[unit("m")]
    pub x: f64,
    /// y in the map frame.
    #[unit("m")]
    pub y: f64,
    /// Distance.
    #[unit("m")]
    pub range: f64,
    /// Bearing, counter-clockwise.
    #[unit("rad")]
    pub bearing: f64,
    /// Whether it is detected; else the position is the last known one.
    pub seen: Bool,
}

/// Detections, and the pose of this robot.
#[ports]
pub struct ObservedRobots {
    robots: Observed<Sightings>,
    #[stale(after = "200ms")]
    position: Observed<Position>,
    #[stale(after = "200ms")]
    orientation: Observed<Orientation>,
}

/// Parameters of [`LocateRobot`].
#[params]
pub struct LocateRobotParams {
    #[param(default = "r2", doc = "name of the robot to track")]
    robot: Text<28>,
    #[param(default = 0.02, range = 0.0..=10.0, unit = "m", doc = "displacement that is reported")]
    min_displacement: f64,
    #[param(default = 0.5, range = 0.0..=60.0, unit = "s", doc = "age after which a track is dropped")]
    track_timeout: f64,
}

/// Newest report, and time of the newest detection.
#[derive(Default, Serialize, Deserialize)]
pub struct LastSighting {
    last: Option<(f64, f64, f64, f64)>,
    is_seen: bool,
    seen_at: f64,
}

/// Tracks the position of another robot; reports changes.
pub struct LocateRobot;

impl Analyze for LocateRobot {
    const NAME: &'static str = "locate_robot";
    const DOC: &'static str = "Tracks the position of another robot.";
    type Observed = ObservedRobots;
    type Params = LocateRobotParams;
    type State = LastSighting;
    type Value = Located;

    fn process(
        told: &mut LastSighting,
        observed: &ObservedRobots,
        params: &LocateRobotParams,
        now: &Tick,
    ) -> Option<Located> {
        // An older detection, transformed by the present pose, would move along with this robot.
        let seen = observed
            .robots
            .updated()
            .and_then(|robots| robots.list.iter().find(|seen| seen.name.as_str() == params.robot.as_str()));
        let seen = seen.filter(|seen| seen.range.is_finite() && seen.bearing.is_finite());
        let place = |x, y, range, bearing, seen: bool| Located { x, y, range, bearing, seen: seen.into() };
        let pose = (observed.position.fresh(), observed.orientation.fresh());
        let (Some(sighting), (Some(position), Some(orientation))) = (seen, pose) else {
            let lost = told.is_seen && now.seconds() - told.seen_at > params.track_timeout;
            told.is_seen &= !lost;
            let (x, y, range, bearing) = told.last?;
            return lost.then(|| place(x, y, range, bearing, false));
        };
        let pose = Pose2 { x: position.x, y: position.y, theta: orientation.theta };
        let Point2 { x, y } = placed(pose, sighting);
        told.seen_at = now.seconds();
        let moved = told.last.is_none_or(|(last_x, last_y, range, bearing)| {
            let turned = math::angle_between(bearing, sighting.bearing).abs() * sighting.range;
            math::hypot(x - last_x, y - last_y) >= params.min_displacement
                || (range - sighting.range).abs() >= params.min_displacement
                || turned >= params.min_displacement
        });
        (moved || !told.is_seen).then(|| {
            told.is_seen = true;
            told.last = Some((x, y, sighting.range, sighting.bearing));
            place(x, y, sighting.range, sighting.bearing, true)
        })
    }
}
