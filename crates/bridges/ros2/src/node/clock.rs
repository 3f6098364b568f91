//! Agent's time as `/clock`.

use std::sync::Arc;

use slate_control::ControlSurface;
use slate_ros_messages::WireFormat;

use super::{NodeTopic, write};
use crate::wire::{NodeWire, TopicWriter, WireType};
use slate_dds::TopicQuality;
use slate_topics::{CLOCK_TOPIC, MessageType, RosError};

const MESSAGE: &str = "rosgraph_msgs/msg/Clock";
const DEFINITION: &str = "builtin_interfaces/Time clock";
const QUALITY: TopicQuality = TopicQuality { reliable: true, transient_local: false, depth: 10 };
const SECOND: u64 = 1_000_000_000;

/// Topic `/clock` with the time of each cycle.
/// Only the newest one, when cycles follow faster than it is sent.
pub struct ClockTopic {
    writer: Arc<dyn TopicWriter>,
    sent: Option<u64>,
}

impl ClockTopic {
    pub fn open(wire: &dyn NodeWire) -> Result<Self, RosError> {
        let message = MessageType::parse(WireFormat::Cdr, MESSAGE, DEFINITION);
        let message = message.map_err(|reason| RosError::definition(MESSAGE, reason))?;
        Ok(Self { writer: wire.writer(CLOCK_TOPIC, &WireType::from(&message), QUALITY)?, sent: None })
    }

    /// Returns the writer of the topic.
    pub fn writer(&self) -> &Arc<dyn TopicWriter> {
        &self.writer
    }
}

impl NodeTopic for ClockTopic {
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        let now = surface.now();
        if self.sent.replace(now) == Some(now) {
            return Ok(());
        }
        let mut message = vec![0, 1, 0, 0];
        message.extend(((now / SECOND) as i32).to_le_bytes());
        message.extend(((now % SECOND) as u32).to_le_bytes());
        write(&*self.writer, message, CLOCK_TOPIC)
    }

    fn is_of_cycles(&self) -> bool {
        true
    }
}
