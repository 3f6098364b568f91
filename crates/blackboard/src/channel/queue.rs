use std::sync::Arc;

use super::pool::{self, Loan};
use super::{Channel, IDLE};
use crate::sync::{Ordering, order};

/// What happens to a reader that the writer has overtaken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// It goes on with the oldest value kept; what it lost is counted.
    Skip,
    /// It reads no more.
    Evict,
    /// It is not overtaken: the writer is refused. For recorders in lockstep only.
    Block,
}

/// Where a reader begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// With the oldest value kept.
    Oldest,
    /// With the next value written.
    Next,
}

/// The reader lagged by more than the queue keeps, and its policy is to read no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the reader lagged by more than the queue keeps")]
pub struct Evicted;

/// A reader of every value, with a cursor of its own.
#[derive(Debug)]
pub struct QueueReader {
    channel: Arc<Channel>,
    place: usize,
    policy: Policy,
    /// The sequence number of the value to read next.
    next: u64,
    window: Vec<u16>,
    skipped: u64,
    evicted: bool,
}

impl QueueReader {
    pub(super) fn new(channel: Arc<Channel>, place: usize, policy: Policy, start: Start) -> Self {
        let window = Vec::with_capacity(usize::from(channel.budget.window));
        let reader = |next| Self {
            place,
            policy,
            next,
            window,
            skipped: 0,
            evicted: false,
            channel: Arc::clone(&channel),
        };
        if policy == Policy::Block {
            // The writer looks at cursors only when there is a blocker, so the cursor stands first.
            channel.cursors[place].store(channel.published() + 1, order::RELEASE);
            channel.blockers.fetch_add(1, Ordering::AcqRel);
        }
        let tail = channel.published();
        let next = match start {
            Start::Oldest => oldest(tail, channel.ring.len() as u64),
            Start::Next => tail + 1,
        };
        let reader = reader(next);
        reader.show_cursor();
        reader
    }

    fn show_cursor(&self) {
        if self.policy == Policy::Block {
            self.channel.cursors[self.place].store(self.next, order::RELEASE);
        }
    }

    /// Gives the last window back and pins the next values in order, at most as many as the budget's window; says how
    /// many they are.
    ///
    /// # Errors
    /// When the reader was overtaken and its policy is [`Policy::Evict`].
    pub fn pull(&mut self) -> Result<usize, Evicted> {
        self.release();
        if self.evicted {
            return Err(Evicted);
        }
        let tail = self.channel.published();
        let kept = oldest(tail, self.channel.ring.len() as u64);
        if self.next < kept {
            self.lose(kept - self.next)?;
        }
        while self.next <= tail && self.window.len() < self.window.capacity() {
            let slot = pool::slot_of(self.channel.cell(self.next).fetch_add(1, order::PUBLISH));
            // SAFETY: the slot is pinned now.
            let found = unsafe { self.channel.pool.lend(slot, self.channel.shape) }.stamp().sequence;
            if found == self.next {
                self.window.push(slot);
                self.next += 1;
            } else {
                // The writer has just come round.
                self.channel.pool.give_back(slot);
                self.lose(1)?;
            }
        }
        self.show_cursor();
        Ok(self.window.len())
    }

    fn lose(&mut self, count: u64) -> Result<(), Evicted> {
        self.skipped += count;
        self.next += count;
        if self.policy == Policy::Evict {
            self.evicted = true;
            self.release();
            return Err(Evicted);
        }
        Ok(())
    }

    /// The values that the last pull pinned, oldest first.
    pub fn window(&self) -> impl ExactSizeIterator<Item = Loan<'_>> {
        // SAFETY: each is pinned until `self` is used mutably.
        self.window.iter().map(|slot| unsafe { self.channel.pool.lend(*slot, self.channel.shape) })
    }

    /// Gives the window back.
    pub fn release(&mut self) {
        for slot in self.window.drain(..) {
            self.channel.pool.give_back(slot);
        }
    }

    /// How many values it never saw.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// How many values wait for it.
    pub fn lag(&self) -> u64 {
        (self.channel.published() + 1).saturating_sub(self.next)
    }
}

/// The oldest value kept when `tail` were published.
fn oldest(tail: u64, depth: u64) -> u64 {
    tail.saturating_sub(depth) + 1
}

impl Drop for QueueReader {
    fn drop(&mut self) {
        self.release();
        if self.policy == Policy::Block {
            self.channel.blockers.fetch_sub(1, Ordering::AcqRel);
            self.channel.cursors[self.place].store(IDLE, order::RELEASE);
        }
        self.channel.desk().queues[self.place] = false;
    }
}
