//! Frames of the agent's robots as `/tf` and `/tf_static`.

use std::sync::Arc;

use rustdds::{GUID, RTPSEntity};
use slate_control::ControlSurface;
use slate_record::ros::WireFormat;
use slate_topics::FrameMessages;

use super::{NodeTopic, write};
use crate::participant::{RosParticipant, TopicWriter};
use crate::settings::RosSettings;
use slate_dds::TopicQuality;
use slate_topics::RosError;

/// Those of ROS's own broadcasters.
pub const MOVING: (&str, TopicQuality) =
    ("/tf", TopicQuality { reliable: true, transient_local: false, depth: 100 });
/// Late listeners receive the last message of each writer, which has all fixed transforms.
pub const FIXED: (&str, TopicQuality) =
    ("/tf_static", TopicQuality { reliable: true, transient_local: true, depth: 1 });
/// The message of both.
pub const MESSAGE: &str = "tf2_msgs/msg/TFMessage";

/// Both topics.
pub struct FrameTopics {
    moving: TopicWriter,
    fixed: TopicWriter,
    messages: FrameMessages,
}

impl FrameTopics {
    pub fn open(
        participant: &RosParticipant,
        surface: &Arc<ControlSurface>,
        settings: &RosSettings,
    ) -> Result<Self, RosError> {
        Ok(Self {
            moving: participant.writer(MOVING.0, MESSAGE, MOVING.1)?,
            fixed: participant.writer(FIXED.0, MESSAGE, FIXED.1)?,
            messages: FrameMessages::new(WireFormat::Cdr, surface, &settings.options.frames),
        })
    }
}

impl NodeTopic for FrameTopics {
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        let [moving, fixed] = self.messages.take(surface)?;
        moving.map_or(Ok(()), |message| write(&self.moving, message, MOVING.0))?;
        fixed.map_or(Ok(()), |message| write(&self.fixed, message, FIXED.0))
    }

    fn is_of_cycles(&self) -> bool {
        true
    }

    fn guids(&self) -> Vec<GUID> {
        vec![self.moving.guid(), self.fixed.guid()]
    }
}
