//! Values of one property: a pool of slots, and a ring of cells.
//! The cells say which slots hold the last values.
//!
//! A cell is one word, `slot:16 | readers:48`. A reader adds one to it and learns in the same instruction which slot
//! it has pinned; the writer exchanges the word and learns how many readers pinned the slot that it took out. A slot
//! is free again when as many readers have given it back. So a channel with one cell is the wait-free register (after
//! Ianni, Pellegrini and Quaglia, "A Wait-free Multi-word Atomic (1,N) Register", 2017), and one with more cells a
//! queue with history. The pool has a slot for every value kept, one to work in, one that a late step may still write
//! to, and one for each pin that a reader may hold, so the writer's bounded search always finds one.
//!
//! The state shared by readers and the writer is in private memory, and only the bytes of values may be elsewhere
//! ([`ValueMemory`]). So a process that maps them too, and runs a module over values that the host pinned and drafts
//! that the host publishes, can spoil only its own outputs. A value may also be published in place ([`LentBytes`]):
//! then its slot names other bytes than its own, until no reader sees them any more.
//!
//! A pin costs two locked instructions, and the writer a search. If reader and writer are steps of one loop, which are
//! never at work at a time, the loop can declare it ([`Writer::set_in_turn`]), and its readers look at the newest value
//! without a pin ([`Latest::refresh_in_turn`]). All others still pin.

mod aside;
mod deeper;
mod error;
mod latest;
mod ledger;
mod lent;
mod lines;
mod link;
mod memory;
mod pool;
mod queue;
mod snapshot;
mod writer;

use std::ops::DerefMut;
use std::sync::{Arc, PoisonError};

pub use crate::message::Tap;
pub use aside::SetAside;
pub use error::{AdoptError, Blocked, LinkError};
pub use latest::Latest;
pub use lent::LentBytes;
pub(crate) use link::HandleChange;
pub use memory::ValueMemory;
pub use pool::Loan;
pub use queue::{Cursor, Evicted, Policy, QueueReader, Start};
pub use snapshot::{ChannelSnapshot, StampedValue, ValueMismatch};
pub use writer::{Draft, Writer};

use crate::Shape;
use crate::message::TapCell;
use crate::sync::{AtomicU32, AtomicU64, Mutex, Ordering, order};
use ledger::Ledger;
use lines::ENTRIES_PER_LINE;
use link::Hook;
use memory::SlotMemory;
use pool::{NO_SLOT, Pool};

/// Number of readers that a channel serves.
/// Their pins decide the maximum number of slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Readers of the newest value.
    pub latest: u16,
    /// Readers of every value.
    pub queues: u16,
    /// Maximum number of values that a reader of every value holds at once.
    pub window: u16,
}

/// The values of one property.
///
/// In this order, so that what every write and read looks at is in one cache line.
#[derive(Debug)]
#[repr(C, align(64))]
pub struct Channel {
    /// Cells; the first one also has the number of published values.
    ring: Box<[Cell]>,
    blockers: AtomicU32,
    /// 1 while a draft is set aside.
    aside: AtomicU32,
    /// Observer of every value.
    tap: TapCell,
    pool: Pool,
    shape: Shape,
    budget: Budget,
    /// `generation << 1 | alive`.
    writer: AtomicU64,
    /// Positions of readers that hold up the writer; `IDLE_CURSOR` for the others.
    cursors: Box<[AtomicU64]>,
    /// Callback for handles that come and go.
    hook: Hook,
    /// Handles given out, and the state that a writer leaves to the next.
    /// Not used for writing or reading a value.
    handles: Mutex<ChannelHandles>,
}

/// Handles given out.
#[derive(Debug)]
struct ChannelHandles {
    latest: u16,
    /// Number of these that are not counted, because they belong to tools.
    probes: u16,
    queues: Box<[bool]>,
    /// Ledger; `None` while a writer has it.
    ledger: Option<Ledger>,
    /// Channel that gets the same values and keeps more of them.
    deeper: Option<Arc<Channel>>,
}

/// Cell of the ring, in a cache line of its own, because readers write to it.
#[derive(Debug)]
#[repr(align(64))]
struct Cell {
    word: AtomicU64,
    /// Number of published values; only that of the first cell is used.
    tail: AtomicU64,
    /// 1 while the writer takes turns with its readers; as above.
    in_turn: AtomicU32,
}

