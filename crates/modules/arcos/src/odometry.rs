//! Odometry pose: the controller's pose with its wrap-around unrolled.

use slate_interfaces::{Odometry, Pose2, Twist2};
use slate_module::math::{cos, sin, wrap_angle};

use crate::model::Model;
use crate::report::Report;

/// Maximum travel between two reports, meters: at most a second lies between.
const STRIDE: f64 = 2.5;

/// Adds up how the robot moves from report to report, across connections.
///
/// A restarted controller begins at another pose, and the motion meanwhile is unknown, so the
/// pose continues from its newest value.
#[derive(Clone, Debug)]
pub struct Odometer {
    pose: Pose2,
    last: Option<(u16, u16, i16)>,
    jumps: u64,
}

impl Odometer {
    /// Returns an odometry that begins at a pose.
    pub fn new(pose: Pose2) -> Self {
        Self { pose, last: None, jumps: 0 }
    }

    /// Resets the reference: the next report is unrelated to earlier ones.
    pub fn interrupt(&mut self) {
        self.last = None;
    }

    /// Returns the number of jumps of the controller's pose.
    /// Jumps are not counted as motion.
    pub fn jumps(&self) -> u64 {
        self.jumps
    }

    /// Returns pose and twist after a report.
    pub fn advance(&mut self, report: &Report, model: &Model) -> Odometry {
        let now = (report.x, report.y, report.heading);
        if let Some((x, y, heading)) = self.last.replace(now) {
            // Controllers count places with 15 bits or with 16; the lower 15 wrap around in both.
            let step = |from: u16, to: u16| {
                let change = to.wrapping_sub(from) << 1;
                f64::from(change.cast_signed() >> 1) * model.distance
            };
            let (dx, dy) = (step(x, now.0), step(y, now.1));
            if dx * dx + dy * dy > STRIDE * STRIDE {
                self.jumps += 1;
            } else {
                // From the controller's frame into the one in which this began.
                let turn = self.pose.theta - f64::from(heading) * model.angle;
                self.pose.x += dx * cos(turn) - dy * sin(turn);
                self.pose.y += dx * sin(turn) + dy * cos(turn);
                let turned = f64::from(now.2.wrapping_sub(heading)) * model.angle;
                self.pose.theta = wrap_angle(self.pose.theta + turned);
            }
        }
        let (left, right) = (f64::from(report.left) * model.speed, f64::from(report.right) * model.speed);
        let angular = match report.rotation {
            Some(tenths) => (f64::from(tenths) / 10.0).to_radians(),
            None => (right - left) / model.track,
        };
        Odometry { pose: self.pose, twist: Twist2 { linear: (left + right) / 2.0, angular } }
    }
}
