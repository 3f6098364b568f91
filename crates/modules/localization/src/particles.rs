//! Weighted particles.

use slate_interfaces::Pose2;

/// A pose that the robot may have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Particle {
    /// In the map frame.
    pub pose: Pose2,
    /// Those of all particles sum up to 1.
    pub weight: f64,
}

/// Scales weights so that they sum up to 1; equal ones where that is not possible.
pub(crate) fn normalize(particles: &mut [Particle]) {
    let sum: f64 = particles.iter().map(|particle| particle.weight).sum();
    let count = particles.len() as f64;
    for particle in particles {
        particle.weight = if sum > 0.0 && sum.is_finite() { particle.weight / sum } else { 1.0 / count };
    }
}

/// Effective number of particles (Liu, 1996): 1 over the sum of squared weights.
pub(crate) fn effective_number(particles: &[Particle]) -> f64 {
    1.0 / particles.iter().map(|particle| particle.weight * particle.weight).sum::<f64>()
}
