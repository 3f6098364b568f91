//! The properties that are recorded.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use slate_blackboard::channel::Tap;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::{Access, Property, Stamp};

use super::lines::Hub;
use crate::ros;

/// A property that is recorded.
#[derive(Clone, Debug)]
pub(crate) struct Channel {
    /// Its path, without a leading slash.
    pub path: String,
    pub descriptor: &'static Descriptor,
    pub access: Access,
    /// Values that could not be handed over.
    pub dropped: Arc<AtomicU64>,
    /// Whether anybody wants values.
    pub wanted: Arc<AtomicBool>,
}

impl Channel {
    pub fn of(property: &Property) -> Self {
        Self {
            path: property.path().into(),
            descriptor: property.descriptor(),
            access: property.access(),
            dropped: Arc::default(),
            wanted: Arc::default(),
        }
    }

    /// Appends a value as a message.
    pub fn encode(&self, items: usize, bytes: &[u8], out: &mut Vec<u8>) -> Result<(), ros::Error> {
        let descriptor = self.descriptor;
        // Behind the last item there may be bytes that only fill up.
        let tail = descriptor.tail().map_or(0, |kind| kind.size() * items);
        ros::encode(descriptor, bytes.get(..descriptor.size + tail).unwrap_or(bytes), out)
    }

    /// Whether a run of the same configuration and seed in lockstep writes the same values; what is measured on the wall
    /// clock differs, and so does what depends on who looks on.
    pub fn repeats(&self) -> bool {
        let name = self.path.rsplit('/').next().unwrap_or_default();
        let is_host = ["agents", "peers", "team", "loop", "log", "record"]
            .iter()
            .any(|root| self.path.split('/').next() == Some(root));
        !is_host && !["timing", "histogram", "process"].contains(&name)
    }
}

/// Hands the values of one property over.
pub(super) struct PropertyTap {
    pub hub: Arc<Hub>,
    pub id: u32,
    pub dropped: Arc<AtomicU64>,
    pub wanted: Arc<AtomicBool>,
}

impl Tap for PropertyTap {
    fn wrote(&self, bytes: &[u8], items: usize, stamp: Stamp) {
        if self.wanted.load(Ordering::Relaxed)
            && !self.hub.push(self.id, items as u32, stamp.sequence, stamp.time, bytes)
        {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}
