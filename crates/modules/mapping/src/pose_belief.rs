use serde::{Deserialize, Serialize};
use slate_interfaces::{Pose2, PoseEstimate};

use crate::pose_filter::{Axis, OdometryNoise, PoseFilter};

/// Belief of a planar pose, by an extended Kalman filter.
/// It fuses odometry, positions and headings.
///
/// Odometry predicts; a positioning system and a compass update (Thrun, Burgard and Fox, *Probabilistic Robotics*, 3.3). Until
/// it [begins](PoseBelief::begin) somewhere, the pose is unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseBelief {
    filter: Option<PoseFilter>,
    /// Newest pose of the odometry.
    odometry: Option<[f64; 3]>,
}

impl PoseBelief {
    /// Initializes at a pose in the map frame.
    /// Standard deviations are of x and y (m) and of the heading (rad).
    pub fn begin(&mut self, pose: Pose2, [position, heading]: [f64; 2]) {
        let Pose2 { x, y, theta } = pose;
        self.filter = Some(PoseFilter::new([x, y, theta], [position, position, heading]));
    }

    /// Returns whether the pose is known.
    pub fn is_known(&self) -> bool {
        self.filter.is_some()
    }

    /// Predicts by the increment since the odometry's previous pose.
    /// It does not if the noise is unknown. Returns false for a pose that is not a number, which is skipped.
    pub fn predict(&mut self, pose: Pose2, noise: Option<&OdometryNoise>) -> bool {
        let to = [pose.x, pose.y, pose.theta];
        if !to.iter().all(|number| number.is_finite()) {
            return false;
        }
        let from = self.odometry.replace(to);
        if let (Some(filter), Some(from), Some(noise)) = (&mut self.filter, from, noise) {
            filter.predict(from, to, noise);
        }
        true
    }

    /// Updates by a position, x and y in meters, with its standard deviation.
    /// 0 for an exact one.
    ///
    /// Returns false, without an update, for an outlier, which is more than `gate` standard deviations of the innovation from the
    /// belief, and while the pose is unknown. An infinite gate lets all pass.
    pub fn update_position(&mut self, [x, y]: [f64; 2], stddev: f64, gate: f64) -> bool {
        self.update(&[(Axis::X, x), (Axis::Y, y)], stddev, gate)
    }

    /// Updates by a heading, radians, as by a position.
    pub fn update_heading(&mut self, theta: f64, stddev: f64, gate: f64) -> bool {
        self.update(&[(Axis::Heading, theta)], stddev, gate)
    }

    fn update(&mut self, measured: &[(Axis, f64)], stddev: f64, gate: f64) -> bool {
        let Some(filter) = &mut self.filter else { return false };
        if measured.iter().any(|(axis, value)| filter.is_outlier(*axis, *value, stddev, gate)) {
            return false;
        }
        for (axis, value) in measured {
            filter.update(*axis, *value, stddev);
        }
        true
    }

    /// Returns mean and covariance; `None` while the pose is unknown.
    pub fn estimate(&self) -> Option<PoseEstimate> {
        self.filter.map(|filter| filter.estimate())
    }
}
