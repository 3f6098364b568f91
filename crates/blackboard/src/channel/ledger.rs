use std::cell::UnsafeCell;

use super::lent::Lent;
use super::pool::{self, NO_SLOT, Pool};
use crate::Stamp;

/// What only the writer knows of the slots, and leaves to the next writer.
#[derive(Debug)]
#[repr(C)]
pub(super) struct Ledger {
    lines: Box<[Line]>,
    pub last: Stamp,
    /// The cell that the next value goes to.
    pub cell: usize,
    /// The slot that is worked in.
    pub draft: u16,
    /// A slot that left the ring without ever having been pinned, so that nobody needs to be asked.
    pub spare: u16,
    /// Where the search for a free slot begins.
    pub hint: u16,
    /// Slots that show lent bytes; most channels never have any.
    pub lent: Vec<Lent>,
}

/// The writer changes its entries with every value, so readers must have nothing in the same cache lines.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(128))]
struct Line([Entry; LINE]);

/// Entries of a line.
pub(super) const LINE: usize = 8;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    /// Pins taken on the slot since it was made, counted when it leaves the ring.
    pub pins: u64,
    pub in_ring: bool,
}

/// The entries of slots that only a channel with many readers has. The pool keeps them, as they come while the ledger is
/// with the writer.
#[derive(Debug)]
pub(super) struct FarLines(Box<[UnsafeCell<Line>]>);

// SAFETY: only the ledger's holder, of whom there is one, gets at the entries.
unsafe impl Sync for FarLines {}

impl FarLines {
    pub fn new(count: usize) -> Self {
        Self((0..count.div_ceil(LINE)).map(|_| UnsafeCell::default()).collect())
    }
}

impl Ledger {
    /// That of a pool with so many slots near, in whole lines unless it never has more.
    pub fn new(near: usize) -> Self {
        let lines = vec![Line::default(); near.div_ceil(LINE)].into();
        let last = Stamp::default();
        Self { lines, cell: 0, draft: NO_SLOT, spare: NO_SLOT, hint: 0, last, lent: Vec::new() }
    }

    /// What is known of a slot of the channel's pool.
    #[inline(always)] // Part of every write.
    pub fn entry<'a>(&'a mut self, pool: &'a Pool, slot: usize) -> &'a mut Entry {
        if slot / LINE >= self.lines.len() {
            return self.far_entry(pool, slot - self.lines.len() * LINE);
        }
        // SAFETY: lines are nothing but their entries, one after the other, and there is one for this slot. So there is one
        // place to be looked up, and not two.
        unsafe { &mut *self.lines.as_mut_ptr().cast::<Entry>().add(slot) }
    }

    #[cold]
    fn far_entry<'a>(&'a mut self, pool: &'a Pool, slot: usize) -> &'a mut Entry {
        let FarLines(lines) = pool.far_lines();
        // SAFETY: a pool has one ledger, which is borrowed as long as the entry.
        let line = unsafe { &mut *lines[slot / LINE].get() };
        &mut line.0[slot % LINE]
    }

    /// Counts the pins of the slot that a cell had, which has left the ring.
    #[inline(always)] // Part of every write.
    pub fn take_out(&mut self, pool: &Pool, word: u64) {
        let left = pool::slot_of(word);
        if left != NO_SLOT {
            let pins = pool::pins_of(word);
            let entry = self.entry(pool, usize::from(left));
            *entry = Entry { pins: entry.pins.wrapping_add(pins), in_ring: false };
            if pins == 0 || cfg!(feature = "mutant-readers") {
                self.spare = left;
            }
        }
    }
}
