//! Transforms of `/tf` and `/tf_static` as values of inputs.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::Duration;

use slate_blackboard::wake::Wake;
use slate_ros_messages::WireFormat;
use slate_runtime::Composer;
use slate_topics::{FrameReader, InboundTopic, InboundTopics, ReaderWaker, RosError, frame_input};

use crate::node::{FIXED, MESSAGE, MOVING, frames_type};
use crate::settings::{RosSettings, TABLE};
use crate::wire::{NodeWire, TopicReader};
use slate_dds::TopicQuality;

/// Sleep time of the thread while no messages arrive.
const IDLE_PERIOD: Duration = Duration::from_millis(100);
/// Queue size of the listeners, as in ROS; of each writer, the last messages.
const DEPTH: u16 = 100;

/// Inputs that read transforms.
pub struct FrameInputs {
    reader: FrameReader,
    /// Readers of the topics, each with a flag for static transforms.
    readers: Vec<(Arc<dyn TopicReader>, bool)>,
}

impl FrameInputs {
    /// Reads both topics, if an input wants that; the inputs are appended to `inputs`.
    ///
    /// # Errors
    /// When an input does not hold a transform, or the middleware refuses.
    pub fn open(
        wire: &dyn NodeWire,
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
            readers.push((wire.reader(topic, &frames_type(), quality)?, is_fixed));
        }
        Ok(Some(Self { reader, readers }))
    }

    /// Takes transforms, until the end.
    pub fn run(self, inbound: &InboundTopics, wake: &Arc<Wake>, ended: &AtomicBool) {
        let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(wake))));
        while !ended.load(Ordering::Acquire) {
            let mut messages = Vec::new();
            for (reader, is_fixed) in &self.readers {
                // Before it is looked: what comes after that wakes this thread.
                reader.set_waker(&waker);
                while let Ok(Some(message)) = reader.take() {
                    messages.push((message, *is_fixed));
                }
            }
            for (message, is_fixed) in messages {
                if let Err(reason) = self.reader.take(&message, is_fixed, inbound) {
                    inbound.log_once(&format!("{TABLE}: a transform does not fit: {reason}"));
                }
            }
            wake.wait_timeout(IDLE_PERIOD);
        }
    }
}
