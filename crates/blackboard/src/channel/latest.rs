use std::sync::Arc;

use super::Channel;
use super::pool::{Held, Loan, NO_SLOT, slot_of};
use crate::sync::order;
use crate::{Stamp, prefetch};

/// A reader of the newest value. It pins the value that it has seen last, and at times a candidate for the next.
#[derive(Debug)]
pub struct Latest {
    channel: Arc<Channel>,
    held: Option<Held>,
    sequence: u64,
    candidate: Option<Held>,
    /// The last look found something new, so this one may.
    expects_news: bool,
}

impl Latest {
    pub(super) fn new(channel: Arc<Channel>) -> Self {
        Self { channel, held: None, sequence: 0, candidate: None, expects_news: false }
    }

    /// Whether a newer value is there than the one held.
    #[inline]
    pub fn has_news(&self) -> bool {
        match &*self.channel.ring {
            // A slot that is held is not used again, so another value is in another slot. Nothing is read here but
            // the line that a pin writes to.
            [cell] => slot_of(cell.word.load(order::ACQUIRE)) != self.held.map_or(NO_SLOT, Held::index),
            _ => self.channel.published() > self.sequence,
        }
    }

    /// Takes over the newest value; false when the one held is the newest.
    #[inline]
    pub fn refresh(&mut self) -> bool {
        self.propose() && self.accept()
    }

    /// The value held; nothing before the first write.
    #[inline]
    pub fn value(&self) -> Option<Loan<'_>> {
        // SAFETY: the pin is not given back until `self` is used mutably.
        self.held.map(|held| unsafe { held.lend(self.channel.shape) })
    }

    /// Copies the value held, as much of it as fits; says how many items its tail has, and its stamp.
    pub fn copy_to(&self, target: &mut [u8]) -> Option<(usize, Stamp)> {
        let loan = self.value()?;
        let bytes = loan.bytes();
        let length = bytes.len().min(target.len());
        target[..length].copy_from_slice(&bytes[..length]);
        Some((loan.items(), loan.stamp()))
    }

    /// Pins the newest value beside the one held; false when that is the newest.
    #[inline]
    pub fn propose(&mut self) -> bool {
        if self.expects_news {
            prefetch::to_write(&self.channel.ring[0]);
        }
        self.expects_news = self.has_news();
        if !self.expects_news {
            return false;
        }
        // A handle never has more than two pins: that is what the pool counts with.
        self.reject();
        // What stands in the cell is the value that was seen there, or a newer one.
        let cell = match &*self.channel.ring {
            [cell] => &cell.word,
            _ => self.channel.cell(self.channel.published()),
        };
        self.candidate = Some(self.channel.pool.pin(cell));
        true
    }

    /// The candidate, if there is one, becomes the value held; says whether there was one.
    #[inline]
    pub fn accept(&mut self) -> bool {
        let Some(candidate) = self.candidate.take() else { return false };
        if let Some(old) = self.held.replace(candidate) {
            old.give_back();
        }
        self.sequence = candidate.sequence();
        true
    }

    /// The candidate is given back.
    #[inline]
    pub fn reject(&mut self) {
        if let Some(candidate) = self.candidate.take() {
            candidate.give_back();
        }
    }
}

impl Drop for Latest {
    fn drop(&mut self) {
        self.reject();
        if let Some(held) = self.held.take() {
            held.give_back();
        }
        self.channel.desk().latest -= 1;
    }
}
