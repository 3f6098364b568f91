//! Increments of the odometry between two scans.

use nalgebra::Matrix3;
use slate_interfaces::Pose2;
use slate_module::math;

use crate::parameters::{MatchingParameters, OdometryDrift};
use crate::se2;

/// Motion between two scans by the odometry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanIncrement {
    /// Increment in the frame of its start.
    pub pose: Pose2,
    /// Inverse covariance of x, y and theta in that frame.
    pub information: Matrix3<f64>,
    /// True if the odometry jumped; no motion is then assumed.
    pub is_jump: bool,
}

impl ScanIncrement {
    /// Returns the increment between two poses.
    /// Beyond `max_odometry_increment`, it is no motion with the uncertainty of one of that length.
    pub fn between(from: Pose2, to: Pose2, matching: &MatchingParameters, drift: &OdometryDrift) -> Self {
        let pose = se2::relative(from, to);
        let most = matching.max_odometry_increment;
        // A length that is not a number is a jump too.
        if pose.is_known() && math::hypot(pose.x, pose.y) <= most {
            return Self { pose, information: drift.information(pose), is_jump: false };
        }
        let information = drift.information(Pose2 { x: most, ..Pose2::default() });
        Self { pose: Pose2::default(), information, is_jump: true }
    }
}

impl OdometryDrift {
    /// Returns the inverse covariance of x, y and theta after an increment.
    /// It is in the frame where the increment begins.
    fn information(&self, increment: Pose2) -> Matrix3<f64> {
        let square = |value: f64| value * value;
        let length = math::hypot(increment.x, increment.y);
        let translation = square(self.translation_stddev) * length;
        let rotation =
            square(self.rotation_stddev) * increment.theta.abs() + square(self.drift_stddev) * length;
        // Even a robot that stands does so by a millimeter.
        let (across, turn) = (1.0 / (translation + 1e-6), 1.0 / (rotation + 1e-6));
        Matrix3::from_diagonal(&[across, across, turn].into())
    }
}
