//! The agent's time as `/clock`.

use rustdds::{GUID, RTPSEntity};
use slate_control::ControlSurface;

use super::{NodeTopic, write};
use crate::participant::{RosParticipant, TopicWriter};
use slate_dds::TopicQuality;
use slate_topics::{CLOCK, RosError};

/// The message of `/clock`.
pub const MESSAGE: &str = "rosgraph_msgs/msg/Clock";
const QUALITY: TopicQuality = TopicQuality { reliable: true, transient_local: false, depth: 10 };
const SECOND: u64 = 1_000_000_000;

/// `/clock`: the time of each cycle, or the newest when cycles follow faster than it is sent.
pub struct ClockTopic {
    writer: TopicWriter,
    sent: Option<u64>,
}

impl ClockTopic {
    pub fn open(participant: &RosParticipant) -> Result<Self, RosError> {
        Ok(Self { writer: participant.writer(CLOCK, MESSAGE, QUALITY)?, sent: None })
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
        write(&self.writer, message, CLOCK)
    }

    fn is_of_cycles(&self) -> bool {
        true
    }

    fn guids(&self) -> Vec<GUID> {
        vec![self.writer.guid()]
    }
}
