//! Changes of the agent's state as `~/transition_event`.

use std::sync::Arc;

use slate_control::ControlSurface;
use slate_ros_messages::WireFormat;
use slate_topics::{MessageType, RosError, date};

use super::{NodeTopic, write};
use crate::lifecycle::{AgentState, MESSAGES};
use crate::settings::RosSettings;
use crate::wire::{NodeWire, TopicWriter, WireType};
use slate_dds::TopicQuality;

const EVENT: &str = "lifecycle_msgs/msg/TransitionEvent";
const DEFINITION: &str = "uint64 timestamp\nTransition transition\nState start_state\nState goal_state\n";

/// Changes of the state as `~/transition_event`.
pub struct TransitionEvents {
    topic: String,
    writer: Arc<dyn TopicWriter>,
    message: MessageType,
    known: AgentState,
}

impl TransitionEvents {
    /// Publishes changes from now on.
    ///
    /// # Errors
    /// When the middleware refuses.
    pub fn open(
        wire: &dyn NodeWire,
        surface: &Arc<ControlSurface>,
        settings: &RosSettings,
    ) -> Result<Self, RosError> {
        let topic = settings.node.private("transition_event")?;
        let message = MessageType::parse(WireFormat::Cdr, EVENT, &format!("{DEFINITION}{MESSAGES}"));
        let message = message.map_err(|reason| RosError::definition(EVENT, reason))?;
        let writer = wire.writer(&topic, &WireType::from(&message), TopicQuality::default())?;
        Ok(Self { topic, writer, message, known: AgentState::of(surface.agent.composer()) })
    }
}

impl NodeTopic for TransitionEvents {
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        let composer = surface.agent.composer();
        let state = AgentState::of(composer);
        let before = std::mem::replace(&mut self.known, state);
        if before == state {
            return Ok(());
        }
        let mut event = before.description();
        event["timestamp"] = date(composer, surface.now()).into();
        write(&*self.writer, self.message.encode(&event)?, &self.topic)
    }
}
