//! Changes of parameters as `/parameter_events`.

use std::sync::Arc;

use serde_json::{Value as Json, json};
use slate_control::ControlSurface;
use slate_ros_messages::WireFormat;
use slate_topics::{MessageType, NodeParameter, ParameterTable, date};

use super::{NodeTopic, write};
use crate::parameters::MESSAGES;
use crate::settings::RosSettings;
use crate::wire::{NodeWire, TopicWriter, WireType};
use slate_dds::TopicQuality;
use slate_topics::RosError;

const TOPIC: &str = "/parameter_events";
const MESSAGE: &str = "rcl_interfaces/msg/ParameterEvent";
const QUALITY: TopicQuality = TopicQuality { reliable: true, transient_local: false, depth: 1000 };
const DEFINITION: &str = "builtin_interfaces/Time stamp\nstring node\nParameter[] new_parameters\n\
                          Parameter[] changed_parameters\nParameter[] deleted_parameters\n";
const SECOND: u64 = 1_000_000_000;

/// Topic `/parameter_events` with all changes of parameters.
pub struct ParameterEvents {
    writer: Arc<dyn TopicWriter>,
    message: MessageType,
    node: String,
    known: ParameterTable,
    /// Number of settings on the board.
    settings: u64,
}

impl ParameterEvents {
    pub fn open(
        wire: &dyn NodeWire,
        surface: &Arc<ControlSurface>,
        settings: &RosSettings,
    ) -> Result<Self, RosError> {
        let message = MessageType::parse(WireFormat::Cdr, MESSAGE, &format!("{DEFINITION}{MESSAGES}"));
        let message = message.map_err(|reason| RosError::definition(MESSAGE, reason))?;
        let space = settings.node.namespace.trim_end_matches('/');
        Ok(Self {
            writer: wire.writer(TOPIC, &WireType::from(&message), QUALITY)?,
            message,
            node: format!("{space}/{}", settings.node.name),
            known: ParameterTable::new(surface.agent.composer()),
            settings: surface.board().settings().count(),
        })
    }
}

impl NodeTopic for ParameterEvents {
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        let count = surface.board().settings().count();
        if std::mem::replace(&mut self.settings, count) == count {
            return Ok(());
        }
        let now = ParameterTable::new(surface.agent.composer());
        let message = |own: &NodeParameter| json!({ "name": own.name, "value": own.message() });
        let (mut new, mut changed) = (Vec::new(), Vec::new());
        for own in &now.0 {
            match self.known.get(&own.name) {
                None => new.push(message(own)),
                Some(known) if known.value != own.value => changed.push(message(own)),
                Some(_) => {}
            }
        }
        let is_gone = |known: &&NodeParameter| now.get(&known.name).is_none();
        let deleted: Vec<Json> =
            self.known.0.iter().filter(is_gone).map(|own| json!({ "name": own.name })).collect();
        self.known = now;
        if new.is_empty() && changed.is_empty() && deleted.is_empty() {
            return Ok(());
        }
        let time = date(surface.agent.composer(), surface.now());
        let event = json!({
            "stamp": { "sec": time / SECOND, "nanosec": time % SECOND },
            "node": self.node,
            "new_parameters": new,
            "changed_parameters": changed,
            "deleted_parameters": deleted,
        });
        write(&*self.writer, self.message.encode(&event)?, TOPIC)
    }
}
