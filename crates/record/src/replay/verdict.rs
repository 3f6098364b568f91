use super::difference::Difference;

/// The outcome of a [`Comparison`](super::Comparison).
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Every value is the same.
    Identical {
        /// How many there are.
        values: u64,
        /// How many cycles.
        cycles: u64,
        /// Whether that is the whole run; else the recording ends before it did.
        whole: bool,
    },
    /// A value is another one.
    Different(Difference),
    /// The recording has no value that could be compared.
    Nothing,
    /// It can't be said.
    NotCovered(String),
}
