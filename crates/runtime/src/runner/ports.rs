use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use slate_blackboard::channel::{QueueReader, SetAside, Writer};
use slate_blackboard::interface::FloatMap;
use slate_blackboard::message::{Receiver, Sender};
use slate_blackboard::wake::Wake;
use slate_blackboard::{Property, Shape};
use slate_module::Entry;

use super::Health;
use crate::actuators::Actuator;
use crate::link::Filter;

/// Memory for values of any interface.
#[derive(Debug)]
pub(crate) struct Memory(Box<[u128]>);

impl Memory {
    /// All zeros.
    pub fn zeroed(bytes: usize) -> Self {
        Self(vec![0; bytes.div_ceil(16).max(1)].into_boxed_slice())
    }

    pub fn as_ptr(&self) -> *const u8 {
        self.0.as_ptr().cast()
    }

    pub fn as_mut_ptr(&mut self) -> *mut u8 {
        self.0.as_mut_ptr().cast()
    }

    /// As [`bytes_mut`](Memory::bytes_mut), to be read.
    pub fn bytes(&self, count: usize) -> &[u8] {
        let count = count.min(size_of_val(&*self.0));
        // SAFETY: the memory is initialised and has so many bytes.
        unsafe { std::slice::from_raw_parts(self.as_ptr(), count) }
    }

    /// The first `count` bytes; as many as there are, if there are fewer.
    pub fn bytes_mut(&mut self, count: usize) -> &mut [u8] {
        let count = count.min(size_of_val(&*self.0));
        // SAFETY: the memory is initialised and has so many bytes.
        unsafe { std::slice::from_raw_parts_mut(self.as_mut_ptr(), count) }
    }
}

/// An input; its reader stands at the same index in `Runner::readers`.
pub(crate) struct InputPort {
    pub slot: usize,
    pub stale_after: Option<u64>,
    pub triggers: bool,
    /// The module that writes it, if one does.
    pub writer: Option<Arc<Health>>,
    /// Sequence and generation of the value that the last tick saw.
    pub seen: (u64, u64),
    pub missed: u64,
}

/// How a queue input keeps up; others may look at any time.
#[derive(Debug, Default)]
pub(crate) struct QueueGauge {
    /// Values that waited when the last step had taken its own.
    pub lag: AtomicU64,
    /// Values that it never saw.
    pub lost: AtomicU64,
}

/// A queue input.
pub(crate) struct QueuePort {
    pub slot: usize,
    pub triggers: bool,
    pub reader: QueueReader,
    pub entries: Vec<Entry>,
    /// Which values it gets, if not all.
    pub filter: Option<Arc<Filter>>,
    /// Whether its values are taken when a cycle begins, and not before the step.
    pub is_early: bool,
    pub gauge: Arc<QueueGauge>,
}

/// An inbox.
pub(crate) struct InboxPort {
    pub slot: usize,
    pub triggers: bool,
    pub receiver: Receiver,
    pub entries: Vec<Entry>,
}

/// An output.
pub(crate) struct OutputPort {
    pub slot: usize,
    pub property: Arc<Property>,
    /// The memory of a value.
    pub shape: Shape,
    /// The place of the property in the order of all, for the digest.
    pub index: u32,
    pub writer: Writer,
    pub floats: FloatMap,
    /// Computed only while somebody watches, and outside the digest.
    pub debug: bool,
    pub safe: Option<Box<[u8]>>,
    /// The gate that a command passes, and as whom.
    pub actuator: Option<(Arc<Actuator>, u32)>,
    pub wakes: Vec<Arc<Wake>>,
    /// The slot that a late step may still write to.
    pub aside: Option<SetAside>,
}

/// An outbox.
pub(crate) struct OutboxPort {
    pub slot: usize,
    pub sender: Option<Sender>,
    pub memory: Vec<Memory>,
    pub entries: Vec<Entry>,
    pub size: usize,
    pub index: u32,
    pub wake: Option<Arc<Wake>>,
    pub refused: u64,
}
