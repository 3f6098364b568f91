//! Position of another robot from range and bearing.
//! `P3dxPositonAnalyze` of the paper (section 6.4).

use serde::{Deserialize, Serialize};
use slate_avoidance::ROBOT_SENSOR;
use slate_plugin::interfaces::{
    Odometry, Orientation, Point2, Pose2, Position, SensorAccuracy, Sighting, Sightings,
};
use slate_plugin::mapek::Device;
use slate_plugin::prelude::*;

use crate::frozen_sensors::{FrozenSensor, log_frozen};
use crate::knowledge::WheeledModel;
use crate::monitors::device;
use crate::track_filter::TrackFilter;
use crate::tracks::position_of;
use crate::traveled_pose::TraveledPose;

/// Sensor that detects other robots.
#[ports]
pub struct RobotSensor {
    #[stale(after = "1s")]
    robots: Sensed<Sightings>,
    /// Wheel encoders, which measure the robot's motion.
    /// Without them a frozen detector can't be recognized.
    odometry: Input<Odometry>,
    /// Robot model with mount, limits and rate of the detector, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Monitor of detections of other robots.
/// It drops those beyond the range of the device, and all while it is frozen.
pub struct RobotMonitor;

/// State of [`RobotMonitor`].
#[derive(Default, Serialize, Deserialize)]
pub struct RobotMonitorState {
    is_frozen: bool,
    detector: FrozenSensor,
}

/// Rounding of a range, meters.
const ROUNDING: f64 = 1e-9;

/// Returns whether a detector can have seen a robot there, as far from its mount.
fn is_in_range(device: &Device, seen: &Sighting) -> bool {
    let Sighting { range, bearing, .. } = *seen;
    let (x, y) = (range * math::cos(bearing) - device.mount.x, range * math::sin(bearing) - device.mount.y);
    let distance = math::hypot(x, y);
    let is_limited = device.minimum != 0.0 || device.maximum != 0.0;
    // NaN is not a number of meters.
    if is_limited { distance <= device.maximum + ROUNDING } else { distance.is_finite() }
}

impl Monitor for RobotMonitor {
    const NAME: &'static str = "robot_monitor";
    const DOC: &'static str = "Monitors detections of other robots.";
    type Sensors = RobotSensor;
    type Params = ();
    type State = RobotMonitorState;
    type Value = Sightings;

    fn interpret(
        state: &mut RobotMonitorState,
        sensors: &RobotSensor,
        _: &(),
        now: &Tick,
    ) -> Option<Sightings> {
        let (newest, device) = (sensors.robots.updated(), device(&sensors.robot, ROBOT_SENSOR));
        let since = state.detector.update(newest, TraveledPose::of(&sensors.odometry), device, now);
        log_frozen(&mut state.is_frozen, ROBOT_SENSOR, "its detections are the same", since, now);
        let seen = newest.filter(|_| since.is_none())?;
        let Some(device) = device else { return Some(*seen) };
        let mut list = [Sighting::default(); 8];
        let in_range = seen.list.iter().filter(|seen| is_in_range(device, seen));
        let length = list.iter_mut().zip(in_range).map(|(place, seen)| *place = *seen).count();
        Some(Sightings { list: Sequence::new(&list[..length]) })
    }

    fn device<'s>(sensors: &'s RobotSensor, _: &str) -> Option<&'s Device> {
        device(&sensors.robot, ROBOT_SENSOR)
    }

    fn is_degraded(state: &RobotMonitorState) -> bool {
        state.is_frozen
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
    /// True if the robot is detected; else the position is the last known one.
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
    /// Robot model with the estimated pose and sensor accuracy, from Knowledge.
    #[stale(after = "200ms")]
    robot: Input<WheeledModel>,
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
    #[param(default = 0.6, range = 0.01..=100.0, unit = "m/s^2", doc = "standard deviation of the other robot's acceleration")]
    acceleration_stddev: f64,
    #[param(default = 4.0, range = 1.0..=100.0, doc = "standard deviations beyond which a detection is an outlier")]
    gate: f64,
}

/// Reported position of a robot.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct ReportedPlace {
    /// Position in the map frame, meters.
    x: f64,
    y: f64,
    /// Distance, meters.
    range: f64,
    /// Bearing, radians.
    bearing: f64,
}

impl ReportedPlace {
    fn located(self, is_seen: bool) -> Located {
        let Self { x, y, range, bearing } = self;
        Located { x, y, range, bearing, seen: is_seen.into() }
    }
}

/// Track, newest report, and time of the newest detection.
#[derive(Default, Serialize, Deserialize)]
pub struct LastSighting {
    last: Option<ReportedPlace>,
    is_seen: bool,
    seen_at: f64,
    /// Filter for a sensor with errors.
    #[serde(default)]
    track: Option<TrackFilter>,
    /// Time since which others, but not this one, are detected, seconds.
    #[serde(default)]
    others_since: Option<f64>,
    /// True if it was detected once, or its absence was logged.
    #[serde(default)]
    is_settled: bool,
}

/// Time after which a robot never detected is logged, seconds.
/// Others must be detected meanwhile.
const MISSING: f64 = 10.0;

/// Tracks the position of another robot; reports changes.
///
/// Detections of an exact sensor are reported as they are. Those of another one pass a filter, which gates outliers and predicts over
/// missing ones until the track is dropped.
pub struct LocateRobot;

