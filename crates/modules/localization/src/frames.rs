//! Transforms of a robot whose pose in a map is estimated (REP 105).

use slate_interfaces::{Pose2, Position, Quaternion, Transform};
use slate_module::{Text, Tick, math};

use crate::estimate::{compose, relative};

/// Names of the frames of a robot in a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameNames<'a> {
    /// Frame of the map.
    pub map: &'a str,
    /// Frame of the odometry.
    pub odom: &'a str,
    /// Frame of the robot.
    pub base: &'a str,
}

impl FrameNames<'_> {
    /// Returns the transform from map to odometry frame.
    /// It is the origin of odometry in the map, by the present estimate.
    pub fn map_to_odom(&self, pose: &Pose2, odometry: &Pose2, now: &Tick) -> Transform {
        let origin = compose(pose, &relative(odometry, &Pose2 { x: 0.0, y: 0.0, theta: 0.0 }));
        transform(self.map, self.odom, &origin, now)
    }

    /// Returns the frame of the robot in that of the odometry.
    pub fn odom_to_base(&self, odometry: &Pose2, now: &Tick) -> Transform {
        transform(self.odom, self.base, odometry, now)
    }
}

fn transform(parent: &str, child: &str, pose: &Pose2, now: &Tick) -> Transform {
    let half = 0.5 * pose.theta;
    Transform {
        time: now.now(),
        parent: Text::new(parent),
        child: Text::new(child),
        translation: Position { x: pose.x, y: pose.y, z: 0.0 },
        rotation: Quaternion { x: 0.0, y: 0.0, z: math::sin(half), w: math::cos(half) },
        fixed: false.into(),
    }
}
