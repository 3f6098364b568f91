//! How a robot moves, from where it is.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Pose2, Twist2};
use slate_plugin::prelude::*;

/// Between two places that are compared, seconds: one cycle moves too little to measure.
const BETWEEN: f64 = 0.05;

/// What is known of the robot's motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OwnMotion {
    /// Where it was a moment ago, and when, seconds.
    anchor: Option<(f64, f64, f64, f64)>,
    /// Forward (m/s), and turning (rad/s).
    moves: (f64, f64),
}

impl OwnMotion {
    /// How it moves that is at that place at that time (seconds).
    pub fn notice(&mut self, pose: Pose2, time: f64) -> Twist2 {
        let (x, y, theta, since) = *self.anchor.get_or_insert((pose.x, pose.y, pose.theta, time));
        let elapsed = time - since;
        if elapsed >= BETWEEN - 1e-9 {
            let turn = math::angle_between(theta, pose.theta);
            let direction = theta + 0.5 * turn;
            let way = (pose.x - x) * math::cos(direction) + (pose.y - y) * math::sin(direction);
            self.moves = (way / elapsed, turn / elapsed);
            self.anchor = Some((pose.x, pose.y, pose.theta, time));
        }
        let (linear, angular) = self.moves;
        // A place that is no number says nothing, and does not stay.
        if !(linear + angular).is_finite() {
            *self = Self::default();
            return Twist2::ZERO;
        }
        Twist2 { linear, angular }
    }
}
