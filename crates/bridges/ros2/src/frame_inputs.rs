//! Transforms of `/tf` and `/tf_static` as values of inputs.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::{Duration, SystemTime};

use rustdds::GUID;
use serde_json::{Value as Json, json};
use slate_blackboard::interface::Interface;
use slate_blackboard::wake::Wake;
use slate_interfaces::Transform;
use slate_module::Level;
use slate_record::ros::{Schema, transforms_definition};
use slate_runtime::Composer;

use crate::check::check_frame;
use crate::error::RosError;
use crate::inbound::{InboundTopic, InboundTopics, ReaderWaker};
use crate::matches::OwnEndpoint;
use crate::message::RosMessage;
use crate::name::{type_name, wire_topic};
use crate::node::{FIXED, MESSAGE, MOVING};
use crate::options::FrameInput;
use crate::participant::{RosParticipant, TopicReader};
use crate::quality::TopicQuality;
use crate::services::bytes;
use crate::settings::{RosSettings, TopicInput};

/// How long the thread sleeps when nothing comes.
const PAUSE: Duration = Duration::from_millis(100);
/// As ROS's listeners have it; of each writer, the last messages.
const DEPTH: u16 = 100;
const SECOND: u64 = 1_000_000_000;

/// Inputs that read transforms.
pub struct FrameInputs {
    composer: Composer,
    schema: Schema,
    /// Child frame, and place of the input among those that the bridge sets.
    frames: Vec<(String, usize)>,
    /// Whether it is that of fixed transforms.
    readers: Vec<(TopicReader, bool)>,
    told: Vec<String>,
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
        let definition = transforms_definition();
        let schema = Schema::parse(&definition.name, &definition.text);
        let schema = schema.map_err(|error| RosError::name(&definition.name, error.to_string()))?;
        let mut frames = Vec::new();
        for own in &settings.options.frames {
            let property = check_frame(composer, own)?;
            let FrameInput { input, frame, place } = own;
            property.set_external(&format!("ros2:{}", MOVING.0));
            let quality = TopicQuality { depth: DEPTH, ..MOVING.1 };
            let topic = MOVING.0.to_owned();
            let own = TopicInput { input: input.clone(), topic, quality, place: *place };
            frames.push((frame.clone(), inputs.len()));
            inputs.push(InboundTopic::new(own, RosMessage::of(property.descriptor()), 0));
        }
        let mut readers = Vec::new();
        for ((topic, quality), is_fixed) in [(MOVING, false), (FIXED, true)] {
            let quality = TopicQuality { depth: DEPTH, ..quality };
            readers.push((participant.reader(topic, MESSAGE, quality)?, is_fixed));
        }
        Ok(Some(Self { composer: composer.clone(), schema, frames, readers, told: Vec::new() }))
    }

    /// Its readers.
    pub fn guids(&self) -> Vec<GUID> {
        self.readers.iter().map(|(reader, _)| reader.guid()).collect()
    }

    /// GUIDs, topics and types of the same, for matching.
    pub fn endpoints(&self) -> impl Iterator<Item = (GUID, OwnEndpoint)> {
        self.readers.iter().map(|(reader, is_fixed)| {
            let topic = if *is_fixed { FIXED.0 } else { MOVING.0 };
            let wire = (wire_topic(topic), type_name(MESSAGE));
            (
                reader.guid(),
                OwnEndpoint { topic: topic.into(), wire, message: MESSAGE.into(), is_reader: true },
            )
        })
    }

    /// Takes transforms, until the end.
    pub fn run(mut self, inbound: &InboundTopics, wake: &Arc<Wake>, ended: &AtomicBool) {
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
                if let Err(reason) = self.take(&message.0, is_fixed, inbound)
                    && !self.told.contains(&reason)
                {
                    let text = format!("ros2: a transform does not fit: {reason}");
                    self.composer.log(Level::Warn, &text);
                    self.told.push(reason);
                }
            }
            wake.wait_timeout(PAUSE);
        }
    }

    fn take(&self, message: &[u8], is_fixed: bool, inbound: &InboundTopics) -> Result<(), String> {
        let message = self.schema.decode(message).map_err(|error| error.to_string())?;
        let message = serde_json::to_value(message).map_err(|error| error.to_string())?;
        for told in message["transforms"].as_array().into_iter().flatten() {
            let child = frame(&told["child_frame_id"]);
            let Some((_, place)) = self.frames.iter().find(|(name, _)| *name == child) else { continue };
            let stamp = &told["header"]["stamp"];
            let seconds = stamp["sec"].as_u64().unwrap_or_default();
            let time =
                seconds.saturating_mul(SECOND).saturating_add(stamp["nanosec"].as_u64().unwrap_or_default());
            let transform = &told["transform"];
            let value = json!({
                "time": self.agent_time(time),
                "parent": frame(&told["header"]["frame_id"]),
                "child": child,
                "translation": transform["translation"],
                "rotation": transform["rotation"],
                "fixed": is_fixed,
            });
            let shape = Transform::DESCRIPTOR.shape(0);
            inbound.push(*place, bytes(Transform::DESCRIPTOR, shape, &value)?);
        }
        Ok(())
    }

    /// The agent's time of a stamp: in lockstep both are that of the simulation.
    fn agent_time(&self, stamp: u64) -> u64 {
        if self.composer.is_lockstep() {
            return stamp;
        }
        let now = self.composer.now();
        let date = self.composer.date_of(now).duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let age = u64::try_from(date.as_nanos()).unwrap_or(u64::MAX).saturating_sub(stamp);
        now.saturating_sub(age)
    }
}

/// A frame's name without the slash that old programs begin it with.
fn frame(name: &Json) -> &str {
    name.as_str().unwrap_or_default().trim_start_matches('/')
}
