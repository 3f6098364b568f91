//! Snapshot of a channel's values, and their restoration into another channel.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::queue::oldest;
use super::{Channel, LinkError, Writer, has_value, slots};
use crate::{Shape, Stamp, bytes};

/// Kept values of a channel, and their writers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChannelSnapshot {
    /// Number of writers that the channel has had.
    pub generation: u64,
    /// Oldest first, without a gap.
    pub values: Vec<StampedValue>,
}

/// A value with its stamp.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StampedValue {
    /// The value.
    #[serde(with = "bytes")]
    pub bytes: Vec<u8>,
    /// Number of items in the tail.
    pub items: usize,
    /// Time and writer of the value.
    pub stamp: Stamp,
}

/// Error of a saved value that does not fit the channel.
/// The channel has no room for it, it has another size than its interface, or it is not the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "value {sequence}, of {bytes} bytes and {items} items in its tail, does not fit: there is room for {capacity} items"
)]
pub struct ValueMismatch {
    /// Number of the value.
    pub sequence: u64,
    /// Size of the value, bytes.
    pub bytes: usize,
    /// The items of its tail.
    pub items: usize,
    /// Capacity of the channel, items.
    pub capacity: usize,
}

impl ChannelSnapshot {
    /// Returns the number of values published until the snapshot.
    pub fn published(&self) -> u64 {
        self.values.last().map_or(0, |value| value.stamp.sequence)
    }

    /// Checks that a channel of that shape can continue with these values.
    ///
    /// # Errors
    /// The first value that it has no room for.
    pub fn fits(&self, shape: Shape) -> Result<(), ValueMismatch> {
        let mut before = None;
        for value in &self.values {
            let sequence = value.stamp.sequence;
            let follows = sequence > 0 && before.is_none_or(|before| sequence - 1 == before);
            if !follows || value.items > shape.capacity || value.bytes.len() != shape.bytes(value.items) {
                let (bytes, items, capacity) = (value.bytes.len(), value.items, shape.capacity);
                return Err(ValueMismatch { sequence, bytes, items, capacity });
            }
            before = Some(sequence);
        }
        Ok(())
    }
}

impl Channel {
    /// Copies the kept values, while writer and readers continue.
    ///
    /// # Errors
    /// When there is no slot for what this pins meanwhile.
    pub fn snapshot(&self) -> Result<ChannelSnapshot, LinkError> {
        // No other handle is given out meanwhile, so the one pin more is counted.
        let handles = self.handles();
        if let Some(deeper) = handles.deeper.clone() {
            drop(handles);
            return deeper.snapshot();
        }
        let readers = (usize::from(handles.latest), handles.queues_in_use());
        let count = slots(self.ring.len(), self.budget, readers.0, readers.1) + 1;
        if count > self.pool.limit() || !self.pool.provide(count) {
            return Err(LinkError::OutOfMemory { bytes: self.pool.slot_size() });
        }
        let tail = self.published();
        let mut found = BTreeMap::new();
        for sequence in oldest(tail, self.ring.len() as u64)..=tail {
            let cell = self.cell(sequence);
            if !has_value(cell) {
                continue;
            }
            let held = self.pool.pin(cell);
            // SAFETY: the pin is given back after the copy.
            let loan = unsafe { held.lend() };
            let (bytes, items, stamp) = (loan.bytes().to_vec(), loan.items(), loan.stamp());
            held.give_back();
            // The writer may have come round; a value older than the cell stands for one that was lost.
            if stamp.sequence >= sequence {
                found.insert(stamp.sequence, StampedValue { bytes, items, stamp });
            }
        }
        drop(handles);
        let mut values: Vec<StampedValue> = Vec::new();
        for value in found.into_values().rev() {
            if values.last().is_none_or(|next| next.stamp.sequence == value.stamp.sequence + 1) {
                values.push(value);
            }
        }
        values.reverse();
        Ok(ChannelSnapshot { generation: self.generation(), values })
    }

    /// Restores saved values into a channel without a writer.
    /// Readers must [resume](super::Latest::resume) too.
    ///
    /// # Errors
    /// When it has a writer, whose [`restore`](Writer::restore) it is then, or no memory for one.
    pub fn restore(
        self: &Arc<Self>,
        saved: &ChannelSnapshot,
    ) -> Result<Result<(), ValueMismatch>, LinkError> {
        Ok(self.writer()?.restore(saved))
    }
}

impl Writer {
    /// Restores saved values, as the writer that wrote them: with its generation.
    /// The values keep their stamps. A reader that does not [resume](super::Latest::resume) at one of these values sees
    /// nothing new until as many more were written as it has seen.
    ///
    /// # Errors
    /// When a value does not fit; nothing is changed then.
    pub fn restore(&mut self, saved: &ChannelSnapshot) -> Result<(), ValueMismatch> {
        saved.fits(self.shape())?;
        if let Some(deeper) = &mut self.deeper {
            deeper.restore(saved)?;
        }
        self.set_generation(saved.generation);
        let Some((first, tail)) = saved.values.first().zip(saved.values.last()) else {
            self.clear();
            return Ok(());
        };
        let tail = tail.stamp.sequence;
        for sequence in oldest(tail, self.depth() as u64)..=tail {
            // Where the queue was shorter, an older value says that the right one was lost.
            let place = sequence.checked_sub(first.stamp.sequence).map_or(0, |place| place as usize);
            let value = saved.values.get(place).unwrap_or(first);
            self.place(&value.bytes, value.items, value.stamp, sequence);
        }
        Ok(())
    }
}
