//! Body of a wheeled robot, with any drive.

use slate_avoidance::approach_speed;
use slate_plugin::interfaces::{Odometry, Pose2, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::knowledge::WheeledModel;

/// Periodic offset of the heading from the direction to the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weave {
    /// Greatest offset, radians.
    pub amplitude: f64,
    /// Present offset, radians, counter-clockwise.
    pub offset: f64,
}

/// Greatest angle of a weave, radians.
const WEAVE_ANGLE: f64 = 0.6;
/// Length of a weave, in lengths of the robot.
const WEAVE_LENGTH: f64 = 1.8;
/// Distance from the goal below which a robot no longer weaves, meters.
/// From twice that on it weaves in full.
const WEAVE_END: f64 = 0.4;

/// Robot that steers by different wheel speeds of its sides.
pub trait WheeledBody {
    /// Returns the pose and the robot model.
    fn model(&self) -> &BodyModel;

    /// Commands the wheels of both sides.
    fn turn_wheels(&self, speeds: WheelSpeeds, priority: Priority);
}

/// Pose, robot model and odometry.
#[ports]
pub struct BodyModel {
    /// Robot model with the pose, from Knowledge.
    #[stale(after = "100ms")]
    robot: Required<WheeledModel>,
    /// Wheel encoders, by which a turn continues while the pose is unknown.
    #[stale(after = "200ms")]
    odometry: Input<Odometry>,
}

impl BodyModel {
    /// Returns the pose.
    /// `None` if it is stale or invalid, or while the wheel encoders are late or have stopped.
    pub fn pose(&self) -> Option<Pose2> {
        let robot = self.robot.fresh()?;
        let pose = robot.robot.pose;
        (pose.is_known() && !robot.has_lost_odometry()).then_some(pose)
    }

    /// Returns the heading in the frame of the odometry, radians.
    /// `None` if it is stale, invalid or lost.
    pub fn odometry_heading(&self) -> Option<f64> {
        let theta = self.odometry.fresh()?.pose.theta;
        let is_lost = self.robot.has_lost_odometry();
        (theta.is_finite() && !is_lost).then_some(theta)
    }

    /// Returns the linear velocity (m/s) at a distance (m) from the goal.
    /// It is at most `speed`, and low enough to stop.
    pub fn approach_speed(&self, speed: f64, distance: f64) -> f64 {
        approach_speed(speed, distance, self.robot.deceleration())
    }

    /// Returns the weave at a distance (m) from the goal.
    /// `None` for exact sonars.
    ///
    /// A sonar that errs hears a face only near its normal, and neither of the two that meet in a corner ahead. The robot that
    /// approaches it from changing sides hears one of them in time.
    pub fn weave(&self, distance: f64) -> Option<Weave> {
        (self.robot.accuracy.sonar_outliers > 0.0).then(|| {
            let corners = self.robot.chassis.outline.iter();
            let (back, front) = corners.fold((0.0, 0.0), |(back, front), corner| {
                (math::min(back, corner.x), math::max(front, corner.x))
            });
            // Near the goal it goes straight.
            let part = math::clamp((distance - WEAVE_END) / WEAVE_END, 0.0, 1.0);
            let amplitude = part * WEAVE_ANGLE;
            let length = math::max(WEAVE_LENGTH * (front - back), f64::MIN_POSITIVE);
            Weave { amplitude, offset: amplitude * math::sin(std::f64::consts::TAU * distance / length) }
        })
    }

    /// Inverse kinematics: wheel speeds of a twist (m/s, rad/s).
    pub fn wheels_for(&self, linear: f64, angular: f64) -> WheelSpeeds {
        self.robot.wheels_for(linear, angular)
    }
}
