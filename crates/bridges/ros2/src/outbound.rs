//! From properties to topics.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant, UNIX_EPOCH};

use rustdds::{GUID, RTPSEntity};
use slate_blackboard::interface::Kind;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Property, Watching};
use slate_module::Level;
use slate_runtime::Composer;

use crate::matches::Matches;
use crate::message::RosMessage;
use crate::participant::TopicWriter;
use crate::raw::RawMessage;
use crate::settings::TopicOutput;

/// How often it is looked whether something has changed without a notice.
const PAUSE: Duration = Duration::from_millis(100);

/// How often it is looked whether a property is another one.
const RENEW: Duration = Duration::from_millis(500);

/// Counts of a topic that has the values of a property.
#[derive(Default)]
pub struct OutboundCounts {
    /// Values that were sent.
    pub sent: AtomicU64,
    /// Values that were written between two that were sent.
    pub thinned: AtomicU64,
}

/// A topic that has the values of a property.
pub struct OutboundTopic {
    pub settings: TopicOutput,
    pub message: RosMessage,
    pub writer: TopicWriter,
    pub counts: Arc<OutboundCounts>,
    property: Option<Arc<Property>>,
    /// While somebody reads it, so that debug outputs are computed.
    watching: Option<Watching>,
    /// Number of the value that was sent last.
    sent: u64,
    is_told: bool,
    buffer: Vec<u8>,
}

/// All of them.
pub struct OutboundTopics {
    pub topics: Vec<OutboundTopic>,
    pub composer: Composer,
    pub matches: Arc<Matches>,
    pub wake: Arc<Wake>,
    pub ended: Arc<AtomicBool>,
}

impl OutboundTopic {
    pub fn new(
        settings: TopicOutput,
        message: RosMessage,
        writer: TopicWriter,
        property: Arc<Property>,
    ) -> Self {
        Self {
            settings,
            message,
            writer,
            counts: Arc::default(),
            property: Some(property),
            watching: None,
            sent: 0,
            is_told: false,
            buffer: Vec::new(),
        }
    }

    pub fn guid(&self) -> GUID {
        self.writer.guid()
    }

    /// Turns to the property that is there now, which may be another one.
    fn follow(&mut self, composer: &Composer) {
        let found = composer.board().get(&self.settings.property).map(|(property, _)| property);
        let is_same = match (&self.property, &found) {
            (Some(known), Some(found)) => Arc::ptr_eq(known, found),
            (None, None) => true,
            _ => false,
        };
        if !is_same {
            let fits = |found: &Arc<Property>| found.descriptor().hash == self.message.descriptor().hash;
            (self.watching, self.sent) = (None, 0);
            self.property = found.filter(fits);
        }
    }

    /// Sends the newest value, if it was not sent and somebody may read it.
    fn send(&mut self, composer: &Composer, is_read: bool) -> Result<(), String> {
        let Some(property) = &self.property else { return Ok(()) };
        if !is_read && !self.settings.quality.transient_local {
            // Only what is written from then on comes to the next subscription.
            self.watching = None;
            self.sent = property.channel().map_or(0, |channel| channel.published());
            return Ok(());
        }
        self.watching.get_or_insert_with(|| property.watch());
        if property.channel().is_none_or(|channel| channel.published() == self.sent) {
            return Ok(());
        }
        let newest = property.newest().map_err(|error| error.to_string())?;
        let Some((bytes, items, stamp)) = newest else { return Ok(()) };
        if stamp.sequence == self.sent {
            return Ok(());
        }
        let skipped = stamp.sequence.saturating_sub(self.sent + 1);
        if self.sent > 0 {
            self.counts.thinned.fetch_add(skipped, Ordering::Relaxed);
        }
        self.sent = stamp.sequence;
        // Behind the last item there may be bytes that only fill up.
        let descriptor = property.descriptor();
        let length = descriptor.size + items * descriptor.tail().map_or(0, Kind::size);
        let value = bytes.get(..length).unwrap_or(&bytes);
        self.buffer.clear();
        let (time, frame) = (date(composer, stamp.time), &self.settings.frame);
        self.message.encode(value, time, frame, &mut self.buffer).map_err(|error| error.to_string())?;
        let message = RawMessage(self.buffer.clone());
        self.writer.write(message, None).map_err(|error| error.to_string())?;
        self.counts.sent.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}

impl OutboundTopics {
    /// Sends what is written, until the end.
    #[allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]
    pub fn run(mut self) {
        let mut renewed = Instant::now();
        while !self.ended.load(Ordering::Acquire) {
            if renewed.elapsed() > RENEW {
                renewed = Instant::now();
                self.topics.iter_mut().for_each(|topic| topic.follow(&self.composer));
            }
            for topic in &mut self.topics {
                let is_read = self.matches.count(topic.guid()) > 0;
                if let Err(reason) = topic.send(&self.composer, is_read)
                    && !std::mem::replace(&mut topic.is_told, true)
                {
                    let TopicOutput { topic, property, .. } = &topic.settings;
                    let text = format!("ros2: a value of /{property} is not sent to {topic}: {reason}");
                    self.composer.log(Level::Warn, &text);
                }
            }
            self.wake.wait_timeout(PAUSE);
        }
    }
}

/// Time of a message, ns: that of the simulation in lockstep, else the date.
pub fn date(composer: &Composer, time: u64) -> u64 {
    if composer.is_lockstep() {
        return time;
    }
    let date = composer.date_of(time).duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(date.as_nanos()).unwrap_or(u64::MAX)
}
