//! Weighted particles.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Particle, Pose2};

/// Particles as numbers, for a state that is saved.
pub(crate) mod parts {
    use super::{Deserialize, Particle, Pose2, Serialize};

    pub fn serialize<S: serde::Serializer>(particles: &[Particle], to: S) -> Result<S::Ok, S::Error> {
        let parts = particles.iter().map(|Particle { pose, weight }| [pose.x, pose.y, pose.theta, *weight]);
        parts.collect::<Vec<[f64; 4]>>().serialize(to)
    }

    pub fn deserialize<'d, D: serde::Deserializer<'d>>(from: D) -> Result<Vec<Particle>, D::Error> {
        let particle = |[x, y, theta, weight]: [f64; 4]| Particle { pose: Pose2 { x, y, theta }, weight };
        Ok(Vec::<[f64; 4]>::deserialize(from)?.into_iter().map(particle).collect())
    }
}

/// Scales weights so that they sum up to 1; equal ones where that is not possible.
pub(crate) fn normalize(particles: &mut [Particle]) {
    let sum: f64 = particles.iter().map(|particle| particle.weight).sum();
    let count = particles.len() as f64;
    for particle in particles {
        particle.weight = if sum > 0.0 && sum.is_finite() { particle.weight / sum } else { 1.0 / count };
    }
}

/// Returns the effective sample size (Liu, 1996): 1 / sum of squared weights.
pub(crate) fn effective_number(particles: &[Particle]) -> f64 {
    1.0 / particles.iter().map(|particle| particle.weight * particle.weight).sum::<f64>()
}
