//! Obstacles in view of the laser.

use slate_plugin::interfaces::{Point2, Pose2};
use slate_plugin::prelude::*;

/// Points on obstacles around a robot.
#[interface]
pub struct ObstaclePoints {
    /// Pose of the robot in the odometry frame, when it saw the newest ones.
    pub pose: Pose2,
    /// Points in the odometry frame; those of the newest scan come last.
    pub points: [Point2],
}
