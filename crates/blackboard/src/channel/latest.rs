use std::sync::Arc;

use super::Channel;
use super::pool::{self, Loan, NO_SLOT};
use crate::sync::order;

/// A reader of the newest value. It pins the value that it has seen last, and at times a candidate for the next.
#[derive(Debug)]
pub struct Latest {
    channel: Arc<Channel>,
    held: u16,
    sequence: u64,
    candidate: u16,
}

impl Latest {
    pub(super) fn new(channel: Arc<Channel>) -> Self {
        Self { channel, held: NO_SLOT, sequence: 0, candidate: NO_SLOT }
    }

    /// Whether a newer value is there than the one held.
    #[inline]
    pub fn has_news(&self) -> bool {
        self.channel.published() > self.sequence
    }

    /// Takes over the newest value; false when the one held is the newest.
    #[inline]
    pub fn refresh(&mut self) -> bool {
        let tail = self.channel.published();
        if tail <= self.sequence {
            return false;
        }
        // The old one goes first, so that a handle needs no third slot.
        self.give_back_held();
        self.held = self.pin(tail);
        self.sequence = self.sequence_of(self.held);
        true
    }

    /// Pins what stands in the cell of that value: it, or a newer one.
    #[inline]
    fn pin(&self, tail: u64) -> u16 {
        pool::slot_of(self.channel.cell(tail).fetch_add(1, order::PUBLISH))
    }

    #[inline]
    fn sequence_of(&self, slot: u16) -> u64 {
        // SAFETY: the slot is pinned.
        unsafe { self.channel.pool.lend(slot, self.channel.shape) }.stamp().sequence
    }

    #[inline]
    fn give_back_held(&mut self) {
        if self.held != NO_SLOT {
            self.channel.pool.give_back(self.held);
            self.held = NO_SLOT;
        }
    }

    /// The value held; nothing before the first write.
    #[inline]
    pub fn value(&self) -> Option<Loan<'_>> {
        // SAFETY: the slot is pinned until `self` is used mutably.
        (self.held != NO_SLOT).then(|| unsafe { self.channel.pool.lend(self.held, self.channel.shape) })
    }

    /// Pins the newest value beside the one held; false when that is the newest.
    pub fn propose(&mut self) -> bool {
        let tail = self.channel.published();
        if tail <= self.sequence {
            return false;
        }
        self.reject();
        self.candidate = self.pin(tail);
        true
    }

    /// The candidate becomes the value held.
    pub fn accept(&mut self) {
        if self.candidate != NO_SLOT {
            self.give_back_held();
            self.held = std::mem::replace(&mut self.candidate, NO_SLOT);
            self.sequence = self.sequence_of(self.held);
        }
    }

    /// The candidate is given back.
    pub fn reject(&mut self) {
        if self.candidate != NO_SLOT {
            self.channel.pool.give_back(self.candidate);
            self.candidate = NO_SLOT;
        }
    }
}

impl Drop for Latest {
    fn drop(&mut self) {
        self.give_back_held();
        self.reject();
        self.channel.desk().latest -= 1;
    }
}
