/// Which of an origin's statements came later: each life of an origin has an epoch, each statement of it a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// Which life of the origin: in the upper half what number of life, in the lower half a random number, by which two
    /// lives are told apart that have the same number because the robot has lost its disk between them.
    pub epoch: u64,
    /// Counts the statements of that life, from 1.
    pub sequence: u64,
}

/// The epoch of a life.
pub(crate) fn epoch(number: u32, random: u32) -> u64 {
    u64::from(number) << 32 | u64::from(random)
}

/// What number of life the epoch is.
pub(crate) fn number(epoch: u64) -> u32 {
    (epoch >> 32) as u32
}
