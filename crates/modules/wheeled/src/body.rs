//! Body of a wheeled robot, with any drive.

use slate_avoidance::approach_speed;
use slate_plugin::interfaces::{Pose2, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::knowledge::WheeledModel;

/// A robot that steers by different wheel speeds of its sides.
pub trait WheeledBody {
    /// Pose and robot model.
    fn model(&self) -> &BodyModel;

    /// Commands the wheels of both sides.
    fn turn_wheels(&self, speeds: WheelSpeeds, priority: Priority);
}

/// Pose and robot model.
#[ports]
pub struct BodyModel {
    /// Robot model with the pose, from Knowledge.
    #[stale(after = "100ms")]
    robot: Required<WheeledModel>,
}

impl BodyModel {
    /// Returns the pose; `None` if it is stale or invalid.
    pub fn pose(&self) -> Option<Pose2> {
        let pose = self.robot.fresh()?.robot.pose;
        (pose.x.is_finite() && pose.y.is_finite() && pose.theta.is_finite()).then_some(pose)
    }

    /// Returns the linear velocity (m/s) at a distance (m) from the goal: at most `speed`, and low enough to stop.
    pub fn approach_speed(&self, speed: f64, distance: f64) -> f64 {
        approach_speed(speed, distance, self.robot.deceleration())
    }

    /// Inverse kinematics: wheel speeds of a twist (m/s, rad/s).
    pub fn wheels_for(&self, linear: f64, angular: f64) -> WheelSpeeds {
        self.robot.wheels_for(linear, angular)
    }
}
