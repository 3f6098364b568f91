//! Pose graph and its optimization.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use slate_interfaces::Pose2;
use slate_module::math;

use crate::block_cholesky::BlockCholesky;
use crate::saved::{self, SavedPose};
use crate::se2;

/// Largest number of iterations.
const ITERATIONS: usize = 30;
/// Change of all poses below which they count as found, m and rad.
const CONVERGED: f64 = 1e-5;

/// Constraint between two poses of a [`PoseGraph`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Constraint {
    /// Pose in whose frame the other is measured.
    pub from: usize,
    /// Measured pose.
    pub to: usize,
    /// Measurement: `to` in the frame of `from`.
    #[serde(with = "SavedPose")]
    pub relative: Pose2,
    /// Inverse covariance of x, y and theta of the measurement.
    pub information: Matrix3<f64>,
    /// True for a constraint weighed by a robust kernel.
    /// It may be wrong, as loop closures may.
    pub is_robust: bool,
}

/// Poses and constraints between them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseGraph {
    /// Poses in the map frame; the first one is held.
    #[serde(with = "saved::poses")]
    pub poses: Vec<Pose2>,
    /// Constraints of the graph.
    /// Those of poses that do not exist, or with numbers that are not finite, are left out.
    pub constraints: Vec<Constraint>,
}

/// Result of an optimization.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optimization {
    /// Cost before: half the sum of squared Mahalanobis distances.
    /// Robust ones count by their kernel.
    pub before: f64,
    /// Cost after.
    pub after: f64,
    /// Number of iterations.
    pub iterations: usize,
}

impl PoseGraph {
    /// Minimizes the cost by Levenberg and Marquardt's method on SE(2).
    /// Grisetti, Kuemmerle, Stachniss and Burgard, 2010, *A tutorial on graph-based SLAM*.
    ///
    /// Robust constraints are weighed by dynamic covariance scaling with that `kernel`, the squared Mahalanobis
    /// distance from which they lose weight (Agarwal et al., 2013, *Robust map optimization using dynamic covariance
    /// scaling*, equation 14).
    pub fn optimize(&mut self, kernel: f64) -> Optimization {
        let is_valid = |constraint: &&Constraint| {
            let Constraint { from, to, relative, information, .. } = constraint;
            let is_pair = from != to && *from.max(to) < self.poses.len();
            is_pair && relative.is_known() && information.iter().all(|number| number.is_finite())
        };
        let constraints: Vec<Constraint> = self.constraints.iter().filter(is_valid).copied().collect();
        let pairs = constraints.iter().map(|constraint| (constraint.from, constraint.to));
        let mut matrix = BlockCholesky::new(self.poses.len(), pairs);
        let mut damping = 1e-6;
        let before = cost(&self.poses, &constraints, kernel);
        let (mut after, mut iterations) = (before, 0);
        while iterations < ITERATIONS {
            iterations += 1;
            let mut step = linearize(&mut matrix, &self.poses, &constraints, kernel);
            matrix.damp(damping);
            let moved = matrix.factorize().map(|()| {
                matrix.solve(&mut step);
                // Held but for rounding.
                step.iter_mut().take(1).for_each(|step| *step = Vector3::zeros());
                let moved: Vec<Pose2> =
                    self.poses.iter().zip(&step).map(|(pose, step)| shift(*pose, step)).collect();
                (cost(&moved, &constraints, kernel), moved)
            });
            match moved {
                // False for a cost that is not a number.
                Some((cost, moved)) if cost <= after => {
                    (self.poses, after) = (moved, cost);
                    damping *= 0.1;
                    if step.iter().all(|step| step.amax() < CONVERGED) {
                        break;
                    }
                }
                _ if damping > 1e6 => break,
                _ => damping *= 10.0,
            }
        }
        Optimization { before, after, iterations }
    }
}

fn shift(pose: Pose2, step: &Vector3<f64>) -> Pose2 {
    Pose2 { x: pose.x + step.x, y: pose.y + step.y, theta: math::wrap_angle(pose.theta + step.z) }
}

/// Returns the difference between a constraint's poses and its measurement.
fn error(poses: &[Pose2], constraint: &Constraint) -> Vector3<f64> {
    let found = se2::relative(poses[constraint.from], poses[constraint.to]);
    let Pose2 { x, y, theta } = constraint.relative;
    Vector3::new(found.x - x, found.y - y, math::angle_between(theta, found.theta))
}

/// Returns the squared Mahalanobis distance, and the weight of the constraint.
fn weight(constraint: &Constraint, error: &Vector3<f64>, kernel: f64) -> (f64, f64) {
    let square = error.dot(&(constraint.information * error));
    if !constraint.is_robust || square <= kernel {
        return (square, 1.0);
    }
    let scale = 2.0 * kernel / (kernel + square);
    (square, scale * scale)
}

fn cost(poses: &[Pose2], constraints: &[Constraint], kernel: f64) -> f64 {
    let costs = constraints.iter().map(|constraint| {
        let (square, weight) = weight(constraint, &error(poses, constraint), kernel);
        // Of the robust kernel, whose derivative the weight is.
        let lost = if weight < 1.0 { kernel * (3.0 * square - kernel) / (kernel + square) } else { square };
        lost / 2.0
    });
    costs.sum()
}

/// Fills the matrix with the normal equations at the poses.
/// Returns their right-hand side.
fn linearize(
    matrix: &mut BlockCholesky,
    poses: &[Pose2],
    constraints: &[Constraint],
    kernel: f64,
) -> Vec<Vector3<f64>> {
    matrix.clear();
    let mut side = vec![Vector3::zeros(); poses.len()];
    for constraint in constraints {
        let error = error(poses, constraint);
        let (_, weight) = weight(constraint, &error, kernel);
        let information = constraint.information * weight;
        let (from, to) = (poses[constraint.from], poses[constraint.to]);
        let (sine, cosine) = (math::sin(from.theta), math::cos(from.theta));
        let (right, up) = (to.x - from.x, to.y - from.y);
        let turned = (up * cosine - right * sine, -(right * cosine + up * sine));
        let before = Matrix3::new(-cosine, -sine, turned.0, sine, -cosine, turned.1, 0.0, 0.0, -1.0);
        let after = Matrix3::new(cosine, sine, 0.0, -sine, cosine, 0.0, 0.0, 0.0, 1.0);
        let (weighed_before, weighed_after) =
            (before.transpose() * information, after.transpose() * information);
        matrix.add_diagonal(constraint.from, &(weighed_before * before));
        matrix.add_diagonal(constraint.to, &(weighed_after * after));
        matrix.add_pair(constraint.to, constraint.from, &(weighed_after * before));
        side[constraint.from] -= weighed_before * error;
        side[constraint.to] -= weighed_after * error;
    }
    // Poses without a constraint stay, and so does the first.
    for pose in 0..poses.len() {
        matrix.add_diagonal(pose, &(Matrix3::identity() * if pose == 0 { 1e12 } else { 1e-9 }));
    }
    side
}
