//! The agent's log as `/rosout`.

use rustdds::{GUID, RTPSEntity};
use serde_json::json;
use slate_blackboard::interface::Value;
use slate_control::ControlSurface;
use slate_record::ros::{Schema, encode_json};

use super::{NodeTopic, write};
use crate::error::RosError;
use crate::outbound::date;
use crate::participant::{RosParticipant, TopicWriter};
use crate::quality::TopicQuality;
use crate::settings::RosSettings;

const TOPIC: &str = "/rosout";
const MESSAGE: &str = "rcl_interfaces/msg/Log";
/// Late listeners receive the last lines.
const QUALITY: TopicQuality = TopicQuality { reliable: true, transient_local: true, depth: 100 };
const DEFINITION: &str = "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line";
const SECOND: u64 = 1_000_000_000;

/// The last lines of the log.
const TAIL: &str = "log/tail";

/// `/rosout`: each line of the log, with the name of its module.
pub struct LogTopic {
    writer: TopicWriter,
    schema: Schema,
    node: String,
    /// Number of the line that was sent last.
    sent: u64,
}

impl LogTopic {
    pub fn open(participant: &RosParticipant, settings: &RosSettings) -> Result<Self, RosError> {
        let schema =
            Schema::parse(MESSAGE, DEFINITION).map_err(|error| RosError::name(MESSAGE, error.to_string()))?;
        let writer = participant.writer(TOPIC, MESSAGE, QUALITY)?;
        Ok(Self { writer, schema, node: settings.node.name.clone(), sent: 0 })
    }

    fn message(&self, line: &Value, surface: &ControlSurface) -> Result<Vec<u8>, String> {
        let text = |name: &str| line.get(name).and_then(Value::as_str).unwrap_or_default();
        let time = line.get("time").and_then(Value::as_integer).and_then(|time| u64::try_from(time).ok());
        let time = date(surface.agent.composer(), time.unwrap_or_default());
        let level = match text("level") {
            "ERROR" => 40,
            "WARN" => 30,
            "INFO" => 20,
            _ => 10,
        };
        let name = match text("module") {
            "" | "agent" => self.node.clone(),
            module => format!("{}.{}", self.node, module.replace('/', ".")),
        };
        let message = json!({
            "stamp": { "sec": time / SECOND, "nanosec": time % SECOND },
            "level": level,
            "name": name,
            "msg": text("text"),
        });
        encode_json(&self.schema, &message).map_err(|error| error.to_string())
    }
}

impl NodeTopic for LogTopic {
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        let found = surface.board().get(TAIL);
        let last = found.and_then(|(tail, _)| Some(tail.channel()?.published())).unwrap_or(0);
        if last == self.sent {
            return Ok(());
        }
        let kept = surface.board().history(TAIL).map_err(|error| error.to_string())?;
        for (line, stamp) in kept {
            if stamp.sequence > self.sent {
                self.sent = stamp.sequence;
                write(&self.writer, self.message(&line, surface)?, TOPIC)?;
            }
        }
        Ok(())
    }

    fn guids(&self) -> Vec<GUID> {
        vec![self.writer.guid()]
    }
}
