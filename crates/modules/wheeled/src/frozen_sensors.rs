//! Sensors that repeat a measurement although the robot moves.

use serde::{Deserialize, Serialize};
use slate_avoidance::{ROBOT_SENSOR, SONAR};
use slate_plugin::interfaces::{Odometry, Orientation, Pose2, Position, Sightings, Twist2};
use slate_plugin::mapek::Device;
use slate_plugin::prelude::*;

use crate::frozen_sonars::FrozenSonars;
use crate::hardware::{ODOMETRY, ORIENTATION, POSITION};
use crate::traveled_pose::{FROZEN_TURN, TraveledPose, has_turned};

/// Travel by the odometry after which the same measurement is a frozen one, meters.
const TRAVEL: f64 = 0.1;

/// Measurement that changes, to the last bit, with any motion of its robot.
/// It may be sensitive to one kind of motion only.
pub trait MovingMeasurement {
    /// Returns the measured numbers, in any order.
    /// `None` without information, as a detector without a detection. Numbers that are not finite have no information,
    /// either.
    fn numbers(&self) -> Option<[f64; 16]>;

    /// Returns whether it must have changed after a travel (m) and a turn (rad).
    fn must_change(travel: f64, turn: f64) -> bool;
}

impl MovingMeasurement for Position {
    fn numbers(&self) -> Option<[f64; 16]> {
        let mut numbers = [0.0; 16];
        numbers[..3].copy_from_slice(&[self.x, self.y, self.z]);
        Some(numbers)
    }

    fn must_change(travel: f64, _: f64) -> bool {
        travel > TRAVEL
    }
}

impl MovingMeasurement for Orientation {
    fn numbers(&self) -> Option<[f64; 16]> {
        let mut numbers = [0.0; 16];
        numbers[0] = self.theta;
        Some(numbers)
    }

    fn must_change(travel: f64, turn: f64) -> bool {
        has_turned(travel, turn)
    }
}

impl MovingMeasurement for Sightings {
    fn numbers(&self) -> Option<[f64; 16]> {
        let mut numbers = [0.0; 16];
        for (place, seen) in numbers.chunks_exact_mut(2).zip(self.list.iter()) {
            place.copy_from_slice(&[seen.range, seen.bearing]);
        }
        (!self.list.is_empty()).then_some(numbers)
    }

    fn must_change(travel: f64, turn: f64) -> bool {
        travel > TRAVEL || has_turned(travel, turn)
    }
}

/// Detector of a sensor that repeats a measurement while the robot moves.
/// Repeated means equal to the last bit; the motion is that of the odometry.
///
/// A measurement counts as repeated when it is the same for as long as makes a device late, and the odometry has meanwhile
/// moved by as much as must have changed it: 0.1 m, or 0.1 rad and 0.2 rad for each meter. A robot that stands, or is carried, has none.
#[derive(Default, Serialize, Deserialize)]
pub struct FrozenSensor {
    held: Option<HeldMeasurement>,
    is_frozen: bool,
    /// Time of the newest odometry, ns.
    odometry_at: u64,
}

/// Repeated measurement, with the time and pose of its first occurrence.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct HeldMeasurement {
    bits: [u64; 16],
    /// Nanoseconds.
    since: u64,
    /// x, y (m) and heading (rad) in the frame of the odometry.
    place: [f64; 3],
}

impl FrozenSensor {
    /// Adds a new measurement; returns the time since which it is frozen, ns.
    pub fn update<T: MovingMeasurement>(
        &mut self,
        measured: Option<&T>,
        odometry: Option<TraveledPose>,
        device: Option<&Device>,
        now: &Tick,
    ) -> Option<u64> {
        if odometry.is_some_and(|odometry| odometry.follows_gap(&mut self.odometry_at)) {
            (self.held, self.is_frozen) = (None, false);
        }
        if let (Some(measured), Some(TraveledPose { pose, .. })) = (measured, odometry) {
            let numbers =
                measured.numbers().filter(|numbers| numbers.iter().all(|number| number.is_finite()));
            let bits = numbers.map(|numbers| numbers.map(f64::to_bits));
            match self.held.filter(|held| Some(held.bits) == bits) {
                Some(held) => {
                    let [x, y, theta] = held.place;
                    let travel = math::hypot(pose.x - x, pose.y - y);
                    let turn = math::angle_between(theta, pose.theta).abs();
                    self.is_frozen |= is_long(held.since, device, now) && T::must_change(travel, turn);
                }
                None => {
                    let Pose2 { x, y, theta } = pose;
                    let place = [x, y, theta];
                    self.held = bits.map(|bits| HeldMeasurement { bits, since: now.now(), place });
                    self.is_frozen = false;
                }
            }
        }
        self.held.filter(|_| self.is_frozen).map(|held| held.since)
    }
}

