//! Transforms of the frame tree.

use slate_interfaces::{Pose2, Position, Quaternion, Transform};
use slate_module::{Text, Tick, math};

use super::AmclParams;
use crate::estimate::{compose, relative};

/// Frame of the odometry in that of the map: where the odometry began, as far as is known now.
pub(super) fn map_to_odom(params: &AmclParams, pose: &Pose2, odometry: &Pose2, now: &Tick) -> Transform {
    let origin = compose(pose, &relative(odometry, &Pose2 { x: 0.0, y: 0.0, theta: 0.0 }));
    transform(params.global_frame_id.as_str(), params.odom_frame_id.as_str(), &origin, now)
}

/// Frame of the robot in that of the odometry.
pub(super) fn odom_to_base(params: &AmclParams, odometry: &Pose2, now: &Tick) -> Transform {
    transform(params.odom_frame_id.as_str(), params.base_frame_id.as_str(), odometry, now)
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
