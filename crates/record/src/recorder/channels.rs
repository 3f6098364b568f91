//! The properties that are recorded.

use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, PoisonError};

use slate_blackboard::interface::Descriptor;
use slate_blackboard::message::Mailbox;
use slate_blackboard::{Access, Carrier, Property, Watch, Watchers};

use slate_ros_messages as ros;

/// A property that is recorded.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Path, without a leading slash.
    pub path: String,
    /// Type of its values.
    pub descriptor: &'static Descriptor,
    /// Rights to write it.
    pub access: Access,
    /// The bytes of the largest value.
    pub largest: usize,
    /// Number of values that could not be handed over.
    pub dropped: Arc<AtomicU64>,
    /// Set if any recording wants the values of the property.
    pub wanted: Arc<AtomicBool>,
    /// Recordings watch the property: else debug outputs have no values.
    watchers: Watchers,
    watch: Arc<Mutex<Option<Watch>>>,
    repeats: bool,
    /// The mailbox, which knows its senders, if it is one.
    mailbox: Option<Arc<Mailbox>>,
}

impl Channel {
    /// The channel of a property.
    pub fn of(property: &Property) -> Self {
        let (shape, mailbox) = match property.carrier() {
            Carrier::Channel(channel) => (channel.shape(), None),
            Carrier::Mailbox(mailbox) => (mailbox.shape(), Some(Arc::clone(mailbox))),
        };
        Self {
            path: property.path().into(),
            descriptor: property.descriptor(),
            access: property.access(),
            largest: shape.bytes(shape.capacity),
            dropped: Arc::default(),
            wanted: Arc::default(),
            watchers: property.watchers(),
            watch: Arc::default(),
            repeats: repeats(property.path()),
            mailbox,
        }
    }

    /// Returns the path of a mailbox's sender, if it is a module's.
    pub fn sender_name(&self, sender: u32) -> Option<String> {
        Some(self.mailbox.as_ref()?.sender_name(sender)).filter(|name| !name.is_empty())
    }

    /// Watches the property, or no longer.
    pub fn watch(&self, watches: bool) {
        let mut watch = self.watch.lock().unwrap_or_else(PoisonError::into_inner);
        if watches != watch.is_some() {
            *watch = watches.then(|| self.watchers.watch());
        }
    }

    /// Returns the time and the sender of a message to a mailbox; `None` for a value.
    pub fn sent(&self, bytes: &[u8]) -> Option<Sent> {
        let head = bytes.first_chunk().filter(|_| self.access == Access::Messages)?;
        Some(Sent::from_bytes(*head))
    }

    /// Appends a value, or a message to a mailbox, as a message.
    pub fn encode(&self, items: usize, bytes: &[u8], out: &mut Vec<u8>) -> Result<(), ros::Error> {
        ros::encode(self.descriptor, self.value(items, bytes), out)
    }

    /// Returns the value itself, or that of a message to a mailbox.
    pub fn value<'a>(&self, items: usize, bytes: &'a [u8]) -> &'a [u8] {
        let bytes = if self.access == Access::Messages {
            bytes.get(SENT_HEAD_SIZE..).unwrap_or_default()
        } else {
            bytes
        };
        // Behind the last item there may be bytes that only fill up.
        let tail = self.descriptor.tail().map_or(0, |kind| kind.size() * items);
        bytes.get(..self.descriptor.size + tail).unwrap_or(bytes)
    }

    /// Returns true if lockstep runs of equal configuration and seed repeat the values.
    /// Measurements on the wall clock differ, and so do values that depend on observers.
    pub fn repeats(&self) -> bool {
        self.repeats
    }
}

/// Returns true if the property at a path repeats its values.
pub fn repeats(path: &str) -> bool {
    let name = path.rsplit('/').next().unwrap_or_default();
    let is_host = ["agents", "peers", "team", "loop", "log", "record"]
        .iter()
        .any(|root| path.split('/').next() == Some(root));
    !is_host && !["timing", "histogram", "process"].contains(&name)
}

/// Header of a message to a mailbox.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    /// The agent's time, nanoseconds.
    pub time: u64,
    pub sender: u32,
}

/// Size of a message's sender and time, bytes.
const SENT_HEAD_SIZE: usize = 12;

impl Sent {
    pub fn to_bytes(self) -> [u8; SENT_HEAD_SIZE] {
        let mut bytes = [0; SENT_HEAD_SIZE];
        bytes[..8].copy_from_slice(&self.time.to_le_bytes());
        bytes[8..].copy_from_slice(&self.sender.to_le_bytes());
        bytes
    }

    fn from_bytes(bytes: [u8; SENT_HEAD_SIZE]) -> Self {
        let number = u128::from_le_bytes(std::array::from_fn(|at| bytes.get(at).copied().unwrap_or(0)));
        Self { time: number as u64, sender: (number >> 64) as u32 }
    }
}
