//! From properties to topics.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustdds::{GUID, RTPSEntity};
use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;
use slate_topics::OutboundTopic;

use crate::matches::Matches;
use crate::message::RosMessage;
use crate::participant::TopicWriter;
use crate::raw::RawMessage;
use crate::settings::TopicOutput;

/// Period of the check whether something has changed without a notice.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Period of the check whether a property is another one.
const RENEW: Duration = Duration::from_millis(500);

/// A topic that has the values of a property.
pub struct WriterTopic {
    pub topic: OutboundTopic,
    pub message: RosMessage,
    pub writer: TopicWriter,
    pub settings: TopicOutput,
    pub is_error_logged: bool,
}

/// All of them.
pub struct WriterTopics {
    pub topics: Vec<WriterTopic>,
    pub composer: Composer,
    pub matches: Arc<Matches>,
    pub wake: Arc<Wake>,
    pub ended: Arc<AtomicBool>,
}

impl WriterTopic {
    pub fn guid(&self) -> GUID {
        self.writer.guid()
    }

    /// Sends the newest value, if it was not sent and somebody may read it.
    fn send(&mut self, composer: &Composer, is_read: bool) -> Result<(), String> {
        if !is_read && !self.settings.quality.transient_local {
            // Only what is written from then on comes to the next subscription.
            self.topic.skip();
            return Ok(());
        }
        let Some(value) = self.topic.take(composer)? else { return Ok(()) };
        let mut message = Vec::new();
        let encoded = self.message.encode(&value.bytes, value.time, &self.settings.frame, &mut message);
        encoded.map_err(|error| error.to_string())?;
        self.writer.write(RawMessage(message), None).map_err(|error| error.to_string())
    }
}

impl WriterTopics {
    /// Sends what is written, until the end.
    #[allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]
    pub fn run(mut self) {
        let mut renewed = Instant::now();
        while !self.ended.load(Ordering::Acquire) {
            if renewed.elapsed() > RENEW {
                renewed = Instant::now();
                self.topics.iter_mut().for_each(|topic| topic.topic.follow(&self.composer));
            }
            for topic in &mut self.topics {
                let is_read = self.matches.count(topic.guid()) > 0;
                if let Err(reason) = topic.send(&self.composer, is_read)
                    && !std::mem::replace(&mut topic.is_error_logged, true)
                {
                    let TopicOutput { topic, property, .. } = &topic.settings;
                    let text = format!("ros2: a value of /{property} is not sent to {topic}: {reason}");
                    self.composer.log(Level::Warn, &text);
                }
            }
            self.wake.wait_timeout(IDLE_PERIOD);
        }
    }
}
