//! Increments of the odometry between two scans.

use nalgebra::Matrix3;
use slate_interfaces::Pose2;
use slate_module::math;

use crate::parameters::{MatchingParameters, OdometryDrift};
use crate::se2;

/// Motion between two scans by the odometry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanIncrement {
    /// In the frame where it begins.
    pub pose: Pose2,
    /// Inverse covariance of x, y and theta in that frame.
    pub information: Matrix3<f64>,
    /// Whether the odometry jumped, so that no motion is assumed.
    pub is_jump: bool,
}

impl ScanIncrement {
    /// Returns the increment between two poses; beyond `max_odometry_increment`, no motion with the uncertainty of one
    /// of that length.
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
    /// Inverse covariance of x, y and theta after an increment, in the frame where it begins.
    fn information(&self, increment: Pose2) -> Matrix3<f64> {
        let square = |value: f64| value * value;
        let length = math::hypot(increment.x, increment.y);
        let translation = square(self.translation_stddev) * length;
        let rotation =
            square(self.rotation_stddev) * increment.theta.abs() + square(self.drift_stddev) * length;
        // Even a robot that stands does so by a millimetre.
        let (across, turn) = (1.0 / (translation + 1e-6), 1.0 / (rotation + 1e-6));
        Matrix3::from_diagonal(&[across, across, turn].into())
    }
}
