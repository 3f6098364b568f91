//! Frames of the agent's robots as `/tf` and `/tf_static`.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rustdds::{GUID, RTPSEntity};
use slate_blackboard::Property;
use slate_control::{ControlSurface, TransformStream};
use slate_record::ros::{FrameTransform, encode_transforms};

use super::{NodeTopic, write};
use crate::error::RosError;
use crate::outbound::date;
use crate::participant::{RosParticipant, TopicWriter};
use crate::quality::TopicQuality;
use crate::settings::RosSettings;

/// Those of ROS's own broadcasters.
pub const MOVING: (&str, TopicQuality) =
    ("/tf", TopicQuality { reliable: true, transient_local: false, depth: 100 });
/// Late listeners receive the last message of each writer, which has all fixed transforms.
pub const FIXED: (&str, TopicQuality) =
    ("/tf_static", TopicQuality { reliable: true, transient_local: true, depth: 1 });
/// The message of both.
pub const MESSAGE: &str = "tf2_msgs/msg/TFMessage";

/// How often it is looked for properties that have come or gone.
const RENEW: Duration = Duration::from_secs(1);

/// Both topics.
pub struct FrameTopics {
    moving: TopicWriter,
    fixed: TopicWriter,
    stream: TransformStream,
    /// Paths of modules' transforms when the stream was made.
    known: Vec<String>,
    renewed: Instant,
    /// By child.
    all_fixed: BTreeMap<String, FrameTransform>,
    /// Modules whose transforms come from ROS.
    foreign: Vec<String>,
}

impl FrameTopics {
    #[allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]
    pub fn open(
        participant: &RosParticipant,
        surface: &Arc<ControlSurface>,
        settings: &RosSettings,
    ) -> Result<Self, RosError> {
        let module = |input: &str| input.rsplit_once('/').map(|(module, _)| format!("{module}/"));
        let foreign: Vec<_> = settings.options.frames.iter().filter_map(|own| module(&own.input)).collect();
        Ok(Self {
            moving: participant.writer(MOVING.0, MESSAGE, MOVING.1)?,
            fixed: participant.writer(FIXED.0, MESSAGE, FIXED.1)?,
            stream: TransformStream::new(surface, |property| !is_foreign(&foreign, property)),
            known: known(surface),
            renewed: Instant::now(),
            all_fixed: BTreeMap::new(),
            foreign,
        })
    }

    #[allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]
    fn renew(&mut self, surface: &ControlSurface) {
        if self.renewed.elapsed() < RENEW {
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

/// What comes from ROS does not go back there.
fn is_foreign(modules: &[String], property: &Property) -> bool {
    modules.iter().any(|module| property.path().starts_with(module.as_str()))
}

fn known(surface: &ControlSurface) -> Vec<String> {
    // Odometry counts once it is written.
    let written = |own: &Arc<Property>| own.channel().is_some_and(|channel| channel.published() > 0);
    surface.board().properties().iter().filter(|own| written(own)).map(|own| own.path().to_owned()).collect()
}

impl NodeTopic for FrameTopics {
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String> {
        self.renew(surface);
        let (_, mut moving, mut fixed) = self.stream.take(surface);
        let composer = surface.agent.composer();
        for transform in moving.iter_mut().chain(&mut fixed) {
            transform.time = date(composer, transform.time);
        }
        if !moving.is_empty() {
            write(&self.moving, encoded(&moving)?, MOVING.0)?;
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
        if !is_known {
            let all: Vec<_> = self.all_fixed.values().cloned().collect();
            write(&self.fixed, encoded(&all)?, FIXED.0)?;
        }
        Ok(())
    }

    fn guids(&self) -> Vec<GUID> {
        vec![self.moving.guid(), self.fixed.guid()]
    }
}

fn encoded(transforms: &[FrameTransform]) -> Result<Vec<u8>, String> {
    let mut message = Vec::new();
    encode_transforms(transforms, &mut message).map_err(|error| error.to_string())?;
    Ok(message)
}
