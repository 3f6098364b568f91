use std::cell::UnsafeCell;

/// Line of entries that only the writer touches.
/// The writer changes its entries with every value, so readers must have nothing in the same cache lines.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(128))]
pub(super) struct UseLine(pub [SlotUse; ENTRIES_PER_LINE]);

/// Entries of a line.
pub(super) const ENTRIES_PER_LINE: usize = 8;

/// Writer's entry of a slot.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SlotUse {
    /// Pins taken on the slot since it was made, counted when it leaves the ring.
    pub pins: u64,
    pub in_ring: bool,
}

/// Entries of slots that only a channel with many readers has.
/// The pool keeps them, because they are created while the ledger is with the writer.
#[derive(Debug)]
pub(super) struct FarLines(pub Box<[UnsafeCell<UseLine>]>);

// SAFETY: only the one holder of the ledger has access to the entries.
unsafe impl Sync for FarLines {}

impl FarLines {
    pub fn new(count: usize) -> Self {
        Self((0..count.div_ceil(ENTRIES_PER_LINE)).map(|_| UnsafeCell::default()).collect())
    }
}
