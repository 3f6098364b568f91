//! Belief of pose and twist.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use slate_interfaces::{Odometry, Pose2, PoseEstimate, Twist2};
use slate_module::math;

/// Number of variables of the state.
pub(super) const SIZE: usize = 10;

/// State of the filter, or a difference of two.
pub(super) type StateVector = SVector<f64, SIZE>;
/// Covariance of the state.
pub(super) type StateMatrix = SMatrix<f64, SIZE, SIZE>;

/// Variable of the state, with the name that `robot_localization` gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum StateVariable {
    /// x in the filter's frame, m.
    X = 0,
    /// y in the filter's frame, m.
    Y = 1,
    /// Heading in the filter's frame, rad.
    Yaw = 2,
    /// Velocity forward, m/s.
    Vx = 3,
    /// Velocity to the left, m/s.
    Vy = 4,
    /// Angular velocity, counter-clockwise, rad/s.
    Vyaw = 5,
    /// Angular velocity that the gyroscope measures at rest, rad/s.
    GyroscopeBias = 6,
    /// Measured over true velocity of the odometry.
    OdometryLinearScale = 7,
    /// Measured over true angular velocity of the odometry.
    OdometryAngularScale = 8,
    /// Measured over true range of landmarks.
    LandmarkRangeScale = 9,
}

/// Innovation of a measurement against a belief.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Innovation {
    /// Mahalanobis distance of the measurement from its prediction by the belief.
    pub distance: f64,
    /// True if the belief was updated: the distance is within the gate.
    pub is_accepted: bool,
}

/// Mean and covariance of pose, twist and calibration at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlanarBelief {
    pub mean: StateVector,
    pub covariance: StateMatrix,
    /// ns.
    pub time: u64,
}

/// Noise of the process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ProcessNoise {
    /// Variances that the variables gain in a second.
    pub variances: StateVector,
    /// True if the pose's noise grows with the norm of the twist.
    /// `variances` then hold for a twist of norm 1.
    pub is_dynamic: bool,
}

/// Measurement near a state, for the correction of a belief.
pub(super) struct Linearization<const D: usize> {
    /// Measured minus expected value at that state.
    pub residual: SVector<f64, D>,
    /// Derivative of the expected value by the state.
    pub jacobian: SMatrix<f64, D, SIZE>,
}

impl PlanarBelief {
    /// Predicts for a time in seconds with constant velocities in the robot's frame.
    ///
    /// The robot drives on a chord of its arc, in the direction of the arc's middle.
    pub fn predict(&mut self, seconds: f64, process_noise: &ProcessNoise) {
        let [vx, vy, vyaw] = [self.mean[3], self.mean[4], self.mean[5]];
        let mut noise = process_noise.variances;
        if process_noise.is_dynamic {
            let speed = (vx * vx + vy * vy + vyaw * vyaw).sqrt();
            (0..3).for_each(|at| noise[at] *= speed);
        }
        let direction = self.mean[2] + 0.5 * vyaw * seconds;
        let (sine, cosine) = (math::sin(direction), math::cos(direction));
        let [right, up] = [(vx * cosine - vy * sine) * seconds, (vx * sine + vy * cosine) * seconds];
        self.mean[0] += right;
        self.mean[1] += up;
        self.mean[2] = math::wrap_angle(self.mean[2] + vyaw * seconds);
        let mut jacobian = StateMatrix::identity();
        for (row, turned, along, across) in [(0, -up, cosine, -sine), (1, right, sine, cosine)] {
            jacobian[(row, 2)] = turned;
            jacobian[(row, 3)] = along * seconds;
            jacobian[(row, 4)] = across * seconds;
            jacobian[(row, 5)] = 0.5 * turned * seconds;
        }
        jacobian[(2, 5)] = seconds;
        let grown = jacobian * self.covariance * jacobian.transpose();
        self.covariance = symmetric(&(grown + StateMatrix::from_diagonal(&noise) * seconds));
    }

