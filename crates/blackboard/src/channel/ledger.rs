use super::lent::Lent;
use super::lines::{ENTRIES_PER_LINE, FarLines, SlotUse, UseLine};
use super::pool::{self, NO_SLOT, Pool};
use crate::Stamp;
use crate::sync::order;

/// Private state of the writer about the slots, left to the next writer.
#[derive(Debug)]
#[repr(C)]
pub(super) struct Ledger {
    lines: Box<[UseLine]>,
    pub last: Stamp,
    /// The cell that the next value goes to.
    pub cell: usize,
    /// The slot that is worked in.
    pub draft: u16,
    /// Slot that left the ring without ever having been pinned.
    /// It is free without a look at its pins.
    pub spare: u16,
    /// Start of the search for a free slot.
    pub hint: u16,
    /// Slots that show lent bytes; most channels never have any.
    pub lent: Vec<Lent>,
}

impl Ledger {
    /// Creates the ledger of a pool with `near` slots.
    /// They are in whole lines unless there are never more.
    pub fn new(near: usize) -> Self {
        let lines = vec![UseLine::default(); near.div_ceil(ENTRIES_PER_LINE)].into();
        let last = Stamp::default();
        Self { lines, cell: 0, draft: NO_SLOT, spare: NO_SLOT, hint: 0, last, lent: Vec::new() }
    }

    /// Returns the writer's entry of a slot of the channel's pool.
    #[inline(always)] // Part of every write.
    pub fn entry<'a>(&'a mut self, pool: &'a Pool, slot: usize) -> &'a mut SlotUse {
        if slot / ENTRIES_PER_LINE >= self.lines.len() {
            return self.far_entry(pool, slot - self.lines.len() * ENTRIES_PER_LINE);
        }
        // SAFETY: lines are nothing but their entries, one after the other, and there is one for this slot. So there is one
        // place to be looked up, and not two.
        unsafe { &mut *self.lines.as_mut_ptr().cast::<SlotUse>().add(slot) }
    }

    #[cold]
    fn far_entry<'a>(&'a mut self, pool: &'a Pool, slot: usize) -> &'a mut SlotUse {
        let FarLines(lines) = pool.far_lines();
        // SAFETY: a pool has one ledger, which is borrowed as long as the entry.
        let line = unsafe { &mut *lines[slot / ENTRIES_PER_LINE].get() };
        &mut line.0[slot % ENTRIES_PER_LINE]
    }

    /// Counts the pins of the slot that a cell had, which has left the ring.
    #[inline(always)] // Part of every write.
    pub fn remove(&mut self, pool: &Pool, word: u64) {
        let left = pool::slot_of(word);
        if left != NO_SLOT {
            let pins = pool::pins_of(word);
            let entry = self.entry(pool, usize::from(left));
            *entry = SlotUse { pins: entry.pins.wrapping_add(pins), in_ring: false };
            if pins == 0 || cfg!(feature = "mutant-readers") {
                self.spare = left;
            }
        }
    }

    /// Gives back adopted values that no reader sees any more.
    pub fn give_back(&mut self, pool: &Pool) {
        let mut lent = std::mem::take(&mut self.lent);
        lent.retain(|lent| {
            let entry = self.entry(pool, lent.slot.into());
            // All pins but the writer's own. This acquires what readers did before they gave theirs back.
            let returned = pool.slot(lent.slot).returned.load(order::ACQUIRE);
            let pinned = returned.wrapping_add(1) != entry.pins && !cfg!(feature = "mutant-readers");
            if entry.in_ring || pinned {
                return true;
            }
            // SAFETY: the slot is in no cell, so no reader can pin it, and none has.
            unsafe { pool.set_data(lent.slot, pool.own_data(lent.slot)) };
            entry.pins = entry.pins.wrapping_sub(1);
            // Now the bytes go.
            false
        });
        self.lent = lent;
    }
}
