//! Frames of the agent's robots as `/tf` and `/tf_static`.

use std::sync::Arc;

use slate_control::ControlSurface;
use slate_ros_messages::{WireFormat, transforms_definition};
use slate_topics::{FrameMessages, type_hash};

use super::{NodeTopic, write};
use crate::settings::RosSettings;
use crate::wire::{NodeWire, TopicWriter, WireType};
use slate_dds::TopicQuality;
use slate_topics::RosError;

/// Topic of moving transforms, with the quality of ROS's own broadcasters.
pub const MOVING: (&str, TopicQuality) =
    ("/tf", TopicQuality { reliable: true, transient_local: false, depth: 100 });
/// Topic of static transforms with its quality of service.
/// Late listeners receive the last message of each writer, which has all static transforms.
pub const FIXED: (&str, TopicQuality) =
    ("/tf_static", TopicQuality { reliable: true, transient_local: true, depth: 1 });
/// Message of both topics.
pub const MESSAGE: &str = "tf2_msgs/msg/TFMessage";

/// Returns the type of transform messages.
pub fn frames_type() -> WireType {
    WireType { name: MESSAGE.into(), hash: type_hash(&transforms_definition()).ok() }
}

/// Both topics.
pub struct FrameTopics {
    moving: Arc<dyn TopicWriter>,
    fixed: Arc<dyn TopicWriter>,
    messages: FrameMessages,
}

impl FrameTopics {
    pub fn open(
        wire: &dyn NodeWire,
        surface: &Arc<ControlSurface>,
        settings: &RosSettings,
    ) -> Result<Self, RosError> {
        Ok(Self {
            moving: wire.writer(MOVING.0, &frames_type(), MOVING.1)?,
            fixed: wire.writer(FIXED.0, &frames_type(), FIXED.1)?,
            messages: FrameMessages::new(WireFormat::Cdr, surface, &settings.options.frames),
        })
    }
}

impl NodeTopic for FrameTopics {
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        let [moving, fixed] = self.messages.take(surface)?;
        moving.map_or(Ok(()), |message| write(&*self.moving, message, MOVING.0))?;
        fixed.map_or(Ok(()), |message| write(&*self.fixed, message, FIXED.0))
    }

    fn is_of_cycles(&self) -> bool {
        true
    }
}
