//! The values of one property: a pool of slots, and a ring of cells that say which slots hold the last values.
//!
//! A cell is one word, `slot:16 | readers:48`. A reader adds one to it and learns in the same instruction which slot
//! it has pinned; the writer exchanges the word and learns how many readers pinned the slot that it took out. A slot
//! is free again when as many readers have given it back. So a channel with one cell is the wait-free register (after
//! Ianni, Pellegrini and Quaglia, "A Wait-free Multi-word Atomic (1,N) Register", 2017), and one with more cells a
//! queue with history. The pool has a slot for every value kept, one to work in, and one for each pin that a reader
//! may hold, so the writer's bounded search always finds one.

mod latest;
mod pool;
mod queue;
mod writer;

use std::ops::DerefMut;
use std::sync::{Arc, PoisonError};

pub use latest::Latest;
pub use pool::Loan;
pub use queue::{Evicted, Policy, QueueReader, Start};
pub use writer::{Blocked, Draft, SetAside, Writer};

use crate::Shape;
use crate::sync::{AtomicU32, AtomicU64, Mutex, Ordering, order};
use pool::{NO_SLOT, Pool};
use writer::Ledger;

/// How many readers a channel serves. What they may pin decides how many slots there can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Readers of the newest value.
    pub latest: u16,
    /// Readers of every value.
    pub queues: u16,
    /// How many values a reader of every value may hold at once.
    pub window: u16,
}

/// No handle is left for another reader, or no slot for what it may pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no reader handle is left of {limit}")]
pub struct BudgetSpent {
    /// How many the budget has.
    pub limit: u16,
}

/// The property has a writer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is a writer already, of generation {generation}")]
pub struct WriterTaken {
    /// Which one.
    pub generation: u64,
}

/// The values of one property.
#[derive(Debug)]
pub struct Channel {
    shape: Shape,
    budget: Budget,
    /// The cells, and beside the first one how many values were published.
    ring: Box<[Cell]>,
    pool: Pool,
    /// `generation << 1 | alive`.
    writer: AtomicU64,
    /// How far readers are that the writer must not overtake; `IDLE` for the others.
    cursors: Box<[AtomicU64]>,
    blockers: AtomicU32,
    /// Handles given out, and what a writer leaves to the next. Not used on the way of a value.
    desk: Mutex<Desk>,
}

/// What handles are given out.
#[derive(Debug)]
struct Desk {
    latest: u16,
    queues: Box<[bool]>,
    /// Nothing while a writer has it.
    ledger: Option<Ledger>,
}

/// A place of the ring, in a cache line of its own: readers write to it.
#[derive(Debug)]
#[repr(align(64))]
struct Cell {
    word: AtomicU64,
    /// How many values were published; only that of the first cell is used.
    tail: AtomicU64,
}

/// The cursor of a reader that holds nobody up.
const IDLE: u64 = u64::MAX;

/// Leaves half of the slots that an index can name to readers.
const MAXIMUM_DEPTH: usize = 32_768;

impl Channel {
    /// A channel that keeps the last `depth` values: at least 1, and at most 32 768.
    pub fn new(shape: Shape, depth: usize, budget: Budget) -> Arc<Self> {
        let depth = depth.clamp(1, MAXIMUM_DEPTH);
        let cell = || Cell { word: AtomicU64::new(pool::word(NO_SLOT)), tail: AtomicU64::new(0) };
        // A budget beyond what an index can name is met by refusing the handles that don't fit.
        let slots = slots(depth, budget, budget.latest.into(), budget.queues.into()).min(NO_SLOT.into());
        let desk = Desk {
            latest: 0,
            queues: vec![false; budget.queues.into()].into(),
            ledger: Some(Ledger::new(slots)),
        };
        let pool = Pool::new(shape, slots);
        pool.provide(depth + 1);
        Arc::new(Self {
            shape,
            budget,
            ring: (0..depth).map(|_| cell()).collect(),
            pool,
            writer: AtomicU64::new(0),
            cursors: (0..budget.queues).map(|_| AtomicU64::new(IDLE)).collect(),
            blockers: AtomicU32::new(0),
            desk: Mutex::new(desk),
        })
    }

    /// The memory of a value.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// How many values are kept.
    pub fn depth(&self) -> usize {
        self.ring.len()
    }

    /// How many values were published.
    #[inline]
    pub fn published(&self) -> u64 {
        self.ring[0].tail.load(order::ACQUIRE)
    }

    /// Counts the writers that the channel has had.
    pub fn generation(&self) -> u64 {
        self.writer.load(Ordering::Acquire) >> 1
    }

    /// Whether it has a writer now.
    pub fn has_writer(&self) -> bool {
        self.writer.load(Ordering::Acquire) & 1 == 1
    }

    /// The writer, with a new generation.
    ///
    /// # Errors
    /// When there is one.
    pub fn writer(self: &Arc<Self>) -> Result<Writer, WriterTaken> {
        Writer::new(self)
    }

    /// A reader of the newest value; it may come before the writer.
    ///
    /// # Errors
    /// When the budget is spent.
    pub fn latest(self: &Arc<Self>) -> Result<Latest, BudgetSpent> {
        let mut desk = self.desk();
        if desk.latest == self.budget.latest || !self.provide(&desk, 1, 0) {
            return Err(BudgetSpent { limit: self.budget.latest });
        }
        desk.latest += 1;
        Ok(Latest::new(Arc::clone(self)))
    }

    /// A reader of every value; it may come before the writer. One that blocks does so from the first write on that
    /// begins after this.
    ///
    /// # Errors
    /// When the budget is spent.
    pub fn queue(self: &Arc<Self>, policy: Policy, start: Start) -> Result<QueueReader, BudgetSpent> {
        let mut desk = self.desk();
        let spent = BudgetSpent { limit: self.budget.queues };
        let place = desk.queues.iter().position(|taken| !taken).ok_or(spent)?;
        if !self.provide(&desk, 0, 1) {
            return Err(spent);
        }
        desk.queues[place] = true;
        Ok(QueueReader::new(Arc::clone(self), place, policy, start))
    }

    fn desk(&self) -> impl DerefMut<Target = Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes the slots for the handles given out and these more; false when there can't be so many.
    fn provide(&self, desk: &Desk, latest: usize, queues: usize) -> bool {
        let latest = usize::from(desk.latest) + latest;
        let queues = desk.queues.iter().filter(|taken| **taken).count() + queues;
        let slots = slots(self.ring.len(), self.budget, latest, queues);
        let possible = slots <= self.pool.limit();
        if possible {
            self.pool.provide(slots);
        }
        possible
    }

    #[inline]
    fn cell(&self, sequence: u64) -> &AtomicU64 {
        let place = if self.ring.len() == 1 { 0 } else { ((sequence - 1) % self.ring.len() as u64) as usize };
        &self.ring[place].word
    }
}

/// The slots for the values kept, one to work in, and every pin that so many readers may hold: a reader of the newest
/// value that one and a candidate, a reader of every value its window and one that turns out to be too new.
fn slots(depth: usize, budget: Budget, latest: usize, queues: usize) -> usize {
    depth + 1 + 2 * latest + (usize::from(budget.window) + 1) * queues
}
