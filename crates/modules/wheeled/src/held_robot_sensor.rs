//! Detector of robots that bridges missed detections.

use slate_plugin::interfaces::{Odometry, Pose2, SensorAccuracy, Sighting, Sightings};
use slate_plugin::prelude::*;

use crate::tracks::{Track, Tracks};

/// Driver or simulator of the detector.
#[ports]
pub struct HeldRobotSensorPorts {
    source: Input<Sightings>,
    /// Wheel encoders, by which a detection stays where it was while this robot moves.
    odometry: Input<Odometry>,
    /// Errors of the sensors, from their data sheets; exact sensors without.
    accuracy: Input<SensorAccuracy>,
}

/// Parameters of [`HeldRobotSensor`].
#[params]
pub struct HeldRobotSensorParams {
    #[param(default = 0.5, range = 0.0..=1.0, unit = "s", doc = "time for which a robot that is no longer detected is still reported, if the detector errs")]
    hold_time: f64,
}

/// Detects robots, and holds an overlooked one until the hold time has passed.
/// A held robot is reported at its last position.
///
/// Detections of an exact sensor pass as they are.
pub struct HeldRobotSensor;

impl Sensor for HeldRobotSensor {
    const NAME: &'static str = "held_robot_sensor";
    const DOC: &'static str = "Detector of robots that bridges missed detections.";
    type Io = HeldRobotSensorPorts;
    type Params = HeldRobotSensorParams;
    type State = Tracks;
    type Value = Sightings;

    fn get_data(
        tracks: &mut Tracks,
        io: &HeldRobotSensorPorts,
        params: &HeldRobotSensorParams,
        now: &Tick,
    ) -> Option<Sightings> {
        let seen = io.source.updated()?;
        let errs = io.accuracy.get().is_some_and(|accuracy| accuracy.sighting_range_stddev > 0.0);
        let Some(odometry) = io.odometry.fresh().filter(|_| errs) else { return Some(*seen) };
        let time = now.seconds();
        tracks.update(odometry.pose, seen, time);
        let is_held = |track: &&Track| {
            time - track.time <= params.hold_time && !seen.list.iter().any(|seen| seen.name == track.name)
        };
        let mut list = [Sighting::default(); 8];
        let mut length = 0;
        let held = tracks.iter().filter(is_held).map(|track| sighting(odometry.pose, track));
        for (place, sighting) in list.iter_mut().zip(seen.list.iter().copied().chain(held)) {
            *place = sighting;
            length += 1;
        }
        list[..length].sort_unstable_by(|a, b| a.range.total_cmp(&b.range));
        Some(Sightings { list: Sequence::new(&list[..length]) })
    }
}

/// Returns the detection of a robot on a track, from a pose in the same frame.
fn sighting(pose: Pose2, track: &Track) -> Sighting {
    let (dx, dy) = (track.x - pose.x, track.y - pose.y);
    let bearing = math::angle_between(pose.theta, math::atan2(dy, dx));
    Sighting { range: math::hypot(dx, dy), bearing, name: track.name }
}
