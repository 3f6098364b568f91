use std::fmt;
use std::ptr::NonNull;

use super::pool::Pool;
use super::{Blocked, Writer};
use crate::Stamp;

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
    /// The bytes are given back when a newer value has taken the place of this one and no reader holds it any more. That
    /// is looked at whenever this writer goes on to a new draft, adopts, or is dropped; at the latest the channel's end
    /// gives them back. So a channel keeps as many as its depth and what its readers hold, and one or two more. This may
    /// allocate, which [`write`](Writer::write) does not.
    ///
    /// # Errors
    /// When the bytes are too few or not aligned, the channel's values have to be in memory that was given, or as
    /// [`publish`](Writer::publish). They are given back then.
    pub fn adopt(&mut self, bytes: Box<dyn LentBytes>, items: usize, time: u64) -> Result<Stamp, AdoptError> {
        let shape = self.shape();
        let lent = bytes.bytes();
        let needed = shape.bytes(items.min(shape.capacity));
        if lent.len() < needed {
            return Err(AdoptError::TooShort { length: lent.len(), needed });
        }
        if !lent.cast::<u8>().addr().get().is_multiple_of(shape.align.max(1)) {
            return Err(AdoptError::Misaligned { align: shape.align });
        }
        if self.channel.pool.is_given() {
            return Err(AdoptError::Given);
        }
        let slot = self.draft_index();
        // As the value's bytes would be, this is changed while the slot is the draft, which nobody has pinned, and brought
        // by the exchange of the cell to whoever pins it: see `Pool::set_data`.
        // SAFETY: the slot is the draft. It shows the bytes until they are given back, before it is a draft again.
        unsafe { self.channel.pool.set_data(slot, lent.cast()) };
        self.ledger.lent.push(Lent { slot, _bytes: bytes });
        let published = self.publish(items, time);
        // Without success the draft is not in the ring, so its bytes are among those that nobody sees.
        self.give_back();
        Ok(published?)
    }
}

/// Gives back what nobody sees any more: the value is not in the ring, and all who had it pinned have let it go. The
/// slot has its own memory again before the bytes go.
pub(super) fn give_back(lent: &mut Vec<Lent>, pool: &Pool, mut is_seen: impl FnMut(u16) -> bool) {
    lent.retain(|lent| {
        let seen = is_seen(lent.slot);
        if !seen {
            // SAFETY: nobody has the slot pinned, and nobody can pin it, as no cell names it.
            unsafe { pool.set_data(lent.slot, pool.own_data(lent.slot)) };
        }
        seen
    });
}
