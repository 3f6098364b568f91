use xxhash_rust::xxh3::Xxh3;

/// Values are hashed together when they fill this, bytes: a call of the hash costs more than a small value.
const TOGETHER: usize = 16 * 1024;

/// A fingerprint of everything that modules wrote: equal runs have equal digests.
///
/// Measured times are not part of it, as they differ from run to run.
pub(crate) struct Digest {
    hash: Box<Xxh3>,
    waiting: Vec<u8>,
}

impl Digest {
    pub fn new() -> Self {
        Self { hash: Box::new(Xxh3::new()), waiting: Vec::with_capacity(TOGETHER) }
    }

    /// Adds a value of the property with that place in the order of all.
    #[inline]
    pub fn add(&mut self, property: u32, value: &[u8]) {
        if self.waiting.len() + 4 + value.len() > TOGETHER {
            self.hash.update(&self.waiting);
            self.waiting.clear();
        }
        if 4 + value.len() > TOGETHER {
            self.hash.update(&property.to_le_bytes());
            self.hash.update(value);
            return;
        }
        self.waiting.extend_from_slice(&property.to_le_bytes());
        self.waiting.extend_from_slice(value);
    }

    pub fn value(&self) -> u64 {
        let mut hash = self.hash.clone();
        hash.update(&self.waiting);
        hash.digest()
    }
}
