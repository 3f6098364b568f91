//! Fingerprint of all values that modules write in lockstep.

use serde::{Deserialize, Serialize};
use slate_blackboard::bytes;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// Size of the buffer of values that are hashed together, bytes.
/// A call of the hash costs more than a small value.
const BUFFER_SIZE: usize = 16 * 1024;

/// Fingerprint of all values that modules wrote; equal runs have equal digests.
///
/// Measured times are not part of it, as they differ from run to run. It is a chain, each link of which is the hash of
/// some values with the link before as the seed: so it can be kept, and continues in another process.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Digest {
    chain: u64,
    #[serde(with = "bytes")]
    waiting: Vec<u8>,
}

impl Default for Digest {
    /// Returns the digest of no values.
    fn default() -> Self {
        Self { chain: 0, waiting: Vec::with_capacity(BUFFER_SIZE) }
    }
}

impl Digest {
    /// Adds a value of the property with that place in the order of all.
    #[inline]
    pub fn add(&mut self, property: u32, value: &[u8]) {
        // The most frequent size, for which a copy needs no call.
        if let Ok(value) = <[u8; 8]>::try_from(value)
            && self.waiting.len() + 12 <= BUFFER_SIZE
        {
            let entry = u128::from(property) | u128::from(u64::from_le_bytes(value)) << 32;
            self.waiting.extend_from_slice(&entry.to_le_bytes()[..12]);
        } else {
            self.add_any(property, value);
        }
    }

    fn add_any(&mut self, property: u32, value: &[u8]) {
        if self.waiting.len() + 4 + value.len() > BUFFER_SIZE {
            self.chain = self.value();
            self.waiting.clear();
        }
        if 4 + value.len() > BUFFER_SIZE {
            let seed = xxh3_64_with_seed(&property.to_le_bytes(), self.chain);
            self.chain = xxh3_64_with_seed(value, seed);
            return;
        }
        self.waiting.extend_from_slice(&property.to_le_bytes());
        self.waiting.extend_from_slice(value);
    }

    /// Returns the fingerprint of all values so far.
    pub fn value(&self) -> u64 {
        xxh3_64_with_seed(&self.waiting, self.chain)
    }

    /// Returns the continuation of a kept digest, with room for further values.
    pub fn resumed(mut self) -> Self {
        self.waiting.reserve_exact(BUFFER_SIZE.saturating_sub(self.waiting.len()));
        self
    }
}
