use serde::{Deserialize, Serialize};

/// When a value was written, and by which writer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    /// How many values were written before and including this one; 0 means never written.
    pub sequence: u64,
    /// The host's time of the write, in nanoseconds.
    pub time: u64,
    /// Counts the writers that this property has had; the first is 1.
    pub generation: u64,
}
