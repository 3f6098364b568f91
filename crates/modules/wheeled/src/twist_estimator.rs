//! Twist of the robot from its poses.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Pose2, Twist2};
use slate_plugin::prelude::*;

/// Shortest time between compared poses, seconds: one cycle moves too little.
const BETWEEN: f64 = 0.05;

/// Estimate of the robot's twist.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistEstimator {
    /// Earlier pose and its time, seconds.
    anchor: Option<(f64, f64, f64, f64)>,
    /// Linear (m/s) and angular (rad/s) velocity.
    #[serde(alias = "moves")]
    twist: (f64, f64),
}

impl TwistEstimator {
    /// Updates from a pose at a time (seconds), and returns the twist.
    pub fn update(&mut self, pose: Pose2, time: f64) -> Twist2 {
        let (x, y, theta, since) = *self.anchor.get_or_insert((pose.x, pose.y, pose.theta, time));
        let elapsed = time - since;
        if elapsed >= BETWEEN - 1e-9 {
            let turn = math::angle_between(theta, pose.theta);
            let direction = theta + 0.5 * turn;
            let distance = (pose.x - x) * math::cos(direction) + (pose.y - y) * math::sin(direction);
            self.twist = (distance / elapsed, turn / elapsed);
            self.anchor = Some((pose.x, pose.y, pose.theta, time));
        }
        let (linear, angular) = self.twist;
        // An invalid pose resets the estimate.
        if !(linear + angular).is_finite() {
            *self = Self::default();
            return Twist2::ZERO;
        }
        Twist2 { linear, angular }
    }
}
