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

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

pub use latest::Latest;
pub use pool::Loan;
pub use queue::{Evicted, Policy, QueueReader, Start};
pub use writer::{Blocked, Draft, SetAside, Writer};

use crate::Shape;
use crate::sync::{AtomicU32, AtomicU64, Ordering, order};
use pool::{NO_SLOT, Pool};
use writer::Desk;

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

/// No handle is left for another reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("all {limit} reader handles are taken")]
pub struct BudgetSpent {
    /// How many there are.
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

impl Channel {
    /// A channel that keeps the last `depth` values (at least 1).
    pub fn new(shape: Shape, depth: usize, budget: Budget) -> Arc<Self> {
        let depth = depth.max(1);
        let cell = || Cell { word: AtomicU64::new(pool::word(NO_SLOT)), tail: AtomicU64::new(0) };
        let pins =
            2 * usize::from(budget.latest) + (usize::from(budget.window) + 1) * usize::from(budget.queues);
        let pool = Pool::new(shape, depth + 1 + pins + writer::SPARE_SLOTS);
        pool.provide(depth + 1);
        let limit = depth + 1 + pins + writer::SPARE_SLOTS;
        Arc::new(Self {
            shape,
            budget,
            ring: (0..depth).map(|_| cell()).collect(),
            pool,
            writer: AtomicU64::new(0),
            cursors: (0..budget.queues).map(|_| AtomicU64::new(IDLE)).collect(),
            blockers: AtomicU32::new(0),
            desk: Mutex::new(Desk::new(depth, limit)),
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
        if desk.latest == self.budget.latest {
            return Err(BudgetSpent { limit: self.budget.latest });
        }
        desk.latest += 1;
        self.provide(&mut desk);
        Ok(Latest::new(Arc::clone(self)))
    }

    /// A reader of every value; it may come before the writer.
    ///
    /// # Errors
    /// When the budget is spent.
    pub fn queue(self: &Arc<Self>, policy: Policy, start: Start) -> Result<QueueReader, BudgetSpent> {
        let mut desk = self.desk();
        let Some(place) = desk.queues.iter().position(|taken| !taken).or_else(|| {
            let more = desk.queues.len() < usize::from(self.budget.queues);
            more.then(|| {
                desk.queues.push(false);
                desk.queues.len() - 1
            })
        }) else {
            return Err(BudgetSpent { limit: self.budget.queues });
        };
        desk.queues[place] = true;
        self.provide(&mut desk);
        Ok(QueueReader::new(Arc::clone(self), place, policy, start))
    }

    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes the slots that the handles given out may pin.
    fn provide(&self, desk: &mut Desk) {
        let queues = desk.queues.iter().filter(|taken| **taken).count();
        let pins = 2 * usize::from(desk.latest) + (usize::from(self.budget.window) + 1) * queues;
        self.pool.provide(self.ring.len() + 1 + pins + desk.asides);
    }

    #[inline]
    fn cell(&self, sequence: u64) -> &AtomicU64 {
        let place = if self.ring.len() == 1 { 0 } else { ((sequence - 1) % self.ring.len() as u64) as usize };
        &self.ring[place].word
    }
}
