//! Topics that each node publishes: time, frames and log.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde_json::json;
use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_module::Level;
use slate_ros_messages::{Schema, WireFormat, encode_json_in, transforms_definition_in};
use slate_topics::{FrameMessages, LogLines, NodeLogLine};

use crate::settings::{Ros1Settings, SCHEME};
use crate::wire::TopicPublication;
use slate_topics::RosError;

/// Topic of transforms that change.
pub const MOVING: &str = "/tf";
/// Topic of static transforms.
/// Late listeners receive the last message of each node, which has all of its own.
pub const FIXED: &str = "/tf_static";

const CLOCK: &str = "/clock";
const LOG: &str = "/rosout";

/// Messages that wait for a slow subscriber.
const DEPTH: usize = 100;

const SECOND: u64 = 1_000_000_000;

/// Period of the check whether something has changed without a notice.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

const LOG_DEFINITION: &str = "byte DEBUG=1\nbyte INFO=2\nbyte WARN=4\nbyte ERROR=8\nbyte FATAL=16\n\
                              Header header\nbyte level\nstring name\nstring msg\nstring file\nstring function\n\
                              uint32 line\nstring[] topics\n\
                              ====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

/// Topics of the settings.
pub struct NodeTopics {
    clock: Option<ClockTopic>,
    frames: Option<FrameTopics>,
    log: Option<LogTopic>,
    logged: Vec<String>,
}

struct ClockTopic {
    publication: Arc<TopicPublication>,
    sent: Option<u64>,
}

struct FrameTopics {
    /// `/tf` and `/tf_static`.
    publications: [Arc<TopicPublication>; 2],
    messages: FrameMessages,
}

struct LogTopic {
    publication: Arc<TopicPublication>,
    schema: Schema,
    node: String,
    lines: LogLines,
}

fn publication(topic: &str, of: (&str, &str), is_latched: bool) -> Result<Arc<TopicPublication>, RosError> {
    let own = TopicPublication::new(topic, of, DEPTH, is_latched);
    own.map(Arc::new).map_err(|reason| RosError::definition(topic, reason))
}

impl NodeTopics {
    /// Creates the topics of the settings.
    ///
    /// # Errors
    /// When a message has no definition.
    pub fn new(surface: &ControlSurface, settings: &Ros1Settings) -> Result<Self, RosError> {
        let options = &settings.options;
        let mut topics = Self { clock: None, frames: None, log: None, logged: Vec::new() };
        if options.clock {
            let publication = publication(CLOCK, ("rosgraph_msgs/Clock", "time clock"), false)?;
            topics.clock = Some(ClockTopic { publication, sent: None });
        }
        if options.transforms {
            let definition = transforms_definition_in(WireFormat::Ros1);
            let of = (definition.name.as_str(), definition.text.as_str());
            let publications = [publication(MOVING, of, false)?, publication(FIXED, of, true)?];
            let messages = FrameMessages::new(WireFormat::Ros1, surface, &options.frames);
            topics.frames = Some(FrameTopics { publications, messages });
        }
        if options.log {
            const NAME: &str = "rosgraph_msgs/Log";
            let schema = Schema::parse(NAME, LOG_DEFINITION);
            let schema = schema.map_err(|error| RosError::definition(NAME, error.to_string()))?;
            let publication = publication(LOG, (NAME, LOG_DEFINITION), false)?;
            let (node, lines) = (settings.node.clone(), LogLines::default());
            topics.log = Some(LogTopic { publication, schema, node, lines });
        }
        Ok(topics)
    }

    /// Returns whether the node has no topic to publish.
    pub fn is_empty(&self) -> bool {
        self.clock.is_none() && self.frames.is_none() && self.log.is_none()
    }

    /// Returns their publications.
    pub fn publications(&self) -> Vec<Arc<TopicPublication>> {
        let frames = self.frames.iter().flat_map(|own| &own.publications);
        let others =
            self.clock.iter().map(|own| &own.publication).chain(self.log.iter().map(|own| &own.publication));
        frames.chain(others).cloned().collect()
    }

    /// Publishes new values until the end.
    pub fn run(mut self, surface: &ControlSurface, wake: &Wake, ended: &AtomicBool) {
        while !ended.load(Ordering::Acquire) {
            let results = [
                self.clock.as_mut().map_or(Ok(()), |own| own.publish(surface)),
                self.frames.as_mut().map_or(Ok(()), |own| own.publish(surface)),
                self.log.as_mut().map_or(Ok(()), |own| own.publish(surface)),
            ];
            for reason in results.into_iter().filter_map(Result::err) {
                // The same reason is logged once.
                if !self.logged.contains(&reason) {
                    surface.agent.composer().log(Level::Warn, &format!("{SCHEME}: {reason}"));
                    self.logged.push(reason);
                }
            }
            wake.wait_timeout(IDLE_PERIOD);
        }
    }
}

impl ClockTopic {
    /// Publishes the time of a cycle.
    /// The newest one, when cycles follow faster than it is sent.
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        let now = surface.now();
        if self.sent.replace(now) == Some(now) {
            return Ok(());
        }
        let stamp = [(now / SECOND) as u32, (now % SECOND) as u32].map(u32::to_le_bytes);
        self.publication.publish(stamp.as_flattened())
    }
}

impl FrameTopics {
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        let messages = self.messages.take(surface)?;
        for (publication, message) in self.publications.iter().zip(messages) {
            message.map_or(Ok(()), |message| publication.publish(&message))?;
        }
        Ok(())
    }
}

impl LogTopic {
    /// Publishes each line, with the name of its module.
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        for line in self.lines.take(surface)? {
            self.publication.publish(&self.message(&line)?)?;
        }
        Ok(())
    }

    fn message(&self, line: &NodeLogLine) -> Result<Vec<u8>, String> {
        let level = match line.level.as_str() {
            "ERROR" => 8,
            "WARN" => 4,
            "INFO" => 2,
            _ => 1,
        };
        let between = if line.module.is_empty() { "" } else { "/" };
        let message = json!({
            "header": { "stamp": { "sec": line.time / SECOND, "nanosec": line.time % SECOND } },
            "level": level,
            "name": format!("{}{between}{}", self.node, line.module),
            "msg": line.text,
        });
        encode_json_in(WireFormat::Ros1, &self.schema, &message).map_err(|error| error.to_string())
    }
}