    /// Corrects the belief by a measurement linearized at its mean.
    /// It linearizes `iterations - 1` times more at the result (iterated extended Kalman filter: Bell and Cathey, 1993,
    /// *The iterated Kalman filter update as a Gauss-Newton method*).
    ///
    /// A measurement that is farther than `gate` (Mahalanobis distance), or that leads to no number, changes nothing.
    pub fn correct<const D: usize>(
        &mut self,
        noise: &SMatrix<f64, D, D>,
        gate: f64,
        iterations: u32,
        linearize: impl Fn(&StateVector) -> Linearization<D>,
    ) -> Innovation {
        let rejected = |distance: f64| Innovation { distance, is_accepted: false };
        let first = linearize(&self.mean);
        let expected_noise =
            symmetric(&(first.jacobian * self.covariance * first.jacobian.transpose() + noise));
        let Some(factor) = expected_noise.cholesky() else { return rejected(f64::INFINITY) };
        let distance = first.residual.dot(&factor.solve(&first.residual)).sqrt();
        if distance.is_nan() || distance > gate {
            return rejected(distance);
        }
        let (mut mean, mut at) = (self.mean, first);
        for iteration in 0.. {
            let Some(gain) = gain(&self.covariance, &at.jacobian, noise) else { return rejected(distance) };
            let back = difference(&self.mean, &mean);
            let mut next = self.mean + gain * (at.residual - at.jacobian * back);
            next[2] = math::wrap_angle(next[2]);
            let covariance = joseph(&self.covariance, &gain, &at.jacobian, noise);
            if !next.iter().chain(covariance.iter()).all(|number| number.is_finite()) {
                return rejected(distance);
            }
            if iteration + 1 >= iterations {
                (self.mean, self.covariance) = (next, covariance);
                break;
            }
            (mean, at) = (next, linearize(&next));
        }
        Innovation { distance, is_accepted: true }
    }

    /// Returns pose and its covariance.
    pub fn estimate(&self) -> PoseEstimate {
        let mut covariance = [0.0; 9];
        for (at, entry) in covariance.iter_mut().enumerate() {
            *entry = self.covariance[(at / 3, at % 3)];
        }
        PoseEstimate { pose: self.pose(), covariance }
    }

    pub fn pose(&self) -> Pose2 {
        Pose2 { x: self.mean[0], y: self.mean[1], theta: self.mean[2] }
    }

    pub fn odometry(&self) -> Odometry {
        Odometry { pose: self.pose(), twist: Twist2 { linear: self.mean[3], angular: self.mean[5] } }
    }
}

/// Returns the Kalman gain; `None` if the innovation has no covariance.
fn gain<const D: usize>(
    covariance: &StateMatrix,
    jacobian: &SMatrix<f64, D, SIZE>,
    noise: &SMatrix<f64, D, D>,
) -> Option<SMatrix<f64, SIZE, D>> {
    let cross = jacobian * covariance;
    let factor = symmetric(&(cross * jacobian.transpose() + noise)).cholesky()?;
    Some(factor.solve(&cross).transpose())
}

/// Returns the covariance after an update, in Joseph's form.
/// It stays positive with any gain (Bucy and Joseph, 1968, *Filtering for stochastic processes with applications to
/// guidance*).
fn joseph<const D: usize>(
    covariance: &StateMatrix,
    gain: &SMatrix<f64, SIZE, D>,
    jacobian: &SMatrix<f64, D, SIZE>,
    noise: &SMatrix<f64, D, D>,
) -> StateMatrix {
    let kept = StateMatrix::identity() - gain * jacobian;
    symmetric(&(kept * covariance * kept.transpose() + gain * noise * gain.transpose()))
}

/// Returns the difference of two states, with the shortest turn.
fn difference(state: &StateVector, from: &StateVector) -> StateVector {
    let mut difference = state - from;
    difference[2] = math::wrap_angle(difference[2]);
    difference
}

/// Returns the mean of a matrix and its transpose.
/// Rounding makes covariances asymmetric.
fn symmetric<const D: usize>(matrix: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    (matrix + matrix.transpose()) * 0.5
}
