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
