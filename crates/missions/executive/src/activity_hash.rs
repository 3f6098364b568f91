//! Hash of a mission's activity.

/// Hash of what an activity shows (as FNV-1a), the same in every build.
#[derive(Clone, Copy, Debug)]
pub struct ActivityHash(u64);

impl Default for ActivityHash {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl ActivityHash {
    /// Adds a number.
    pub fn number(&mut self, number: u64) {
        self.0 = (self.0 ^ number).wrapping_mul(0x0100_0000_01b3);
        // A multiplication changes no lower bits by higher ones.
        self.0 ^= self.0 >> 29;
    }

    /// Adds a text.
    pub fn text(&mut self, text: &str) {
        text.bytes().for_each(|byte| self.number(byte.into()));
        // The length keeps apart what follows each other.
        self.number(text.len() as u64);
    }

    /// Returns the hash, without the sign.
    /// Some formats of states have no greater numbers.
    pub fn finish(self) -> u64 {
        self.0 & (u64::MAX >> 1)
    }
}
