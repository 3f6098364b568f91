//! Flow of values from properties to topics.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::UNIX_EPOCH;

use slate_blackboard::interface::{Descriptor, Kind};
use slate_blackboard::{Property, Watching};
use slate_runtime::Composer;

use crate::status::TopicStatus;

/// Newest value of a property.
#[derive(Debug)]
pub struct OutboundValue {
    /// Value as it lies in memory, with its tail.
    pub bytes: Vec<u8>,
    /// Time of the write, ns: of the simulation in lockstep, else the date.
    pub time: u64,
}

/// Topic that has the values of a property.
#[derive(Debug)]
pub struct OutboundTopic {
    /// Topic's name in the middleware.
    topic: String,
    /// Type of its messages, as the others call it.
    message: String,
    /// Path of the property.
    path: String,
    descriptor: &'static Descriptor,
    property: Option<Arc<Property>>,
    /// Watch while the topic has readers, so that debug outputs are computed.
    watching: Option<Watching>,
    /// Number of the value that was taken last.
    taken: u64,
    /// Sequence number of the newest value seen by [`is_written`](Self::is_written).
    noticed: u64,
    counts: Arc<OutboundCounts>,
}

#[derive(Debug, Default)]
struct OutboundCounts {
    /// Values that were taken.
    sent: AtomicU64,
    /// Values that were written between two that were taken.
    thinned: AtomicU64,
}

/// Status of a topic that another thread sends.
#[derive(Clone, Debug)]
pub struct OutboundStatus {
    topic: String,
    message: String,
    path: String,
    counts: Arc<OutboundCounts>,
}

impl OutboundTopic {
    /// Creates a topic with the values of a property at a path.
    pub fn new(topic: &str, message: &str, path: &str, property: Arc<Property>) -> Self {
        Self {
            topic: topic.into(),
            message: message.into(),
            path: path.into(),
            descriptor: property.descriptor(),
            property: Some(property),
            watching: None,
            taken: 0,
            noticed: 0,
            counts: Arc::default(),
        }
    }

    /// Returns the topic's name in the middleware.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Returns the path of the property.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Returns a handle of the status for other threads.
    pub fn status(&self) -> OutboundStatus {
        OutboundStatus {
            topic: self.topic.clone(),
            message: self.message.clone(),
            path: self.path.clone(),
            counts: Arc::clone(&self.counts),
        }
    }

    /// Switches to the current property at the path.
    /// It may be another one, as modules come and go.
    pub fn follow(&mut self, composer: &Composer) {
        let found = composer.board().get(&self.path).map(|(property, _)| property);
        let is_same = match (&self.property, &found) {
            (Some(known), Some(found)) => Arc::ptr_eq(known, found),
            (None, None) => true,
            _ => false,
        };
        if !is_same {
            (self.watching, self.taken, self.noticed) = (None, 0, 0);
            self.property = found.filter(|found| found.descriptor().hash == self.descriptor.hash);
        }
    }

    /// Skips the present values, as the topic has no readers.
    pub fn skip(&mut self) {
        self.watching = None;
        let channel = self.property.as_ref().and_then(|property| property.channel());
        self.taken = channel.map_or(0, |channel| channel.published());
    }

    /// Returns whether the property was written since the last call.
    pub(crate) fn is_written(&mut self) -> bool {
        let channel = self.property.as_ref().and_then(|property| property.channel());
        let written = channel.map_or(0, |channel| channel.published());
        std::mem::replace(&mut self.noticed, written) != written
    }

    /// Takes the newest value, unless it was taken before.
    ///
    /// # Errors
    /// When it can't be read, in words.
    pub fn take(&mut self, composer: &Composer) -> Result<Option<OutboundValue>, String> {
        let Some(property) = &self.property else { return Ok(None) };
        self.watching.get_or_insert_with(|| property.watch());
        if property.channel().is_none_or(|channel| channel.published() == self.taken) {
            return Ok(None);
        }
        let newest = property.newest().map_err(|error| error.to_string())?;
        let Some((mut bytes, items, stamp)) = newest else { return Ok(None) };
        if stamp.sequence == self.taken {
            return Ok(None);
        }
        if self.taken > 0 {
            let between = stamp.sequence.saturating_sub(self.taken + 1);
            self.counts.thinned.fetch_add(between, Ordering::Relaxed);
        }
        self.taken = stamp.sequence;
        self.counts.sent.fetch_add(1, Ordering::Relaxed);
        // Behind the last item there may be bytes that only fill up.
        bytes.truncate(self.descriptor.size + items * self.descriptor.tail().map_or(0, Kind::size));
        Ok(Some(OutboundValue { bytes, time: date(composer, stamp.time) }))
    }
}

impl OutboundStatus {
    /// Returns the status; `others` is the number of connected subscriptions.
    pub fn status(&self, others: Option<usize>) -> TopicStatus {
        TopicStatus {
            topic: self.topic.clone(),
            message: self.message.clone(),
            property: self.path.clone(),
            is_read: false,
            others,
            count: self.counts.sent.load(Ordering::Relaxed),
            refused: 0,
            dropped: self.counts.thinned.load(Ordering::Relaxed),
            error: None,
        }
    }
}

/// Returns the time of a message, ns.
/// That of the simulation in lockstep, else the date.
pub fn date(composer: &Composer, time: u64) -> u64 {
    if composer.is_lockstep() {
        return time;
    }
    let date = composer.date_of(time).duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(date.as_nanos()).unwrap_or(u64::MAX)
}
