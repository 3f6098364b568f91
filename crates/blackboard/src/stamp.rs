use serde::{Deserialize, Serialize};

/// Time and writer of a value.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    /// Number of values written up to and including this one; 0 for never written.
    pub sequence: u64,
    /// The host's time of the write, in nanoseconds.
    pub time: u64,
    /// Counts the writers that this property has had; the first is 1.
    pub generation: u64,
}
