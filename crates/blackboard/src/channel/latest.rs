use std::sync::Arc;

use super::pool::{self, Loan, SlotPin};
use super::{Channel, HandleChange};
use crate::Stamp;
use crate::sync::{Ordering, order};

/// Reader of the newest value.
/// It pins the value that it has seen last, and at times a candidate for the next; except if it [takes
/// turns](Latest::refresh_in_turn) with the writer.
///
/// It fills a cache line.
#[derive(Debug)]
#[repr(align(64))]
pub struct Latest {
    channel: Arc<Channel>,
    held: Option<SlotPin>,
    /// Set if `held` is not pinned, and stays only until the writer's next turn.
    is_loose: bool,
    sequence: u64,
    candidate: Option<SlotPin>,
    /// Set if the reader is not counted.
    probe: bool,
}

impl Latest {
    pub(super) fn new(channel: Arc<Channel>, probe: bool) -> Self {
        Self { channel, held: None, is_loose: false, sequence: 0, candidate: None, probe }
    }

    /// Returns true if a newer value than the held one is available.
    #[inline]
    pub fn has_news(&self) -> bool {
        self.channel.published() > self.sequence
    }

    /// Takes over the newest value; false if it is already held.
    #[inline]
    pub fn refresh(&mut self) -> bool {
        self.propose() && self.accept()
    }

    /// Returns the held value; `None` before the first write.
    #[inline]
    pub fn value(&self) -> Option<Loan<'_>> {
        // SAFETY: the pin is not given back until `self` is used mutably. Others use `refresh_in_turn`.
        self.held.map(|held| unsafe { held.lend() })
    }

    /// Returns the number of the value seen last; 0 before the first.
    pub fn cursor(&self) -> u64 {
        self.sequence
    }

    /// Continues as a reader that has seen the values until that number.
    /// It holds the newest one, if that has this number; otherwise none before it is refreshed.
    pub fn resume(&mut self, cursor: u64) {
        self.reject();
        self.replace(None);
        self.sequence = 0;
        if cursor < self.channel.published() {
            self.sequence = cursor;
        } else {
            self.refresh();
        }
    }

    /// Copies as much of the held value as fits; returns its tail items and its stamp.
    /// The tail items are a number.
    pub fn copy_to(&self, target: &mut [u8]) -> Option<(usize, Stamp)> {
        let loan = self.value()?;
        let bytes = loan.bytes();
        let length = bytes.len().min(target.len());
        target[..length].copy_from_slice(&bytes[..length]);
        Some((loan.items(), loan.stamp()))
    }

    /// Pins the newest value as a candidate; false if it is already held.
    #[inline]
    pub fn propose(&mut self) -> bool {
        // It may not be this reader's turn any more.
        self.hold();
        let tail = self.channel.published();
        if tail <= self.sequence {
            return false;
        }
        // A handle never has more than two pins: that is what the pool counts with.
        self.reject();
        // The cell has the value of that number, or a newer one.
        self.candidate = Some(self.channel.pool.pin(self.channel.cell(tail)));
        true
    }

    /// Takes over the candidate as the held value; false without a candidate.
    #[inline]
    pub fn accept(&mut self) -> bool {
        let Some(candidate) = self.candidate.take() else { return false };
        self.replace(Some(candidate));
        self.sequence = candidate.sequence();
        true
    }

    /// Replaces the held value by a pinned one, or none.
    #[inline]
    fn replace(&mut self, held: Option<SlotPin>) {
        let is_loose = std::mem::take(&mut self.is_loose);
        if let Some(old) = std::mem::replace(&mut self.held, held).filter(|_| !is_loose) {
            old.give_back();
        }
    }

    /// Returns true while the writer takes turns with its readers.
    #[inline]
    pub fn is_in_turn(&self) -> bool {
        self.channel.ring[0].in_turn.load(Ordering::Relaxed) != 0
    }

    /// Refreshes as [`refresh`](Latest::refresh), without a pin in the reader's turn.
    /// This holds while the writer [takes turns](super::Writer::set_in_turn) with its readers: its last published value
    /// stays in the ring until its next turn. So neither of them pays for conflicts that need both at work at a time.
    ///
    /// # Safety
    /// It is this reader's turn, and it looks at what it holds in this turn alone, or after it was told to
    /// [`hold`](Latest::hold) that in this turn.
    #[inline(always)] // Part of every step with inputs.
    pub unsafe fn refresh_in_turn(&mut self) -> bool {
        let first = &self.channel.ring[0];
        if first.in_turn.load(Ordering::Relaxed) == 0 {
            return self.refresh_out_of_turn();
        }
        let (tail, before) = (first.tail.load(order::ACQUIRE), self.sequence);
        if !self.is_loose {
            if tail == before {
                return false;
            }
            self.replace(None);
        }
        // Only the writer exchanges it, and it is not at work.
        let newest = (tail > 0).then(|| pool::slot_of(self.channel.cell(tail).load(order::ACQUIRE)));
        self.held = newest.map(|slot| SlotPin::new(self.channel.pool.pointers(slot)));
        self.is_loose = self.held.is_some();
        self.sequence = self.held.map_or(0, SlotPin::sequence);
        self.sequence != before
    }

    /// Acts as [`refresh`](Latest::refresh), out of line.
    /// So the code of readers that take turns stays short.
    #[inline(never)]
    fn refresh_out_of_turn(&mut self) -> bool {
        self.refresh()
    }

    /// Pins the held value, if it is not pinned yet.
    /// So it stays unchanged when this turn ends late, and the writer does not wait for that.
    #[inline]
    pub fn hold(&mut self) {
        if self.is_loose && !cfg!(feature = "mutant-turns") {
            // It is in the ring, as nothing was written since; else this is a newer one, which is news as long as no reader has
            // looked at it.
            let tail = self.channel.published();
            let held = (tail > 0).then(|| self.channel.pool.pin(self.channel.cell(tail)));
            self.replace(held);
        }
    }

    /// Gives the candidate back.
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
        self.replace(None);
        let mut handles = self.channel.handles();
        handles.latest -= 1;
        handles.probes -= u16::from(self.probe);
        drop(handles);
        if !self.probe {
            self.channel.hook.call(HandleChange::ReaderLeft);
        }
    }
}
