use std::sync::Arc;

use super::Channel;
use super::pool::SlotPin;
use crate::sync::{Ordering, order};

/// Draft that a late step may still write to.
/// Dropping this says that it no longer does.
#[derive(Debug)]
pub struct SetAside {
    channel: Arc<Channel>,
    held: SlotPin,
}

impl SetAside {
    /// Creates the handle of a draft that the writer has pinned.
    /// The channel must not have another draft set aside.
    pub(super) fn new(channel: Arc<Channel>, held: SlotPin) -> Self {
        channel.aside.store(1, Ordering::Relaxed);
        Self { channel, held }
    }
}

impl Drop for SetAside {
    fn drop(&mut self) {
        self.held.give_back();
        // A thread that reads this also sees the returned pin.
        self.channel.aside.store(0, order::RELEASE);
    }
}
