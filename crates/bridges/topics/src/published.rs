//! Sending thread for properties' values of topics.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;

use crate::message::RosMessage;
use crate::outbound::OutboundTopic;

/// Period of the check whether something has changed without a notice.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Period of the check whether a property is another one.
const SURVEY_PERIOD: Duration = Duration::from_millis(500);

/// Writer of a topic in the middleware.
pub trait TopicSink: Send {
    /// Returns whether messages have receivers, now or later.
    fn is_wanted(&self) -> bool;

    /// Sends a message.
    ///
    /// # Errors
    /// The middleware refuses it; the reason in words.
    fn send(&self, message: Vec<u8>) -> Result<(), String>;
}

/// Encoding of values as messages of a topic.
pub trait TopicMessage: Send {
    /// Appends the message of a value.
    /// `stamp` is its time, ns; `frame` its coordinate frame.
    ///
    /// # Errors
    /// The value does not fit, in words.
    fn encode(&self, bytes: &[u8], stamp: u64, frame: &str, message: &mut Vec<u8>) -> Result<(), String>;
}

impl TopicMessage for RosMessage {
    fn encode(&self, bytes: &[u8], stamp: u64, frame: &str, message: &mut Vec<u8>) -> Result<(), String> {
        Self::encode(self, bytes, stamp, frame, message).map_err(|error| error.to_string())
    }
}

/// Topic that has the values of a property.
pub struct PublishedTopic<S, M = RosMessage> {
    topic: OutboundTopic,
    message: M,
    frame: String,
    sink: S,
    is_error_logged: bool,
}

impl<S: TopicSink, M: TopicMessage> PublishedTopic<S, M> {
    /// Creates a topic whose messages have a frame, and go to a sink.
    pub fn new(topic: OutboundTopic, message: M, frame: &str, sink: S) -> Self {
        Self { topic, message, frame: frame.into(), sink, is_error_logged: false }
    }

    /// Returns the topic.
    pub fn topic(&self) -> &OutboundTopic {
        &self.topic
    }

    /// Returns its writer.
    pub fn sink(&self) -> &S {
        &self.sink
    }

    /// Sends the newest value, if it was not sent and has receivers.
    fn send(&mut self, composer: &Composer) -> Result<(), String> {
        if !self.sink.is_wanted() {
            // Later subscriptions receive only values written from then on.
            self.topic.skip();
            return Ok(());
        }
        let Some(value) = self.topic.take(composer)? else { return Ok(()) };
        let mut message = Vec::new();
        self.message.encode(&value.bytes, value.time, &self.frame, &mut message)?;
        self.sink.send(message)
    }
}

/// Topics that have the values of properties.
pub struct PublishedTopics<S, M = RosMessage> {
    /// Scheme of the bridge, for the log.
    scheme: &'static str,
    topics: Vec<PublishedTopic<S, M>>,
    renewed: Instant,
}

impl<S: TopicSink, M: TopicMessage> PublishedTopics<S, M> {
    /// Topics of a bridge.
    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    pub fn new(scheme: &'static str, topics: Vec<PublishedTopic<S, M>>) -> Self {
        Self { scheme, topics, renewed: Instant::now() }
    }

    /// Sends the newest values that were not sent.
    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    pub fn send(&mut self, composer: &Composer) {
        if self.renewed.elapsed() > SURVEY_PERIOD {
            self.renewed = Instant::now();
            self.follow(composer);
        }
        for own in &mut self.topics {
            if let Err(reason) = own.send(composer)
                && !std::mem::replace(&mut own.is_error_logged, true)
            {
                let (scheme, path, topic) = (self.scheme, own.topic.path(), own.topic.topic());
                let text = format!("{scheme}: a value of /{path} is not sent to {topic}: {reason}");
                composer.log(Level::Warn, &text);
            }
        }
    }

    /// Switches to the present properties.
    pub(crate) fn follow(&mut self, composer: &Composer) {
        self.topics.iter_mut().for_each(|own| own.topic.follow(composer));
    }

    /// Topics whose properties were written since the last call.
    pub(crate) fn written(&mut self) -> Vec<String> {
        let topics = self.topics.iter_mut();
        topics.filter_map(|own| own.topic.is_written().then(|| own.topic.topic().to_owned())).collect()
    }
}

/// Sends values as they are written, until the end.
/// `scheme` names the bridge in the log.
pub fn publish<S: TopicSink, M: TopicMessage>(
    scheme: &'static str,
    topics: Vec<PublishedTopic<S, M>>,
    composer: &Composer,
    wake: &Arc<Wake>,
    ended: &AtomicBool,
) {
    let mut topics = PublishedTopics::new(scheme, topics);
    while !ended.load(Ordering::Acquire) {
        topics.send(composer);
        wake.wait_timeout(IDLE_PERIOD);
    }
}
