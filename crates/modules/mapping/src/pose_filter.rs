use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use slate_interfaces::{Pose2, PoseEstimate};
use slate_module::math;

/// Extended Kalman filter of a planar pose: mean (x, y, heading) and covariance.
///
/// Odometry predicts, measurements of a coordinate update (Thrun, Burgard and Fox, *Probabilistic Robotics*, 3.3).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseFilter {
    mean: Vector3<f64>,
    covariance: Matrix3<f64>,
}

/// Standard deviations of the odometry; they grow with the root of the path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OdometryNoise {
    /// Translation along the path after a meter, meters; half as much across.
    pub translation_stddev: f64,
    /// Rotation after a meter or a radian, radians.
    pub rotation_stddev: f64,
}

/// Coordinate of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// x in the map frame.
    X = 0,
    /// y in the map frame.
    Y = 1,
    /// Heading.
    Heading = 2,
}

impl PoseFilter {
    /// Returns the belief at a start or after a manual reset.
    /// The pose is x, y (m) and heading (rad), with standard deviations.
    pub fn new([x, y, theta]: [f64; 3], stddev: [f64; 3]) -> Self {
        let stddev = Vector3::from(stddev);
        Self {
            mean: Vector3::new(x, y, math::wrap_angle(theta)),
            covariance: Matrix3::from_diagonal(&stddev.component_mul(&stddev)),
        }
    }

    /// EKF prediction from an odometry increment.
    /// Its two poses (x, y, heading) are in the odometry frame.
    pub fn predict(&mut self, from: [f64; 3], to: [f64; 3], noise: &OdometryNoise) {
        let increment = Vector2::new(to[0] - from[0], to[1] - from[1]);
        let axes = rotation(self.mean[2]);
        let translation = axes * rotation(from[2]).transpose() * increment;
        let turn = math::angle_between(from[2], to[2]);
        self.mean += Vector3::new(translation.x, translation.y, turn);
        self.mean[2] = math::wrap_angle(self.mean[2]);
        // Jacobian of the motion model.
        let jacobian = Matrix3::new(1.0, 0.0, -translation.y, 0.0, 1.0, translation.x, 0.0, 0.0, 1.0);
        let mut covariance = jacobian * self.covariance * jacobian.transpose();
        // Variances grow with the path's length, so that the number of increments makes no difference.
        let length = math::hypot(increment.x, increment.y);
        let along = noise.translation_stddev * noise.translation_stddev * length;
        let across = axes * Matrix2::from_diagonal(&Vector2::new(along, along / 4.0)) * axes.transpose();
        let mut position = covariance.fixed_view_mut::<2, 2>(0, 0);
        position += across;
        covariance[(2, 2)] += noise.rotation_stddev * noise.rotation_stddev * (length + turn.abs());
        // Rounding must not make it asymmetric.
        self.covariance = (covariance + covariance.transpose()) * 0.5;
    }

    /// Returns whether a measurement is outside the gate; false for an exact one.
    /// The gate is a multiple of the standard deviation of the innovation.
    pub fn is_outlier(&self, axis: Axis, measured: f64, stddev: f64, gate: f64) -> bool {
        let innovation = self.innovation(axis, measured);
        let variance = self.covariance[(axis as usize, axis as usize)] + stddev * stddev;
        stddev > 0.0 && innovation * innovation > gate * gate * variance
    }

    fn innovation(&self, axis: Axis, measured: f64) -> f64 {
        match axis {
            Axis::Heading => math::angle_between(self.mean[2], measured),
            Axis::X | Axis::Y => measured - self.mean[axis as usize],
        }
    }

    /// EKF update by a measurement of a coordinate, with its standard deviation.
    /// 0 for an exact one. Skips NaN.
    pub fn update(&mut self, axis: Axis, measured: f64, stddev: f64) {
        let index = axis as usize;
        let innovation = self.innovation(axis, measured);
        if !innovation.is_finite() {
            return;
        }
        let innovation_variance = self.covariance[(index, index)] + stddev * stddev;
        if innovation_variance > 0.0 {
            let row = self.covariance.row(index).into_owned();
            let gain = row.transpose() / innovation_variance;
            self.mean += gain * innovation;
            self.mean[2] = math::wrap_angle(self.mean[2]);
            self.covariance -= gain * row;
        }
        if stddev == 0.0 {
            // Bit for bit: rounding must not change an exact value.
            self.mean[index] = measured;
        }
    }

    /// Returns the mean.
    pub fn pose(&self) -> Pose2 {
        Pose2 { x: self.mean.x, y: self.mean.y, theta: self.mean.z }
    }

    /// Returns mean and covariance.
    pub fn estimate(&self) -> PoseEstimate {
        let mut covariance = [0.0; 9];
        // Row by row, where nalgebra stores columns.
        covariance.copy_from_slice(self.covariance.transpose().as_slice());
        PoseEstimate { pose: self.pose(), covariance }
    }
}

/// Returns the rotation matrix of an angle.
/// It uses the deterministic functions of `math`.
fn rotation(angle: f64) -> Matrix2<f64> {
    let (sine, cosine) = (math::sin(angle), math::cos(angle));
    Matrix2::new(cosine, -sine, sine, cosine)
}
