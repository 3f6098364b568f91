use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::pool::{Loan, SlotPin};
use super::{Channel, HandleChange, IDLE_CURSOR, has_value};
use crate::sync::{Ordering, order};

/// Policy for a reader that the writer has overtaken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// Continue with the oldest value kept; lost values are counted.
    Skip,
    /// Read no more.
    Evict,
    /// Refuse the writer, so that the reader is not overtaken.
    /// For recorders in lockstep only.
    Block,
}

/// Start position of a reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// The oldest value kept.
    Oldest,
    /// The next value written.
    Next,
}

/// Error of a reader that lagged by more than the queue keeps.
/// Its policy is to read no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the reader lagged by more than the queue keeps")]
pub struct Evicted;

/// Position of a reader of every value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cursor {
    /// The sequence number of the value to read next.
    pub next: u64,
    /// Number of values that it has missed.
    pub skipped: u64,
    /// Set if it reads no more.
    pub evicted: bool,
}

/// A reader of every value, with a cursor of its own.
#[derive(Debug)]
pub struct QueueReader {
    channel: Arc<Channel>,
    index: usize,
    policy: Policy,
    /// The sequence number of the value to read next.
    next: u64,
    window: Vec<SlotPin>,
    skipped: u64,
    evicted: bool,
}

impl QueueReader {
    pub(super) fn new(channel: Arc<Channel>, index: usize, policy: Policy, start: Start) -> Self {
        let depth = channel.ring.len() as u64;
        if policy == Policy::Block {
            channel.cursors[index].store(oldest(channel.published(), depth), order::RELEASE);
            channel.blockers.fetch_add(1, Ordering::Relaxed);
            // The writer looks for blockers before it exchanges a cell, and with each exchange it learns what was
            // stored before the cell was touched. So only a write that is under way now may still overtake.
            for cell in &channel.ring {
                cell.word.fetch_add(0, order::PUBLISH);
            }
        }
        let tail = channel.published();
        let next = match start {
            Start::Oldest => {
                let mut oldest_kept = oldest(tail, depth)..tail;
                oldest_kept.find(|sequence| has_value(channel.cell(*sequence))).unwrap_or(tail.max(1))
            }
            Start::Next => tail + 1,
        };
        let window = Vec::with_capacity(usize::from(channel.budget.window));
        let reader = Self { channel, index, policy, next, window, skipped: 0, evicted: false };
        reader.show_cursor();
        reader
    }

    fn show_cursor(&self) {
        if self.policy == Policy::Block {
            self.channel.cursors[self.index].store(self.next, order::RELEASE);
        }
    }

    /// Releases the last window and pins the next values in order.
    /// Returns their number. They are at most as many as the budget's window.
    ///
    /// # Errors
    /// When the reader was overtaken and its policy is [`Policy::Evict`].
    pub fn pull(&mut self) -> Result<usize, Evicted> {
        self.release();
        if self.evicted {
            return Err(Evicted);
        }
        let tail = self.channel.published();
        let oldest_kept = oldest(tail, self.channel.ring.len() as u64);
        if self.next < oldest_kept {
            self.count_lost(oldest_kept - self.next)?;
        }
        while self.next <= tail && self.window.len() < self.window.capacity() {
            let cell = self.channel.cell(self.next);
            if !has_value(cell) {
                // Those that never came left none there, and the number that comes there next is another one.
                self.count_lost(1)?;
                continue;
            }
            let held = self.channel.pool.pin(cell);
            if held.sequence() == self.next {
                self.window.push(held);
                self.next += 1;
            } else {
                // The writer has just come round.
                held.give_back();
                self.count_lost(1)?;
            }
        }
        self.show_cursor();
        Ok(self.window.len())
    }

    fn count_lost(&mut self, count: u64) -> Result<(), Evicted> {
        self.skipped += count;
        self.next += count;
        if self.policy == Policy::Evict {
            self.evicted = true;
            self.release();
            return Err(Evicted);
        }
        Ok(())
    }

    /// Returns the values that the last pull pinned, oldest first.
    pub fn window(&self) -> impl ExactSizeIterator<Item = Loan<'_>> {
        // SAFETY: no pin is given back until `self` is used mutably.
        self.window.iter().map(|held| unsafe { held.lend() })
    }

    /// Returns the number of values that the last pull pinned.
    pub fn len(&self) -> usize {
        self.window.len()
    }

    /// Returns true if the last pull pinned none.
    pub fn is_empty(&self) -> bool {
        self.window.is_empty()
    }

    /// Releases the window.
    pub fn release(&mut self) {
        self.window.drain(..).for_each(SlotPin::give_back);
    }

    /// Returns the position.
    pub fn cursor(&self) -> Cursor {
        Cursor { next: self.next, skipped: self.skipped, evicted: self.evicted }
    }

    /// Continues at a position; the window is released.
    pub fn resume(&mut self, cursor: Cursor) {
        self.release();
        Cursor { next: self.next, skipped: self.skipped, evicted: self.evicted } = cursor;
        self.show_cursor();
    }

    /// Returns the number of missed values.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Returns the number of waiting values.
    /// They are at most the kept ones, and 0 if it reads no more.
    pub fn waiting(&self) -> u64 {
        self.waiting_of(self.lag())
    }

    fn waiting_of(&self, lag: u64) -> u64 {
        if self.evicted { 0 } else { lag.min(self.channel.ring.len() as u64) }
    }

    /// Returns the number of values that it has missed or will certainly miss.
    pub fn lost(&self) -> u64 {
        // Looked at once, as the writer continues meanwhile.
        let lag = self.lag();
        self.skipped + lag - self.waiting_of(lag)
    }

    /// Returns the number of values that wait, or were lost since the last pull.
    pub fn lag(&self) -> u64 {
        (self.channel.published() + 1).saturating_sub(self.next)
    }
}

/// Returns the oldest value kept when `tail` were published.
pub(super) fn oldest(tail: u64, depth: u64) -> u64 {
    tail.saturating_sub(depth) + 1
}

impl Drop for QueueReader {
    fn drop(&mut self) {
        self.release();
        if self.policy == Policy::Block {
            self.channel.blockers.fetch_sub(1, Ordering::Relaxed);
            self.channel.cursors[self.index].store(IDLE_CURSOR, order::RELEASE);
        }
        self.channel.handles().queues[self.index] = false;
        self.channel.hook.call(HandleChange::ReaderLeft);
    }
}
