/// Limits of a [`Replica`](super::Replica), **the same for every robot of a team**.
/// Each robot must have room for the statements of all others.
///
/// ```
/// use slate_share::knowledge::Limits;
///
/// let limits = Limits { robots: 16, ..Limits::default() };
/// assert!(limits.memory() < 32 << 20);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Robots whose facts are kept; facts of further robots are refused and counted.
    pub robots: usize,
    /// Lives of one robot whose facts are kept, newest first.
    /// A robot begins a new life with each start in which it states something. Facts of older lives are void.
    pub lives: usize,
    /// Facts and retractions of one life of a robot.
    pub facts: usize,
    /// Memory of one life of a robot, bytes.
    /// A fact counts with its key, its value and 192 bytes.
    pub bytes: usize,
    /// The longest key, bytes.
    pub key: usize,
    /// The longest value, bytes.
    pub value: usize,
    /// Longest message, bytes.
    /// At least 160 bytes more than a key and a value together, and 64 for each life.
    pub message: usize,
    /// Lives that are received in parts at the same time.
    pub stages: usize,
    /// Messages that wait to be sent.
    /// Further ones are dropped and counted; later messages compensate for them.
    pub outgoing: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            robots: 1024,
            lives: 4,
            facts: 4096,
            bytes: 256 << 10,
            key: 128,
            value: 4096,
            message: 16 << 10,
            stages: 4,
            outgoing: 256,
        }
    }
}

/// Overhead of a fact beside its key and its value, bytes.
/// It covers its entries in two trees and the allocator.
pub(crate) const FACT_BYTES: usize = 192;

impl Limits {
    /// Returns the upper bound of a replica's memory, bytes.
    /// The measure is that of [`bytes`](Self::bytes). It is reached if every robot uses its limits in each of its
    /// lives.
    pub fn memory(&self) -> usize {
        let lives = self.robots.saturating_mul(self.lives);
        // A part may hold what is replaced while it is received.
        let stages = self.stages.saturating_mul(2);
        (lives.saturating_add(stages).saturating_mul(self.bytes))
            .saturating_add(self.outgoing.saturating_mul(self.message))
            .saturating_add(self.facts.saturating_mul(self.key.saturating_add(FACT_BYTES)))
    }
}
