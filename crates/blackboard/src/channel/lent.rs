use std::fmt;
use std::ptr::NonNull;

use super::{Blocked, Writer};
use crate::Stamp;
use crate::sync::order;

/// Bytes of a value that are read where they are: in memory that a channel does not own. Dropping this gives them back,
/// in whatever thread writes to the channel, or drops the last handle of it.
///
/// # Safety
/// Until this is dropped the bytes are initialised, stay at their address and unchanged, and can be read by all threads.
/// Moving this does not move them. Where another process could change them all the same, only such values may be lent
/// in which every bit pattern is valid: then it spoils values and nothing more.
pub unsafe trait LentBytes: fmt::Debug + Send + Sync {
    /// Where they are; the same at each call.
    fn bytes(&self) -> NonNull<[u8]>;
}

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

/// What a slot shows in place of its own memory.
#[derive(Debug)]
pub(super) struct Lent {
    pub slot: u16,
    /// Kept for what its drop does.
    _bytes: Box<dyn LentBytes>,
}

impl Writer {
    /// Publishes a value of `items` tail items, at most as many as fit, without a copy: readers see the bytes that are
    /// lent. What the draft holds is not published, and a pointer to it is of no use any more.
    ///
    /// The bytes are given back when a newer value has taken the place of this one and no reader holds it any more: at
    /// the next `adopt` or [`give_back`](Writer::give_back), when this writer is dropped, and at the latest when the
    /// channel is gone. So a channel has as many as it keeps, and as its readers held at that time. This may allocate,
    /// which [`write`](Writer::write) does not.
    ///
    /// # Errors
    /// When the bytes are too few or not aligned, the channel's values have to be in memory that was given, or as
    /// [`publish`](Writer::publish). They are given back then.
    pub fn adopt(&mut self, bytes: Box<dyn LentBytes>, items: usize, time: u64) -> Result<Stamp, AdoptError> {
        let shape = self.channel.shape;
        let items = items.min(shape.capacity);
        let (lent, needed) = (bytes.bytes(), shape.bytes(items));
        if lent.len() < needed {
            return Err(AdoptError::TooShort { length: lent.len(), needed });
        }
        if !lent.cast::<u8>().addr().get().is_multiple_of(shape.align.max(1)) {
            return Err(AdoptError::Misaligned { align: shape.align });
        }
        if self.channel.pool.is_given() {
            return Err(AdoptError::Given);
        }
        self.give_back();
        let slot = self.draft_index();
        // As the value's bytes would be, this is changed while the slot is the draft, which nobody has pinned, and
        // brought by the exchange of the cell to whoever pins it: see `Pool::set_data`.
        // SAFETY: the slot is the draft, and shows the bytes until they are given back.
        unsafe { self.channel.pool.set_data(slot, lent.cast()) };
        // The writer pins it, too: so it takes the slot for no draft, however it looks for one, before it has given the
        // bytes back, and other channels pay nothing for it.
        match self.commit(items, needed, time, 1) {
            Ok(stamp) => {
                self.ledger.lent.push(Lent { slot, _bytes: bytes });
                self.give_back();
                Ok(stamp)
            }
            Err(blocked) => {
                // SAFETY: it is still the draft.
                unsafe { self.channel.pool.set_data(slot, self.channel.pool.own_data(slot)) };
                Err(blocked.into())
            }
        }
    }

    /// Gives back what was adopted and nobody sees any more. Who may not adopt again for long calls this now and then.
    pub fn give_back(&mut self) {
        let (pool, ledger) = (&self.channel.pool, &mut self.ledger);
        let mut lent = std::mem::take(&mut ledger.lent);
        lent.retain(|lent| {
            let entry = ledger.entry(pool, lent.slot.into());
            // All pins but the writer's own. This acquires what readers did before they gave theirs back.
            let returned = pool.slot(lent.slot).returned.load(order::ACQUIRE);
            let pinned = returned.wrapping_add(1) != entry.pins && !cfg!(feature = "mutant-readers");
            if entry.in_ring || pinned {
                return true;
            }
            // SAFETY: the slot is in no cell, so nobody can pin it, and nobody has.
            unsafe { pool.set_data(lent.slot, pool.own_data(lent.slot)) };
            entry.pins = entry.pins.wrapping_sub(1);
            // Now the bytes go.
            false
        });
        ledger.lent = lent;
    }
}
