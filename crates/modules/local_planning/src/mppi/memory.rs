//! Memory of a controller between calls.

use serde::{Deserialize, Serialize};

use super::Mppi;
use crate::velocity::PlanarVelocity;

/// Memory of [`Mppi`] between two calls.
/// A controller with the same parameters and seed continues from it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MppiMemory {
    /// Mean controls: velocity forward, to the left and angular, one per step.
    mean: [Vec<f32>; 3],
    /// Newest four commands.
    earlier: [PlanarVelocity; 4],
    /// Set of noise of the newest call.
    noise_set: usize,
}

impl Mppi {
    /// Writes the memory; allocates only the first time.
    pub fn remember(&self, memory: &mut MppiMemory) {
        let parts = [&self.mean.vx, &self.mean.vy, &self.mean.wz];
        for (saved, part) in memory.mean.iter_mut().zip(parts) {
            saved.clone_from(part);
        }
        memory.earlier = self.earlier;
        memory.noise_set = self.noise.set();
    }

    /// Continues from a memory.
    /// One of other parameters is ignored.
    pub fn resume(&mut self, memory: &MppiMemory) {
        let parts = [&mut self.mean.vx, &mut self.mean.vy, &mut self.mean.wz];
        if parts.iter().zip(&memory.mean).any(|(part, saved)| part.len() != saved.len()) {
            return;
        }
        for (part, saved) in parts.into_iter().zip(&memory.mean) {
            part.copy_from_slice(saved);
        }
        self.earlier = memory.earlier;
        self.noise.choose_set(memory.noise_set);
    }
}
