/// Error of requesting a handle of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkError {
    /// The budget is exhausted for this kind of reader.
    /// It has no more readers, or there is no slot for the pins of another one.
    #[error("no reader handle is left of {limit}")]
    BudgetSpent {
        /// Number of readers in the budget.
        limit: u16,
    },
    /// The property has a writer.
    #[error("it already has a writer, of generation {generation}")]
    WriterTaken {
        /// Generation of the writer.
        generation: u64,
    },
    /// The memory that the values are to be in is spent.
    #[error("no memory is left for another value of {bytes} bytes")]
    OutOfMemory {
        /// Size of a value in that memory, bytes.
        bytes: usize,
    },
}

/// Error: a reader that must not be overtaken has no room; nothing was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a reader that must see every value is behind by the whole queue")]
pub struct Blocked;

/// Error of publishing a lent value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AdoptError {
    /// A reader that must not be overtaken has no room.
    #[error(transparent)]
    Blocked(#[from] Blocked),
    /// The lent memory is smaller than the value.
    #[error("the value takes {needed} bytes, rounded up to its alignment, and {length} are lent")]
    TooShort {
        /// Number of lent bytes.
        length: usize,
        /// Number of needed bytes.
        needed: usize,
    },
    /// The lent bytes are misaligned for such a value.
    #[error("the value is aligned to {align} bytes, and those that are lent are not")]
    Misaligned {
        /// Required alignment of the address, bytes.
        align: usize,
    },
    /// Another process looks for the values in memory that was given for them.
    #[error("the values of the channel have to be in the memory that was given for them")]
    Given,
}
