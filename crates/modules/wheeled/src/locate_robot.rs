//! Where another robot is, from how far and in which direction it is seen: `P3dxPositonAnalyze` of the paper (section 6.4).

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Pose2, Position, Sightings};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::tracks::placed;

/// The sensor that sees other robots.
#[ports]
pub struct RobotSensor {
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
}

/// Watches for other robots.
pub struct RobotMonitor;

impl Monitor for RobotMonitor {
    const NAME: &'static str = "robot_monitor";
    const DOC: &'static str = "Watches for other robots.";
    type Sensors = RobotSensor;
    type Params = ();
    type State = ();
    type Value = Sightings;

    fn interpret(_: &mut (), sensors: &RobotSensor, _: &(), _: &Tick) -> Option<Sightings> {
        sensors.robots.fresh().copied()
    }
}

/// Where another robot is.
#[interface]
#[derive(PartialEq)]
pub struct Located {
    /// To the east.
    #[unit("m")]
    pub x: f64,
    /// To the north.
    #[unit("m")]
    pub y: f64,
    /// How far away.
    #[unit("m")]
    pub range: f64,
    /// How far from straight ahead, counter-clockwise.
    #[unit("rad")]
    pub bearing: f64,
    /// Whether it is seen; else the place is the last known one.
    pub seen: Bool,
    /// Not used.
    pub reserved: [u8; 7],
}

/// What is seen, and from where.
#[ports]
pub struct ObservedRobots {
    robots: Observed<Sightings>,
    #[stale(after = "200ms")]
    position: Observed<Position>,
    #[stale(after = "200ms")]
    orientation: Observed<Orientation>,
}

/// Which robot.
#[params]
pub struct LocateRobotParams {
    #[param(default = "r2", doc = "the robot to look for")]
    robot: Text<28>,
    #[param(default = 0.02, range = 0.0..=10.0, unit = "m", doc = "a shorter way is not worth telling")]
    step: f64,
    #[param(default = 0.5, range = 0.0..=60.0, unit = "s", doc = "not seen for longer than this it is lost")]
    patience: f64,
}

/// What was told last, and when the robot was seen.
#[derive(Default, Serialize, Deserialize)]
pub struct Told {
    last: Option<(f64, f64, f64, f64)>,
    is_seen: bool,
    seen_at: f64,
}

/// Tells where another robot is, whenever that has changed.
pub struct LocateRobot;

impl Analyze for LocateRobot {
    const NAME: &'static str = "locate_robot";
    const DOC: &'static str = "Tells where another robot is.";
    type Observed = ObservedRobots;
    type Params = LocateRobotParams;
    type State = Told;
    type Value = Located;

    fn process(
        told: &mut Told,
        observed: &ObservedRobots,
        params: &LocateRobotParams,
        now: &Tick,
    ) -> Option<Located> {
        // An older look, placed from where this robot is now, would be a robot that moves along with it.
        let seen = observed
            .robots
            .new()
            .and_then(|robots| robots.list.iter().find(|seen| seen.name.as_str() == params.robot.as_str()));
        let seen = seen.filter(|seen| seen.range.is_finite() && seen.bearing.is_finite());
        let place = |x, y, range, bearing, seen: bool| Located {
            x,
            y,
            range,
            bearing,
            seen: seen.into(),
            reserved: [0; 7],
        };
        let pose = (observed.position.fresh(), observed.orientation.fresh());
        let (Some(sighting), (Some(position), Some(orientation))) = (seen, pose) else {
            let lost = told.is_seen && now.seconds() - told.seen_at > params.patience;
            told.is_seen &= !lost;
            let (x, y, range, bearing) = told.last?;
            return lost.then(|| place(x, y, range, bearing, false));
        };
        let pose = Pose2 { x: position.x, y: position.y, theta: orientation.theta };
        let Point2 { x, y } = placed(pose, sighting);
        told.seen_at = now.seconds();
        let moved = told.last.is_none_or(|(last_x, last_y, range, bearing)| {
            let turned = math::angle_between(bearing, sighting.bearing).abs() * sighting.range;
            math::hypot(x - last_x, y - last_y) >= params.step
                || (range - sighting.range).abs() >= params.step
                || turned >= params.step
        });
        (moved || !told.is_seen).then(|| {
            told.is_seen = true;
            told.last = Some((x, y, sighting.range, sighting.bearing));
            place(x, y, sighting.range, sighting.bearing, true)
        })
    }
}
