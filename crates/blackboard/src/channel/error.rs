/// Why a handle of a channel is not given out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkError {
    /// The budget has no more readers of this kind, or there is no slot for what another may pin.
    #[error("no reader handle is left of {limit}")]
    BudgetSpent {
        /// How many the budget has.
        limit: u16,
    },
    /// The property has a writer.
    #[error("there is a writer already, of generation {generation}")]
    WriterTaken {
        /// Which one.
        generation: u64,
    },
    /// The memory that the values are to be in is spent.
    #[error("no memory is left for another value of {bytes} bytes")]
    OutOfMemory {
        /// How many bytes a value takes there.
        bytes: usize,
    },
}

/// A reader that must not be overtaken has no room; nothing was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a reader that must see every value is behind by the whole queue")]
pub struct Blocked;

/// A value whose bytes are elsewhere was not published.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AdoptError {
    /// A reader that must not be overtaken has no room.
    #[error(transparent)]
    Blocked(#[from] Blocked),
    /// There are fewer bytes than the value has.
    #[error("the value takes {needed} bytes, rounded up to its alignment, and {length} are lent")]
    TooShort {
        /// How many there are.
        length: usize,
        /// How many it takes.
        needed: usize,
    },
    /// They begin where no such value can.
    #[error("the value is aligned to {align} bytes, and those that are lent are not")]
    Misaligned {
        /// What its address has to be a multiple of.
        align: usize,
    },
    /// Another process looks for the values in memory that was given for them.
    #[error("the values of the channel have to be in the memory that was given for them")]
    Given,
}
