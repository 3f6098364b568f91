//! Frames of the agent as `/tf` and `/tf_static`, and of those as values of inputs.

use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use serde_json::{Value as Json, json};
use slate_blackboard::Property;
use slate_blackboard::interface::Interface;
use slate_control::{ControlSurface, TransformStream};
use slate_interfaces::Transform;
use slate_ros_messages::{
    FrameTransform, Schema, WireFormat, encode_transforms_in, transforms_definition_in,
};
use slate_runtime::{Composer, ExternalPorts, PropertyFacts};
use slate_sorted::SortedMap;

use crate::inbound::InboundTopics;
use crate::mismatch::TopicMismatch;
use crate::options::FrameInput;
use crate::outbound::date;
use crate::services::bytes;

/// Period at which added and removed properties are searched for.
const SURVEY_PERIOD: Duration = Duration::from_secs(1);

const SECOND: u64 = 1_000_000_000;

/// Returns the input that reads the transform of a frame.
///
/// # Errors
/// The input is missing, or is not a `Transform`.
pub fn frame_input<P: ExternalPorts>(ports: &P, own: &FrameInput) -> Result<P::Property, Box<TopicMismatch>> {
    let topic = format!("frame {}", own.frame);
    let property =
        crate::mismatch::input(ports, &own.input, &topic).map_err(|mismatch| mismatch.at(own.place))?;
    if property.descriptor().hash != Transform::DESCRIPTOR.hash {
        let reason = format!("the input is a {}, and a frame has a Transform", property.descriptor().name);
        let help = "name the input of a module of the kind `external_frame`";
        return Err(TopicMismatch::new(&own.input, &topic, reason, help).at(own.place));
    }
    Ok(property)
}

/// Messages of `/tf` and `/tf_static` as values of inputs.
#[derive(Debug)]
pub struct FrameReader {
    format: WireFormat,
    schema: Schema,
    composer: Composer,
    /// Child frame, and place of the input among those that the bridge sets.
    frames: Vec<(String, usize)>,
}

impl FrameReader {
    /// Creates the reader of messages of a format.
    /// Each frame has the index of its input among those of the bridge.
    ///
    /// # Errors
    /// When the message has no definition, in words.
    pub fn new(
        format: WireFormat,
        composer: &Composer,
        frames: Vec<(String, usize)>,
    ) -> Result<Self, String> {
        let definition = transforms_definition_in(format);
        let schema = Schema::parse(&definition.name, &definition.text).map_err(|error| error.to_string())?;
        Ok(Self { format, schema, composer: composer.clone(), frames })
    }

    /// Takes a message, of `/tf_static` if that is fixed.
    ///
    /// # Errors
    /// Why it is no such message, in words.
    pub fn take(&self, message: &[u8], is_fixed: bool, inbound: &InboundTopics) -> Result<(), String> {
        let message = self.schema.decode_in(self.format, message).map_err(|error| error.to_string())?;
        let message = serde_json::to_value(message).map_err(|error| error.to_string())?;
        for sent in message["transforms"].as_array().into_iter().flatten() {
            let child = frame(&sent["child_frame_id"]);
            let Some((_, place)) = self.frames.iter().find(|(name, _)| *name == child) else { continue };
            let stamp = &sent["header"]["stamp"];
            let seconds = stamp["sec"].as_u64().unwrap_or_default();
            let time =
                seconds.saturating_mul(SECOND).saturating_add(stamp["nanosec"].as_u64().unwrap_or_default());
            let transform = &sent["transform"];
            let value = json!({
                "time": self.agent_time(time),
                "parent": frame(&sent["header"]["frame_id"]),
                "child": child,
                "translation": transform["translation"],
                "rotation": transform["rotation"],
                "fixed": is_fixed,
            });
            let shape = Transform::DESCRIPTOR.shape(0);
            inbound.push(*place, bytes(Transform::DESCRIPTOR, shape, &value));
        }
        Ok(())
    }

    /// Converts a stamp to the agent's time; in lockstep both are simulation time.
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

/// Returns a frame's name without the leading slash of old programs.
fn frame(name: &Json) -> &str {
    name.as_str().unwrap_or_default().trim_start_matches('/')
}

/// Frames of the agent as messages of `/tf` and `/tf_static`.
pub struct FrameMessages {
    format: WireFormat,
    stream: TransformStream,
    /// Paths of modules' transforms when the stream was made.
    known: Vec<String>,
    renewed: Instant,
    /// Static transforms by child.
    all_fixed: SortedMap<String, FrameTransform>,
    /// Modules whose transforms come from outside.
    foreign: Vec<String>,
}

impl FrameMessages {
    /// Creates messages of a format; values of `inputs` are not sent back.
    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    pub fn new(format: WireFormat, surface: &ControlSurface, inputs: &[FrameInput]) -> Self {
        let module = |input: &str| input.rsplit_once('/').map(|(module, _)| format!("{module}/"));
        let foreign: Vec<_> = inputs.iter().filter_map(|own| module(&own.input)).collect();
        Self {
            format,
            stream: TransformStream::new(surface, |property| !is_foreign(&foreign, property)),
            known: known(surface),
            renewed: Instant::now(),
            all_fixed: SortedMap::new(),
            foreign,
        }
    }

    /// Returns the messages of new transforms: `/tf` and `/tf_static`.
    /// The latter has all static transforms.
    ///
    /// # Errors
    /// When they are more than a message can have, in words.
    pub fn take(&mut self, surface: &ControlSurface) -> Result<[Option<Vec<u8>>; 2], String> {
        self.renew(surface);
        let (_, mut moving, mut fixed) = self.stream.take(surface);
        let composer = surface.agent.composer();
        for transform in moving.iter_mut().chain(&mut fixed) {
            transform.time = date(composer, transform.time);
        }
        let before = self.all_fixed.clone();
        for transform in fixed {
            self.all_fixed.insert(transform.child.clone(), transform);
        }
        let is_same = |one: &FrameTransform, other: &FrameTransform| {
            (&one.parent, one.translation, one.rotation) == (&other.parent, other.translation, other.rotation)
        };
        let is_known =
            self.all_fixed.iter().all(|(child, own)| before.get(child).is_some_and(|old| is_same(old, own)));
        let fixed: Vec<_> = if is_known { Vec::new() } else { self.all_fixed.values().cloned().collect() };
        Ok([self.encoded(&moving)?, self.encoded(&fixed)?])
    }

    fn encoded(&self, transforms: &[FrameTransform]) -> Result<Option<Vec<u8>>, String> {
        if transforms.is_empty() {
            return Ok(None);
        }
        let mut message = Vec::new();
        let encoded = encode_transforms_in(self.format, transforms, &mut message);
        encoded.map(|()| Some(message)).map_err(|error| error.to_string())
    }

    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    fn renew(&mut self, surface: &ControlSurface) {
        if self.renewed.elapsed() < SURVEY_PERIOD {
            return;
        }
        self.renewed = Instant::now();
        let known = known(surface);
        if known != self.known {
            self.stream = TransformStream::new(surface, |property| !is_foreign(&self.foreign, property));
            self.known = known;
        }
    }
}

/// Frames from outside are not sent back.
fn is_foreign(modules: &[String], property: &Property) -> bool {
    modules.iter().any(|module| property.path().starts_with(module.as_str()))
}

fn known(surface: &ControlSurface) -> Vec<String> {
    // Odometry counts once it is written.
    let written = |own: &Arc<Property>| own.channel().is_some_and(|channel| channel.published() > 0);
    surface.board().properties().iter().filter(|own| written(own)).map(|own| own.path().to_owned()).collect()
}
