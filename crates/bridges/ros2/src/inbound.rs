//! From topics to inputs.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Waker;
use std::time::Duration;

use slate_blackboard::interface::Kind;
use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::{Composer, ExternalContent, ExternalDelivery};

use crate::message::RosMessage;
use crate::participant::TopicReader;
use crate::settings::TopicInput;

/// How long a thread sleeps when nothing comes.
const PAUSE: Duration = Duration::from_millis(100);

/// Messages of a topic that are taken before those of the next.
const TURN: usize = 256;

/// An input that reads a topic.
pub struct InboundTopic {
    pub settings: TopicInput,
    pub message: RosMessage,
    /// Items of the input's tail, at most.
    pub capacity: usize,
    pub received: AtomicU64,
    pub refused: AtomicU64,
    pub dropped: AtomicU64,
    error: Mutex<Option<String>>,
}

/// Inputs that read topics, and what came for them and was not set yet.
pub struct InboundTopics {
    pub topics: Vec<InboundTopic>,
    composer: Composer,
    delivery: ExternalDelivery,
    /// Wakes who receives.
    received: Arc<Wake>,
    ended: AtomicBool,
}

/// Wakes the thread that receives.
pub struct ReaderWaker(pub Arc<Wake>);

impl std::task::Wake for ReaderWaker {
    fn wake(self: Arc<Self>) {
        self.0.notify(1);
    }
}

impl InboundTopic {
    pub fn new(settings: TopicInput, message: RosMessage, capacity: usize) -> Self {
        Self {
            settings,
            message,
            capacity,
            received: AtomicU64::new(0),
            refused: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
            error: Mutex::default(),
        }
    }

    /// Why the last message did not fit; nothing when it did.
    pub fn error(&self) -> Option<String> {
        locked(&self.error).clone()
    }

    fn decode(&self, message: &[u8]) -> Result<Vec<u8>, String> {
        let bytes = self.message.decode(message).map_err(|error| error.to_string())?;
        let descriptor = self.message.descriptor();
        let item = descriptor.tail().map_or(1, Kind::size);
        let items = bytes.len().saturating_sub(descriptor.size) / item.max(1);
        if items > self.capacity {
            let tail = descriptor.fields.last().map_or("", |field| field.name);
            return Err(format!("`{tail}` has {items} items, and the input has room for {}", self.capacity));
        }
        Ok(bytes)
    }

    /// Takes note of what became of a message; the same reason is logged once.
    fn note(&self, result: Result<(), String>, composer: &Composer) {
        let mut error = locked(&self.error);
        match result {
            Ok(()) => {
                self.received.fetch_add(1, Ordering::Relaxed);
                *error = None;
            }
            Err(reason) => {
                self.refused.fetch_add(1, Ordering::Relaxed);
                if error.as_ref() != Some(&reason) {
                    let TopicInput { topic, input, .. } = &self.settings;
                    let text = format!("ros2: a message of {topic} does not fit /{input}: {reason}");
                    composer.log(Level::Warn, &text);
                    *error = Some(reason);
                }
            }
        }
    }
}

impl InboundTopics {
    pub fn new(composer: Composer, topics: Vec<InboundTopic>) -> Self {
        let depths = topics.iter().map(|topic| &topic.settings);
        let depths = depths.map(|settings| (settings.input.clone(), settings.quality.depth.into()));
        Self {
            delivery: ExternalDelivery::new(composer.clone(), depths),
            topics,
            composer,
            received: Arc::new(Wake::new()),
            ended: AtomicBool::new(false),
        }
    }

    /// Ends both loops.
    pub fn end(&self) {
        self.ended.store(true, Ordering::Release);
        self.delivery.end();
        self.received.notify(1);
    }

    /// Takes what comes, until the end; `look` is called now and then.
    pub fn receive(&self, readers: &[TopicReader], look: impl Fn()) {
        let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(&self.received))));
        while !self.ended.load(Ordering::Acquire) {
            look();
            let mut is_done = true;
            for (place, reader) in readers.iter().enumerate() {
                reader.drain_read_notifications();
                // Before it is looked: what comes after that wakes this thread.
                reader.set_waker(Some(waker.clone()));
                is_done &= self.take(place, reader);
            }
            if is_done {
                self.received.wait_timeout(PAUSE);
            }
        }
    }

    /// Takes what came of a topic; whether that is all.
    fn take(&self, place: usize, reader: &TopicReader) -> bool {
        let topic = &self.topics[place];
        for _ in 0..TURN {
            let message = match reader.try_take_one() {
                Ok(Some(change)) => change.into_value(),
                Ok(None) => return true,
                Err(error) => {
                    topic.note(Err(error.to_string()), &self.composer);
                    continue;
                }
            };
            match topic.decode(&message.0) {
                Ok(bytes) => self.push(place, bytes),
                Err(reason) => topic.note(Err(reason), &self.composer),
            }
        }
        false
    }

    /// Puts a value behind the others; the oldest of its topic goes when there are as many as its depth.
    pub fn push(&self, place: usize, bytes: Vec<u8>) {
        if !self.delivery.push(place, ExternalContent::Bytes(bytes)) {
            self.topics[place].dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Sets the inputs to what came, until the end.
    pub fn deliver(&self) {
        self.delivery.run(|place, result| {
            self.topics[place].note(result.map_err(|error| error.to_string()), &self.composer);
        });
    }
}

/// What stays intact when another thread panicked while it held the lock.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