/// Detector of wheel encoders that repeat a pose while the twist moves.
/// Repeated means equal to the last bit.
///
/// They count as frozen when they repeat both for as long as makes a device late, and for 0.1 m or 0.1 rad by that twist. This needs
/// no other sensor. Those that froze while the robot stood are not known to be.
#[derive(Default, Serialize, Deserialize)]
pub struct FrozenOdometry {
    /// Pose and twist, as bits.
    held: [u64; 5],
    /// Time of the first occurrence, ns.
    since: u64,
    is_frozen: bool,
}

impl FrozenOdometry {
    /// Adds new odometry; returns the time since which it is frozen, ns.
    pub fn update(
        &mut self,
        odometry: Option<&Odometry>,
        device: Option<&Device>,
        now: &Tick,
    ) -> Option<u64> {
        if let Some(Odometry { pose: Pose2 { x, y, theta }, twist }) = odometry {
            let Twist2 { linear, angular } = *twist;
            let bits = [*x, *y, *theta, linear, angular].map(f64::to_bits);
            // The Monitor reports numbers that are not finite as invalid.
            if bits != self.held || !bits.iter().all(|bits| f64::from_bits(*bits).is_finite()) {
                *self = Self { held: bits, since: now.now(), is_frozen: false };
            }
            let time = now.now().saturating_sub(self.since) as f64 * 1e-9;
            let has_moved = linear.abs() * time > TRAVEL || angular.abs() * time > FROZEN_TURN;
            self.is_frozen |= has_moved && is_long(self.since, device, now);
        }
        self.is_frozen.then_some(self.since)
    }
}

/// Returns true if a device that repeats its measurement is late.
/// `since` is the time of its first one, ns.
fn is_long(since: u64, device: Option<&Device>, now: &Tick) -> bool {
    let late_after = device.map_or_else(|| Device::default().late_after(), Device::late_after);
    now.now().saturating_sub(since) as f64 * 1e-9 > late_after
}

/// Frozen sensors of a robot, by their names in its RobotModel.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
pub struct FrozenSensors {
    /// Ring of sonars.
    pub sonars: FrozenSonars,
    /// Positioning system.
    pub position: FrozenSensor,
    /// Compass.
    pub orientation: FrozenSensor,
    /// Wheel encoders.
    pub odometry: FrozenOdometry,
    /// Detector of robots.
    pub robot_sensor: FrozenSensor,
}

/// Time since which each sensor has been frozen, ns, by name.
#[derive(Clone, Copy, Default)]
pub struct FrozenSince([(&'static str, Option<u64>); 5]);

impl FrozenSince {
    /// Returns the times since which these sensors have been frozen.
    pub fn new([sonar, position, orientation, odometry, robot_sensor]: [Option<u64>; 5]) -> Self {
        Self([
            (SONAR, sonar),
            (POSITION, position),
            (ORIENTATION, orientation),
            (ODOMETRY, odometry),
            (ROBOT_SENSOR, robot_sensor),
        ])
    }

    /// Returns since when a sensor has been frozen, ns.
    pub fn of(&self, sensor: &str) -> Option<u64> {
        self.0.iter().find(|(name, _)| *name == sensor).and_then(|(_, since)| *since)
    }
}

/// Logs once, when that begins, that a sensor is frozen since a time, ns.
pub fn log_frozen(was_frozen: &mut bool, sensor: &str, why: &str, since: Option<u64>, now: &Tick) {
    let was_frozen = std::mem::replace(was_frozen, since.is_some());
    if let Some(since) = since.filter(|_| !was_frozen) {
        now.warn(format_args!(
            "the sensor `{sensor}` is frozen: {why} since {:.2} s, and the robot moves; its measurements are dropped",
            since as f64 * 1e-9
        ));
    }
}
