/// Version of a statement: epoch of its origin's life, and number in that life.
/// Later statements of an origin have a greater version.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// Epoch of the origin's life.
    /// The upper half is the number of the life, the lower half a random number. It distinguishes lives of the same
    /// number, which occur if the robot has lost its disk between them.
    pub epoch: u64,
    /// Number of the statement in that life, from 1.
    pub sequence: u64,
}

/// Returns the epoch of a life.
pub(crate) fn epoch(number: u32, random: u32) -> u64 {
    u64::from(number) << 32 | u64::from(random)
}

/// Returns the number of the life from its epoch.
pub(crate) fn number(epoch: u64) -> u32 {
    (epoch >> 32) as u32
}
