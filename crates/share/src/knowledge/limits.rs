/// What a [`Replica`](super::Replica) holds at most. **The same for every robot of a team**: what one robot may state, the
/// others must have room for.
///
/// ```
/// use slate_share::knowledge::Limits;
///
/// let limits = Limits { robots: 16, ..Limits::default() };
/// assert!(limits.memory() < 32 << 20);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Robots whose facts are kept. Facts of more robots are refused and counted.
    pub robots: usize,
    /// Lives of one robot whose facts are kept: a robot begins a new life with each start in which it states something.
    /// Facts of earlier lives than the newest so many are void.
    pub lives: usize,
    /// Facts and retractions of one life of a robot.
    pub facts: usize,
    /// Memory of one life of a robot, bytes. A fact counts with its key, its value and 192 bytes.
    pub bytes: usize,
    /// The longest key, bytes.
    pub key: usize,
    /// The longest value, bytes.
    pub value: usize,
    /// The longest message, bytes; at least 160 more than a key and a value together, and 64 for each life.
    pub message: usize,
    /// Lives that are received in parts at the same time.
    pub stages: usize,
    /// Messages that wait to be sent; more are dropped and counted, and made good by later ones.
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

/// What a fact costs beside its key and its value: its places in two trees, and what the allocator adds.
pub(crate) const FACT_BYTES: usize = 192;

impl Limits {
    /// The memory that a replica never exceeds, bytes, by the measure of [`bytes`](Self::bytes): reached when every
    /// robot uses all that it may in each of its lives.
    pub fn memory(&self) -> usize {
        let lives = self.robots.saturating_mul(self.lives);
        // A part may hold what is replaced while it is received.
        let stages = self.stages.saturating_mul(2);
        (lives.saturating_add(stages).saturating_mul(self.bytes))
            .saturating_add(self.outgoing.saturating_mul(self.message))
            .saturating_add(self.facts.saturating_mul(self.key.saturating_add(FACT_BYTES)))
    }
}
