//! Subscriptions and publishers on Zenoh.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::task::Waker;
use std::time::Duration;

use slate_dds::TopicQuality;
use zenoh::matching::{MatchingListener, MatchingStatus};
use zenoh::qos::{CongestionControl, Reliability};
use zenoh::sample::Sample;
use zenoh::{Result, Session, Wait};
use zenoh_ext::{
    AdvancedPublisher, AdvancedPublisherBuilderExt, AdvancedSubscriber, AdvancedSubscriberBuilderExt,
    CacheConfig, HistoryConfig, MissDetectionConfig, RecoveryConfig,
};

use super::attachment::{Gid, MessageAttachment};
use super::queue::{ReceiveQueue, locked};
use super::session_endpoint::SessionEndpoint;
use crate::wire::{TopicReader, TopicWriter};

/// Messages that may wait for their thread, at least.
const MIN_QUEUE_CAPACITY: usize = 64;

/// Period at which subscriptions learn the number of the last message.
/// So they request it if it was lost.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// Subscription.
pub struct ZenohTopicReader {
    key: String,
    quality: TopicQuality,
    queue: Arc<ReceiveQueue<Vec<u8>>>,
    publishers: Arc<AtomicUsize>,
    subscriber: Mutex<Option<AdvancedSubscriber<()>>>,
}

impl ZenohTopicReader {
    pub fn new(key: String, quality: TopicQuality, publishers: Arc<AtomicUsize>) -> Self {
        let queue = Arc::new(ReceiveQueue::new(MIN_QUEUE_CAPACITY.max(quality.depth.into())));
        Self { key, quality, queue, publishers, subscriber: Mutex::default() }
    }
}

impl SessionEndpoint for ZenohTopicReader {
    fn declare(&self, session: &Session) -> Result<()> {
        let queue = Arc::clone(&self.queue);
        let take = move |sample: Sample| {
            let message = sample.payload().to_bytes().into_owned();
            let size = message.len();
            queue.push(message, size);
        };
        let mut subscriber = session.declare_subscriber(self.key.clone()).advanced();
        if self.quality.transient_local {
            let depth = self.quality.depth.into();
            subscriber = subscriber
                .subscriber_detection()
                .history(HistoryConfig::default().detect_late_publishers().max_samples(depth));
            if self.quality.reliable {
                subscriber = subscriber.recovery(RecoveryConfig::default().heartbeat());
            }
        }
        *locked(&self.subscriber) = Some(subscriber.callback(take).wait()?);
        Ok(())
    }
}

impl TopicReader for ZenohTopicReader {
    fn set_waker(&self, waker: &Waker) {
        self.queue.set_waker(waker);
    }

    fn take(&self) -> std::result::Result<Option<Vec<u8>>, String> {
        Ok(self.queue.take())
    }

    fn take_dropped(&self) -> u64 {
        self.queue.take_dropped()
    }

    fn publishers(&self) -> usize {
        self.publishers.load(Ordering::Acquire)
    }
}

/// Publisher.
pub struct ZenohTopicWriter {
    key: String,
    gid: Gid,
    quality: TopicQuality,
    subscriptions: Arc<AtomicUsize>,
    /// Matching state: Zenoh has a subscriber, which need not be a node.
    is_matched: Arc<AtomicBool>,
    state: Mutex<WriterState>,
}

#[derive(Default)]
struct WriterState {
    /// Listener, dropped before its publisher.
    _matching: Option<MatchingListener<()>>,
    publisher: Option<AdvancedPublisher<'static>>,
    sent: i64,
    /// Last messages for late subscriptions, until a router is available.
    kept: VecDeque<Vec<u8>>,
}

impl ZenohTopicWriter {
    pub fn new(key: String, gid: Gid, quality: TopicQuality, subscriptions: Arc<AtomicUsize>) -> Self {
        Self { key, gid, quality, subscriptions, is_matched: Arc::default(), state: Mutex::default() }
    }

    fn publish(&self, state: &mut WriterState, message: Vec<u8>) -> Result<()> {
        let Some(publisher) = &state.publisher else { return Ok(()) };
        state.sent += 1;
        publisher.put(message).attachment(MessageAttachment::now(state.sent, self.gid).encode()).wait()
    }
}

impl SessionEndpoint for ZenohTopicWriter {
    fn declare(&self, session: &Session) -> Result<()> {
        let TopicQuality { reliable, transient_local, depth } = self.quality;
        let reliability = if reliable { Reliability::Reliable } else { Reliability::BestEffort };
        // A subscription that stalls must not keep the others waiting.
        let mut publisher = session
            .declare_publisher(self.key.clone())
            .reliability(reliability)
            .congestion_control(CongestionControl::Drop)
            .advanced();
        if transient_local {
            publisher =
                publisher.cache(CacheConfig::default().max_samples(depth.into())).publisher_detection();
            if reliable {
                let detection = MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT);
                publisher = publisher.sample_miss_detection(detection);
            }
        }
        let publisher = publisher.wait()?;
        let is_matched = Arc::clone(&self.is_matched);
        let note = move |status: MatchingStatus| is_matched.store(status.matching(), Ordering::Release);
        let matching = publisher.matching_listener().callback(note).wait()?;
        // A subscriber that was there before.
        if publisher.matching_status().wait()?.matching() {
            self.is_matched.store(true, Ordering::Release);
        }
        let mut state = locked(&self.state);
        (state._matching, state.publisher) = (Some(matching), Some(publisher));
        let kept = std::mem::take(&mut state.kept);
        kept.into_iter().try_for_each(|message| self.publish(&mut state, message))
    }
}

impl TopicWriter for ZenohTopicWriter {
    fn write(&self, message: Vec<u8>) -> std::result::Result<(), String> {
        let mut state = locked(&self.state);
        if state.publisher.is_some() {
            return self.publish(&mut state, message).map_err(|error| error.to_string());
        }
        if self.quality.transient_local {
            if state.kept.len() >= self.quality.depth.into() {
                state.kept.pop_front();
            }
            state.kept.push_back(message);
        }
        Ok(())
    }

    fn subscriptions(&self) -> usize {
        self.subscriptions.load(Ordering::Acquire)
    }

    fn has_receivers(&self) -> bool {
        self.subscriptions() > 0 || self.is_matched.load(Ordering::Acquire)
    }
}
