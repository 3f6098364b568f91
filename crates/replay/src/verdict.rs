use super::difference::Difference;

/// The outcome of a [`Comparison`](super::Comparison).
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// All values are equal.
    Identical {
        /// Number of values.
        values: u64,
        /// Number of cycles.
        cycles: u64,
        /// Set if that is the whole run; otherwise the recording ends before it did.
        whole: bool,
    },
    /// A value differs.
    Different(Difference),
    /// The recording has no value that could be compared.
    Nothing,
    /// The comparison is inconclusive.
    NotCovered(String),
}