/// Returns true if a value was ever put into a cell.
#[inline]
fn has_value(cell: &AtomicU64) -> bool {
    pool::slot_of(cell.load(order::ACQUIRE)) != NO_SLOT
}

/// Cursor of a reader that does not hold up the writer.
const IDLE_CURSOR: u64 = u64::MAX;

/// Leaves half of the slots that an index can name to readers.
const MAXIMUM_DEPTH: usize = 32_768;

impl Channel {
    /// Creates a channel that keeps the last `depth` values: 1 to 32 768.
    pub fn new(shape: Shape, depth: usize, budget: Budget) -> Arc<Self> {
        Self::new_in(shape, depth, budget, None)
    }

    /// Creates a channel as [`new`](Channel::new), with its values in `memory`.
    /// Memory is allocated when handles are linked, so it may turn out to be exhausted then.
    pub fn new_in(
        shape: Shape,
        depth: usize,
        budget: Budget,
        memory: Option<Arc<dyn ValueMemory>>,
    ) -> Arc<Self> {
        let depth = depth.clamp(1, MAXIMUM_DEPTH);
        let cell = || Cell {
            word: AtomicU64::new(pool::word(NO_SLOT)),
            tail: AtomicU64::new(0),
            in_turn: AtomicU32::new(0),
        };
        // A budget beyond what an index can name is met by refusing the handles that don't fit. One more for a snapshot.
        let limit = slots(depth, budget, budget.latest.into(), budget.queues.into()) + 1;
        let limit = limit.min(NO_SLOT.into());
        // Most channels have few readers: what these need is made at once, and looked up first.
        let queues = if depth > 1 { budget.queues.min(1) } else { 0 };
        let near = slots(depth, budget, budget.latest.min(2).into(), queues.into());
        let near = near.next_multiple_of(ENTRIES_PER_LINE).min(limit);
        let handles = ChannelHandles {
            latest: 0,
            probes: 0,
            queues: vec![false; budget.queues.into()].into(),
            ledger: Some(Ledger::new(near)),
            deeper: None,
        };
        let memory = memory.map_or(SlotMemory::Heap, SlotMemory::Given);
        Arc::new(Self {
            shape,
            budget,
            ring: (0..depth).map(|_| cell()).collect(),
            pool: Pool::new(shape, near, limit, memory),
            writer: AtomicU64::new(0),
            cursors: (0..budget.queues).map(|_| AtomicU64::new(IDLE_CURSOR)).collect(),
            blockers: AtomicU32::new(0),
            aside: AtomicU32::new(0),
            tap: TapCell::default(),
            hook: Hook::default(),
            handles: Mutex::new(handles),
        })
    }

    /// Returns the memory layout of a value.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Returns the number of kept values.
    pub fn depth(&self) -> usize {
        let deeper = self.handles().deeper.clone();
        deeper.map_or(self.ring.len(), |deeper| deeper.depth())
    }

    /// Returns the number of readers served.
    pub fn budget(&self) -> Budget {
        self.budget
    }

    /// Returns the number of published values.
    #[inline]
    pub fn published(&self) -> u64 {
        self.ring[0].tail.load(order::ACQUIRE)
    }

    /// Counts the writers that the channel has had.
    pub fn generation(&self) -> u64 {
        self.writer.load(Ordering::Acquire) >> 1
    }

    /// Returns true if the channel has a writer now.
    pub fn has_writer(&self) -> bool {
        self.writer.load(Ordering::Acquire) & 1 == 1
    }

    /// Returns the number of reader handles given out.
    pub fn readers(&self) -> usize {
        let handles = self.handles();
        let deeper = handles.deeper.as_ref().map_or(0, |deeper| deeper.readers());
        usize::from(handles.latest - handles.probes) + handles.queues_in_use() + deeper
    }

    /// Returns true if this channel itself has a reader.
    fn has_readers(&self) -> bool {
        let handles = self.handles();
        handles.latest > 0 || handles.queues_in_use() > 0
    }

    /// Creates the writer, with a new generation.
    ///
    /// # Errors
    /// When there is one, or no memory is left for values.
    pub fn writer(self: &Arc<Self>) -> Result<Writer, LinkError> {
        let writer = Writer::new(self)?;
        self.hook.call(HandleChange::WriterCame(writer.generation()));
        Ok(writer)
    }

