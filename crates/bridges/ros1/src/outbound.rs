//! From properties to topics.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;
use slate_topics::OutboundTopic;

use crate::message::Ros1Message;
use crate::settings::SCHEME;
use crate::wire::TopicPublication;

/// Period of the check whether something has changed without a notice.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Period of the check whether a property is another one.
const RENEW: Duration = Duration::from_millis(500);

/// A topic with its publication.
pub struct PublishedTopic {
    pub topic: OutboundTopic,
    pub message: Ros1Message,
    pub publication: Arc<TopicPublication>,
    pub frame: String,
    pub is_error_logged: bool,
}

/// All topics that have values of properties.
pub struct PublishedTopics {
    pub topics: Vec<PublishedTopic>,
    pub composer: Composer,
    pub wake: Arc<Wake>,
    pub ended: Arc<AtomicBool>,
}

impl PublishedTopic {
    /// Sends the newest value, if it was not sent and somebody may read it.
    fn send(&mut self, composer: &Composer) -> Result<(), String> {
        if !self.publication.is_wanted() {
            // Only what is written from then on comes to the next subscriber.
            self.topic.skip();
            return Ok(());
        }
        let Some(value) = self.topic.take(composer)? else { return Ok(()) };
        let mut message = Vec::new();
        let encoded = self.message.encode(&value.bytes, value.time, &self.frame, &mut message);
        encoded.map_err(|error| error.to_string())?;
        self.publication.publish(&message)
    }
}

impl PublishedTopics {
    /// Sends what is written, until the end.
    #[allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]
    pub fn run(mut self) {
        let mut renewed = Instant::now();
        while !self.ended.load(Ordering::Acquire) {
            if renewed.elapsed() > RENEW {
                renewed = Instant::now();
                self.topics.iter_mut().for_each(|own| own.topic.follow(&self.composer));
            }
            for own in &mut self.topics {
                if let Err(reason) = own.send(&self.composer)
                    && !std::mem::replace(&mut own.is_error_logged, true)
                {
                    let (path, topic) = (own.topic.path(), own.topic.topic());
                    let text = format!("{SCHEME}: a value of /{path} is not sent to {topic}: {reason}");
                    self.composer.log(Level::Warn, &text);
                }
            }
            self.wake.wait_timeout(IDLE_PERIOD);
        }
    }
}