impl Analyze for LocateRobot {
    const NAME: &'static str = "locate_robot";
    const DOC: &'static str = "Tracks the position of another robot.";
    type Observed = ObservedRobots;
    type Params = LocateRobotParams;
    type State = LastSighting;
    type Value = Located;

    fn process(
        tracked: &mut LastSighting,
        observed: &ObservedRobots,
        params: &LocateRobotParams,
        now: &Tick,
    ) -> Option<Located> {
        // An older detection, transformed by the present pose, would move along with this robot.
        let seen = observed
            .robots
            .updated()
            .and_then(|robots| robots.list.iter().find(|seen| seen.name.as_str() == params.robot.as_str()));
        if let Some(other) = observed.robots.updated().and_then(|robots| robots.list.first()) {
            tracked.check_missing(seen.is_some(), other, params, now);
        }
        let seen = seen.filter(|seen| seen.range.is_finite() && seen.bearing.is_finite());
        let accuracy = observed.robot.get().map(|robot| robot.accuracy).unwrap_or_default();
        let pose = observed.pose();
        let located = match (pose, is_exact(&accuracy)) {
            (None, _) => None,
            (Some(pose), true) => seen.map(|seen| {
                tracked.seen_at = now.seconds();
                (position_of(pose, seen), *seen)
            }),
            (Some(pose), false) => tracked.follow(pose, seen, &accuracy, params, now.seconds()),
        };
        tracked.report(located, params, now.seconds())
    }
}

impl ObservedRobots {
    /// Returns the estimated pose; without one, the measured one.
    fn pose(&self) -> Option<Pose2> {
        if self.robot.get().is_some() {
            return self.robot.fresh().map(|robot| robot.robot.pose).filter(Pose2::is_known);
        }
        let (position, orientation) = (self.position.fresh()?, self.orientation.fresh()?);
        Some(Pose2 { x: position.x, y: position.y, theta: orientation.theta })
    }
}

/// Returns true if the detector of robots has no errors.
fn is_exact(accuracy: &SensorAccuracy) -> bool {
    let SensorAccuracy {
        sighting_range_stddev, sighting_range_relative_stddev, sighting_bearing_stddev, ..
    } = accuracy;
    sighting_range_stddev + sighting_range_relative_stddev + sighting_bearing_stddev == 0.0
}

impl LastSighting {
    /// Updates the track; returns position in the map and expected sighting.
    /// `None` without a track.
    fn follow(
        &mut self,
        pose: Pose2,
        seen: Option<&Sighting>,
        accuracy: &SensorAccuracy,
        params: &LocateRobotParams,
        time: f64,
    ) -> Option<(Point2, Sighting)> {
        if time - self.seen_at > params.track_timeout {
            self.track = None;
        }
        if let Some(track) = &mut self.track {
            track.predict(time, params.acceleration_stddev);
        }
        if let Some(seen) = seen {
            let along = accuracy.sighting_range_stddev + accuracy.sighting_range_relative_stddev * seen.range;
            let across =
                seen.range * math::hypot(accuracy.sighting_bearing_stddev, accuracy.orientation_stddev / 2.0);
            let stddev = math::hypot(math::max(along, across), accuracy.position_stddev / 4.0);
            let place = position_of(pose, seen);
            let is_new = self.track.is_none();
            let fits = self.track.as_mut().is_some_and(|track| track.update(place, stddev, params.gate));
            if self.track.is_none() {
                self.track = Some(TrackFilter::new(place, stddev, time));
            }
            // Outliers alone end the track, and begin another one.
            if fits || is_new {
                self.seen_at = time;
            }
        }
        let place = self.track.as_ref()?.position();
        let (dx, dy) = (place.x - pose.x, place.y - pose.y);
        let bearing = math::angle_between(pose.theta, math::atan2(dy, dx));
        Some((place, Sighting { range: math::hypot(dx, dy), bearing, ..Sighting::default() }))
    }

    /// Logs once that a robot is never detected, although another one is.
    fn check_missing(&mut self, is_seen: bool, other: &Sighting, params: &LocateRobotParams, now: &Tick) {
        if is_seen || self.is_settled {
            self.is_settled = true;
            return;
        }
        if now.seconds() - *self.others_since.get_or_insert(now.seconds()) > MISSING {
            self.is_settled = true;
            now.warn(format_args!("the robot `{}` was never detected; `{}` is", params.robot, other.name));
        }
    }

    /// Reports a place if it is news, or, once, that the robot is lost.
    fn report(
        &mut self,
        located: Option<(Point2, Sighting)>,
        params: &LocateRobotParams,
        time: f64,
    ) -> Option<Located> {
        let Some((Point2 { x, y }, Sighting { range, bearing, .. })) = located else {
            let lost = self.is_seen && time - self.seen_at > params.track_timeout;
            self.is_seen &= !lost;
            return self.last.filter(|_| lost).map(|last| last.located(false));
        };
        let moved = self.last.is_none_or(|last| {
            let turned = math::angle_between(last.bearing, bearing).abs() * range;
            math::hypot(x - last.x, y - last.y) >= params.min_displacement
                || (last.range - range).abs() >= params.min_displacement
                || turned >= params.min_displacement
        });
        (moved || !self.is_seen).then(|| {
            self.is_seen = true;
            self.last.insert(ReportedPlace { x, y, range, bearing }).located(true)
        })
    }
}
