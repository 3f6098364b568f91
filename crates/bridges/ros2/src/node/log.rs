//! Agent's log as `/rosout`.

use std::sync::Arc;

use serde_json::json;
use slate_control::ControlSurface;
use slate_ros_messages::WireFormat;
use slate_topics::{LogLines, MessageType, NodeLogLine};

use super::{NodeTopic, write};
use crate::settings::RosSettings;
use crate::wire::{NodeWire, TopicWriter, WireType};
use slate_dds::TopicQuality;
use slate_topics::RosError;

const TOPIC: &str = "/rosout";
const MESSAGE: &str = "rcl_interfaces/msg/Log";
/// Late listeners receive the last lines.
const QUALITY: TopicQuality = TopicQuality { reliable: true, transient_local: true, depth: 100 };
const DEFINITION: &str = "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line";
const SECOND: u64 = 1_000_000_000;

/// `/rosout`: each line of the log, with the name of its module.
pub struct LogTopic {
    writer: Arc<dyn TopicWriter>,
    message: MessageType,
    node: String,
    lines: LogLines,
}

impl LogTopic {
    pub fn open(wire: &dyn NodeWire, settings: &RosSettings) -> Result<Self, RosError> {
        let message = MessageType::parse(WireFormat::Cdr, MESSAGE, DEFINITION);
        let message = message.map_err(|reason| RosError::definition(MESSAGE, reason))?;
        let writer = wire.writer(TOPIC, &WireType::from(&message), QUALITY)?;
        Ok(Self { writer, message, node: settings.node.name.clone(), lines: LogLines::default() })
    }

    fn message(&self, line: &NodeLogLine) -> Result<Vec<u8>, String> {
        let level = match line.level.as_str() {
            "ERROR" => 40,
            "WARN" => 30,
            "INFO" => 20,
            _ => 10,
        };
        let name = match line.module.as_str() {
            "" => self.node.clone(),
            module => format!("{}.{}", self.node, module.replace('/', ".")),
        };
        let message = json!({
            "stamp": { "sec": line.time / SECOND, "nanosec": line.time % SECOND },
            "level": level,
            "name": name,
            "msg": line.text,
        });
        self.message.encode(&message)
    }
}

impl NodeTopic for LogTopic {
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        for line in self.lines.take(surface)? {
            write(&*self.writer, self.message(&line)?, TOPIC)?;
        }
        Ok(())
    }
}
