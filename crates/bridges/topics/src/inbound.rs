//! Flow of messages from topics to inputs.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::Value as Json;
use slate_blackboard::Property;
use slate_blackboard::interface::{Descriptor, Kind};
use slate_module::Level;
use slate_runtime::{Composer, ExternalContent, ExternalDelivery};
use slate_sorted::SortedSet;

use crate::awaited::AwaitedValues;
use crate::services::bytes;
use crate::status::TopicStatus;

/// Different reasons that are logged.
const MAX_LOGGED: usize = 256;

/// Input that a topic fills.
#[derive(Debug)]
pub struct InboundTopic {
    /// Topic's name in the middleware.
    topic: String,
    /// Type of its messages, as the others call it.
    message: String,
    /// Path of the input.
    input: String,
    descriptor: &'static Descriptor,
    /// Items of the input's tail, at most.
    capacity: usize,
    /// Values that may wait for the next cycle.
    depth: usize,
    /// Lockstep wait: cycles wait for its messages.
    is_awaited: bool,
    received: AtomicU64,
    refused: AtomicU64,
    dropped: AtomicU64,
    error: Mutex<Option<String>>,
}

impl InboundTopic {
    /// Creates a topic that fills an input, given with its property.
    /// `depth` of its values may wait for the next cycle.
    pub fn new(topic: &str, message: &str, input: &str, property: &Property, depth: usize) -> Self {
        Self {
            topic: topic.into(),
            message: message.into(),
            input: input.into(),
            descriptor: property.descriptor(),
            capacity: property.channel().map_or(0, |channel| channel.shape().capacity),
            depth,
            is_awaited: false,
            received: AtomicU64::new(0),
            refused: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
            error: Mutex::default(),
        }
    }

    /// Marks it as awaited by [`LockstepTopics`](crate::LockstepTopics).
    #[must_use]
    pub fn awaited(self) -> Self {
        Self { is_awaited: true, ..self }
    }

    /// Returns the topic's name in the middleware.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Returns the message type's name in the middleware.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Returns the path of the input.
    pub fn input(&self) -> &str {
        &self.input
    }

    /// Takes note of values that were lost before they were decoded.
    pub fn note_dropped(&self, count: u64) {
        self.dropped.fetch_add(count, Ordering::Relaxed);
    }

    /// Returns the status; `others` is the number of connected publishers.
    pub fn status(&self, others: Option<usize>) -> TopicStatus {
        let count = |own: &AtomicU64| own.load(Ordering::Relaxed);
        TopicStatus {
            topic: self.topic.clone(),
            message: self.message.clone(),
            property: self.input.clone(),
            is_read: true,
            others,
            count: count(&self.received),
            refused: count(&self.refused),
            dropped: count(&self.dropped),
            error: self.error(),
        }
    }

    /// Returns the reason why its last message was refused, if it was.
    pub(crate) fn error(&self) -> Option<String> {
        locked(&self.error).clone()
    }

    /// Checks that the input has room for a value.
    fn check(&self, bytes: &[u8]) -> Result<(), String> {
        let item = self.descriptor.tail().map_or(1, Kind::size);
        let items = bytes.len().saturating_sub(self.descriptor.size) / item.max(1);
        if items <= self.capacity {
            return Ok(());
        }
        let tail = self.descriptor.fields.last().map_or("", |field| field.name);
        Err(format!("`{tail}` has {items} items, and the input has room for {}", self.capacity))
    }
}

/// Inputs that topics fill, and their received values that are not set yet.
#[derive(Debug)]
pub struct InboundTopics {
    /// Scheme of the bridge, for the log.
    scheme: &'static str,
    topics: Vec<InboundTopic>,
    composer: Composer,
    delivery: ExternalDelivery,
    /// Values of topics for which cycles wait.
    awaited: AwaitedValues,
    /// Texts that were logged.
    logged: Mutex<SortedSet<String>>,
}