    /// Creates a reader of the newest value; it may come before the writer.
    ///
    /// # Errors
    /// When the budget is spent, or no memory is left for what it may pin.
    pub fn latest(self: &Arc<Self>) -> Result<Latest, LinkError> {
        let reader = self.new_latest(false)?;
        self.hook.call(HandleChange::ReaderCame);
        Ok(reader)
    }

    /// Creates a reader as [`latest`](Channel::latest) for tools: it is not counted.
    /// It causes no event either.
    pub(crate) fn probe(self: &Arc<Self>) -> Result<Latest, LinkError> {
        self.new_latest(true)
    }

    fn new_latest(self: &Arc<Self>, probe: bool) -> Result<Latest, LinkError> {
        let mut handles = self.handles();
        let spent = LinkError::BudgetSpent { limit: self.budget.latest };
        if handles.latest == self.budget.latest {
            return Err(spent);
        }
        self.provide(&handles, 1, 0, spent)?;
        handles.latest += 1;
        handles.probes += u16::from(probe);
        Ok(Latest::new(Arc::clone(self), probe))
    }

    /// Creates a reader of every value; it may come before the writer.
    /// A blocking one blocks from the first write on that begins after this.
    ///
    /// # Errors
    /// When the budget is spent, or no memory is left for what it may pin.
    pub fn queue(self: &Arc<Self>, policy: Policy, start: Start) -> Result<QueueReader, LinkError> {
        let mut handles = self.handles();
        // One that holds the writer up stands where that looks.
        while policy != Policy::Block
            && let Some(deeper) = handles.deeper.clone()
        {
            drop(handles);
            let reader = deeper.queue(policy, start);
            let is_written = self.handles().deeper.as_ref().is_some_and(|own| Arc::ptr_eq(own, &deeper));
            if is_written || reader.is_err() {
                return reader;
            }
            // A still deeper one has taken its place before there was a reader.
            drop(reader);
            handles = self.handles();
        }
        let spent = LinkError::BudgetSpent { limit: self.budget.queues };
        let index = handles.queues.iter().position(|taken| !taken).ok_or(spent)?;
        self.provide(&handles, 0, 1, spent)?;
        handles.queues[index] = true;
        let reader = QueueReader::new(Arc::clone(self), index, policy, start);
        drop(handles);
        self.hook.call(HandleChange::ReaderCame);
        Ok(reader)
    }

    /// Lets `tap` see every value that is written from now on.
    /// Only the first call has an effect.
    pub fn set_tap(&self, tap: Arc<dyn Tap>) {
        self.tap.set(tap);
    }

    /// Calls `hook` whenever a handle comes or goes, from now on.
    /// It runs in the thread that made or dropped the handle, with no lock of the channel held. Only the first hook
    /// counts.
    pub(crate) fn set_hook(&self, hook: impl Fn(HandleChange) + Send + Sync + 'static) {
        self.hook.set(hook);
    }

    fn handles(&self) -> impl DerefMut<Target = ChannelHandles> {
        self.handles.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Creates the slots for the handles given out and for additional ones.
    /// Their maximum is the range of an index: beyond it the budget is `spent`.
    fn provide(
        &self,
        handles: &ChannelHandles,
        latest: usize,
        queues: usize,
        spent: LinkError,
    ) -> Result<(), LinkError> {
        let latest = usize::from(handles.latest) + latest;
        let queues = handles.queues_in_use() + queues;
        let slots = slots(self.ring.len(), self.budget, latest, queues);
        if slots > self.pool.limit() {
            return Err(spent);
        }
        if !self.pool.provide(slots) {
            return Err(LinkError::OutOfMemory { bytes: self.pool.slot_size() });
        }
        Ok(())
    }

    #[inline]
    fn cell(&self, sequence: u64) -> &AtomicU64 {
        let index = if self.ring.len() == 1 { 0 } else { ((sequence - 1) % self.ring.len() as u64) as usize };
        &self.ring[index].word
    }
}

impl ChannelHandles {
    fn queues_in_use(&self) -> usize {
        self.queues.iter().filter(|taken| **taken).count()
    }
}

/// Returns the number of slots for a number of readers.
/// These are the kept values, one to work in, one set aside, and every pin that so many readers may hold: a reader of
/// the newest value that one and a candidate, a reader of every value its window and one that turns out to be too new.
fn slots(depth: usize, budget: Budget, latest: usize, queues: usize) -> usize {
    depth + 2 + 2 * latest + (usize::from(budget.window) + 1) * queues
}
