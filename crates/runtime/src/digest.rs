use xxhash_rust::xxh3::Xxh3;

/// A fingerprint of everything that modules wrote: equal runs have equal digests.
///
/// Measured times are not part of it, as they differ from run to run.
pub(crate) struct Digest {
    hash: Xxh3,
}

impl Digest {
    pub fn new() -> Self {
        Self { hash: Xxh3::new() }
    }

    /// Adds a value of the property with that place in the order of all.
    pub fn add(&mut self, property: u32, value: &[u8]) {
        self.hash.update(&property.to_le_bytes());
        self.hash.update(value);
    }

    pub fn value(&self) -> u64 {
        self.hash.digest()
    }
}