impl InboundTopics {
    /// Topics of a bridge.
    pub fn new(scheme: &'static str, composer: Composer, topics: Vec<InboundTopic>) -> Self {
        let depths = topics.iter().map(|topic| (topic.input.clone(), topic.depth));
        let delivery = ExternalDelivery::new(composer.clone(), depths);
        let awaited = AwaitedValues::new(topics.len());
        Self { scheme, topics, composer, delivery, awaited, logged: Mutex::default() }
    }

    /// Returns the topics, by place.
    pub fn topics(&self) -> &[InboundTopic] {
        &self.topics
    }

    /// Says that topics no longer fill the inputs, so that tools can set them.
    pub fn release(&self) {
        for topic in &self.topics {
            if let Some((property, _)) = self.composer.board().get(topic.input()) {
                property.set_external("");
            }
        }
    }

    /// Counts messages that were dropped before they came here.
    pub fn note_dropped(&self, index: usize, count: u64) {
        let topic = &self.topics[index];
        topic.note_dropped(count);
        if topic.is_awaited && count > 0 {
            self.awaited.note_lost(index, count);
        }
    }

    /// Takes the value of a message of the topic at a place.
    /// Otherwise the reason why it has none. The oldest value is dropped when the maximum number waits.
    pub fn push(&self, index: usize, value: Result<Vec<u8>, String>) {
        let topic = &self.topics[index];
        let value = value.and_then(|bytes| topic.check(&bytes).map(|()| bytes));
        match value {
            Ok(bytes) if topic.is_awaited => {
                if !self.awaited.push(index, bytes, topic.depth) {
                    topic.note_dropped(1);
                }
            }
            Ok(bytes) => {
                if !self.delivery.push(index, ExternalContent::Bytes(bytes)) {
                    topic.note_dropped(1);
                }
            }
            Err(reason) => self.note(index, Err(reason)),
        }
    }

    /// Takes a value of the input at a place, as [`push`](Self::push) does.
    ///
    /// # Errors
    /// The input is no longer there, or the value does not fit; the reason in words.
    pub fn push_json(&self, index: usize, value: &Json) -> Result<(), String> {
        let input = self.topics[index].input();
        let found = self.composer.board().get(input).map(|(property, _)| property);
        let shape = found.as_ref().and_then(|own| Some((own.descriptor(), own.channel()?.shape())));
        let (descriptor, shape) = shape.ok_or_else(|| format!("/{input} is no longer there"))?;
        let value = bytes(descriptor, shape, value).map_err(|reason| format!("/{input}: {reason}"))?;
        self.push(index, Ok(value));
        Ok(())
    }

    /// Sets the inputs to received values, until [`end`](Self::end).
    pub fn deliver(&self) {
        self.delivery.run(|index, result| self.note(index, result.map_err(|error| error.to_string())));
    }

    /// Ends [`deliver`](Self::deliver).
    pub fn end(&self) {
        self.delivery.end();
    }

    /// Logs an error of messages for several inputs once.
    pub fn log_once(&self, text: &str) {
        let mut logged = locked(&self.logged);
        if logged.len() < MAX_LOGGED && logged.insert(text.into()) {
            self.composer.log(Level::Warn, text);
        }
    }

    /// Values of topics for which cycles wait.
    pub(crate) fn awaited(&self) -> &AwaitedValues {
        &self.awaited
    }

    /// Returns the scheme of the bridge.
    pub(crate) fn scheme(&self) -> &'static str {
        self.scheme
    }

    /// Returns the agent.
    pub(crate) fn composer(&self) -> &Composer {
        &self.composer
    }

    /// Notes the outcome of a message; the same reason is logged once.
    pub(crate) fn note(&self, index: usize, result: Result<(), String>) {
        let topic = &self.topics[index];
        let mut error = locked(&topic.error);
        let Err(reason) = result else {
            topic.received.fetch_add(1, Ordering::Relaxed);
            *error = None;
            return;
        };
        topic.refused.fetch_add(1, Ordering::Relaxed);
        if error.as_ref() != Some(&reason) {
            let text = format!(
                "{}: a message of {} does not fit /{}: {reason}",
                self.scheme, topic.topic, topic.input
            );
            self.composer.log(Level::Warn, &text);
            *error = Some(reason);
        }
    }
}

/// Locks data that stays intact when another thread panics with the lock.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
