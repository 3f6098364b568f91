//! Transforms of `/tf` and `/tf_static` as values of inputs.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::Duration;

use rustdds::GUID;
use slate_blackboard::wake::Wake;
use slate_record::ros::WireFormat;
use slate_runtime::Composer;
use slate_topics::{FrameReader, InboundTopic, InboundTopics, frame_input};

use crate::name::{type_name, wire_topic};
use crate::node::{FIXED, MESSAGE, MOVING};
use crate::participant::{RosParticipant, TopicReader};
use crate::settings::{RosSettings, TABLE};
use slate_dds::TopicQuality;
use slate_dds::wire::OwnEndpoint;
use slate_dds::wire::ReaderWaker;
use slate_topics::RosError;

/// How long the thread sleeps when nothing comes.
const IDLE_PERIOD: Duration = Duration::from_millis(100);
/// As ROS's listeners have it; of each writer, the last messages.
const DEPTH: u16 = 100;

/// Inputs that read transforms.
pub struct FrameInputs {
    reader: FrameReader,
    /// Whether it is that of fixed transforms.
    readers: Vec<(TopicReader, bool)>,
}

impl FrameInputs {
    /// Reads both topics, if an input wants that; the inputs are appended to `inputs`.
    ///
    /// # Errors
    /// When an input does not hold a transform, or DDS refuses.
    pub fn open(
        participant: &RosParticipant,
        composer: &Composer,
        settings: &RosSettings,
        inputs: &mut Vec<InboundTopic>,
    ) -> Result<Option<Self>, RosError> {
        if settings.options.frames.is_empty() {
            return Ok(None);
        }
        let mut frames = Vec::new();
        for own in &settings.options.frames {
            let property = frame_input(composer, own)?;
            property.set_external(&format!("{TABLE}:{}", MOVING.0));
            frames.push((own.frame.clone(), inputs.len()));
            inputs.push(InboundTopic::new(MOVING.0, MESSAGE, &own.input, &property, DEPTH.into()));
        }
        let reader = FrameReader::new(WireFormat::Cdr, composer, frames);
        let reader = reader.map_err(|reason| RosError::definition(MESSAGE, reason))?;
        let mut readers = Vec::new();
        for ((topic, quality), is_fixed) in [(MOVING, false), (FIXED, true)] {
            let quality = TopicQuality { depth: DEPTH, ..quality };
            readers.push((participant.reader(topic, MESSAGE, quality)?, is_fixed));
        }
        Ok(Some(Self { reader, readers }))
    }

    /// GUIDs, topics and types of its readers.
    pub fn endpoints(&self) -> impl Iterator<Item = (GUID, OwnEndpoint)> {
        self.readers.iter().map(|(reader, is_fixed)| {
            let topic = if *is_fixed { FIXED.0 } else { MOVING.0 };
            let wire = (wire_topic(topic), type_name(MESSAGE));
            (
                reader.guid(),
                OwnEndpoint {
                    topic: topic.into(),
                    wire,
                    message: MESSAGE.into(),
                    is_reader: true,
                    type_hash: None,
                },
            )
        })
    }

    /// Takes transforms, until the end.
    pub fn run(self, inbound: &InboundTopics, wake: &Arc<Wake>, ended: &AtomicBool) {
        let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(wake))));
        while !ended.load(Ordering::Acquire) {
            let mut messages = Vec::new();
            for (reader, is_fixed) in &self.readers {
                reader.drain_read_notifications();
                // Before it is looked: what comes after that wakes this thread.
                reader.set_waker(Some(waker.clone()));
                while let Ok(Some(change)) = reader.try_take_one() {
                    messages.push((change.into_value(), *is_fixed));
                }
            }
            for (message, is_fixed) in messages {
                if let Err(reason) = self.reader.take(&message.0, is_fixed, inbound) {
                    inbound.log_once(&format!("{TABLE}: a transform does not fit: {reason}"));
                }
            }
            wake.wait_timeout(IDLE_PERIOD);
        }
    }
}
