//! Proposal of the particle filter.

use nalgebra::{Matrix3, Vector3};
use slate_interfaces::Pose2;
use slate_module::{Random, math};

/// Normal distribution of poses that a particle draws from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseProposal {
    center: Pose2,
    /// Inverse covariance of x, y and theta.
    precision: Matrix3<f64>,
    /// Cholesky factor of the covariance.
    root: Matrix3<f64>,
}

impl PoseProposal {
    /// Returns a distribution.
    /// It has unit covariance if the precision has no inverse.
    pub fn new(center: Pose2, precision: Matrix3<f64>) -> Self {
        match precision.try_inverse().and_then(|covariance| covariance.cholesky()) {
            Some(root) => Self { center, precision, root: root.l() },
            None => Self { center, precision: Matrix3::identity(), root: Matrix3::identity() },
        }
    }

    /// Draws an offset from the center.
    pub fn draw(&self, random: &mut Random) -> Vector3<f64> {
        self.root * normal(random)
    }

    /// Returns the pose at an offset from the center.
    pub fn pose(&self, offset: Vector3<f64>) -> Pose2 {
        let Pose2 { x, y, theta } = self.center;
        Pose2 { x: x + offset.x, y: y + offset.y, theta: math::wrap_angle(theta + offset.z) }
    }

    /// Returns the logarithm of the density at an offset, without its constant.
    /// The constant is common to all normal distributions.
    pub fn log_density(&self, offset: Vector3<f64>) -> f64 {
        let log_volume: f64 = self.root.diagonal().iter().map(|value| math::ln(*value)).sum();
        -0.5 * offset.dot(&(self.precision * offset)) - log_volume
    }
}

/// Weighted offsets.
#[derive(Default)]
pub(crate) struct Moments {
    samples: Vec<(Vector3<f64>, f64)>,
}

impl Moments {
    pub fn add(&mut self, offset: Vector3<f64>, log_weight: f64) {
        self.samples.push((offset, log_weight));
    }

    /// Draws an offset from the normal distribution of the weighted ones.
    pub fn draw(&self, random: &mut Random) -> Vector3<f64> {
        let (most, sum) = self.largest_and_sum();
        let weight = |log: f64| math::exp(log - most);
        let mean = self.samples.iter().map(|(offset, log)| offset * weight(*log)).sum::<Vector3<f64>>() / sum;
        let square = |(offset, log): &(Vector3<f64>, f64)| {
            let apart = offset - mean;
            apart * apart.transpose() * weight(*log)
        };
        let covariance = self.samples.iter().map(square).sum::<Matrix3<f64>>() / sum;
        let spread = (covariance + Matrix3::identity() * 1e-9).cholesky();
        spread.map_or(mean, |root| mean + root.l() * normal(random))
    }

    /// Returns the logarithm of the mean weight.
    pub fn log_mean_weight(&self) -> f64 {
        let (most, sum) = self.largest_and_sum();
        most + math::ln(sum / self.samples.len() as f64)
    }

    /// Returns the largest log weight, and the sum of weights relative to it.
    fn largest_and_sum(&self) -> (f64, f64) {
        let most = self.samples.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, math::max);
        (most, self.samples.iter().map(|(_, log)| math::exp(*log - most)).sum())
    }
}

fn normal(random: &mut Random) -> Vector3<f64> {
    Vector3::new(random.normal(), random.normal(), random.normal())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the mean weight of the samples of a proposal.
    /// `precision` is the proposal's inverse covariance, for a target of inverse covariance 1.
    fn log_mean_weight(precision: Matrix3<f64>) -> f64 {
        let proposal = PoseProposal::new(Pose2::default(), precision);
        let mut random = Random::new(1, "proposal");
        let mut sampled = Moments::default();
        for _ in 0..20_000 {
            let offset = proposal.draw(&mut random);
            sampled.add(offset, -0.5 * offset.norm_squared() - proposal.log_density(offset));
        }
        sampled.log_mean_weight()
    }

    #[test]
    fn mean_weight_does_not_depend_on_the_proposal() {
        for precision in [[1.0, 1.0, 1.0], [0.5, 0.25, 0.7], [0.3, 1.2, 0.1]] {
            let found = log_mean_weight(Matrix3::from_diagonal(&precision.into()));
            assert!(found.abs() < 0.05, "{precision:?}: {found}");
        }
    }

    #[test]
    fn precision_without_inverse_is_weighed_too() {
        assert!(log_mean_weight(Matrix3::zeros()).abs() < 0.05);
        assert!(log_mean_weight(Matrix3::from_element(f64::NAN)).abs() < 0.05);
    }
}
