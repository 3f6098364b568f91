//! Frames of robots, for one client.

use slate_bag::Value;
use slate_blackboard::interface::Interface;
use slate_blackboard::{Access, Property};
use slate_interfaces::{Odometry, Transform};
use slate_ros_messages::{FrameTransform, Frames};

use crate::stream::{Sample, Watcher};
use crate::surface::ControlSurface;

/// Maximum number of reads; values of another cycle may arrive in between.
const MAX_READS: usize = 3;

/// Returns the frames of an agent's robots, from its present properties.
/// `is_included` selects the properties that count.
pub fn frames(surface: &ControlSurface, is_included: impl Fn(&Property) -> bool) -> Frames {
    let properties = surface.board().properties();
    let included = properties.iter().filter(|own| own.access() != Access::Messages && is_included(own));
    let topics: Vec<_> = included
        .map(|own| (format!("/{}", own.path()), format!("slate_msgs/msg/{}", own.descriptor().name)))
        .collect();
    Frames::new(&surface.robots, topics.iter().map(|(topic, kind)| (topic.as_str(), kind.as_str())))
}

/// Returns whether a property is a transform of a module.
pub fn is_transform(property: &Property) -> bool {
    property.descriptor().hash == Transform::DESCRIPTOR.hash
}

/// Transforms between the frames of an agent's robots, as they become known.
pub struct TransformStream {
    frames: Frames,
    watchers: Vec<TransformSource>,
}

struct TransformSource {
    topic: String,
    is_transform: bool,
    watcher: Watcher,
}

impl TransformStream {
    /// Creates the stream of an agent's transforms.
    /// Properties for which `is_included` is false are left out.
    pub fn new(surface: &ControlSurface, is_included: impl Fn(&Property) -> bool) -> Self {
        // Odometry without values is not waited for.
        let is_written = |own: &Property| own.channel().is_some_and(|channel| channel.published() > 0);
        let is_odometry = |own: &Property| own.descriptor().hash == Odometry::DESCRIPTOR.hash;
        let frames = frames(surface, |own| !is_odometry(own) || is_written(own));
        let places = frames.sources().map(|topic| (topic.to_owned(), false));
        let properties = surface.board().properties();
        let included = properties
            .iter()
            .filter(|own| is_transform(own) && is_included(own))
            .map(|own| (format!("/{}", own.path()), true));
        let source = |(topic, is_transform): (String, bool)| {
            let watcher = Watcher::new(surface, topic.trim_start_matches('/'), 0).ok()?;
            Some(TransformSource { topic, is_transform, watcher })
        };
        let watchers = places.chain(included).filter_map(source).collect();
        Self { frames, watchers }
    }

    /// Returns the time and the new transforms, first moving ones, then static ones.
    pub fn take(&mut self, surface: &ControlSurface) -> (u64, Vec<FrameTransform>, Vec<FrameTransform>) {
        let mut time = 0;
        for _ in 0..MAX_READS {
            let mut samples: Vec<(usize, Sample)> = Vec::new();
            for (place, source) in self.watchers.iter_mut().enumerate() {
                if source.watcher.has_update(surface) {
                    let taken = match source.is_transform {
                        true => source.watcher.take_all(),
                        false => source.watcher.take().map(|sample| sample.into_iter().collect()),
                    };
                    samples.extend(taken.unwrap_or_default().into_iter().map(|sample| (place, sample)));
                }
            }
            if samples.is_empty() {
                break;
            }
            samples.sort_by_key(|(_, sample)| sample.stamp.time);
            for (place, sample) in samples {
                let Some(TransformSource { topic, is_transform, .. }) = self.watchers.get(place) else {
                    continue;
                };
                time = sample.stamp.time;
                let value = Value::Json(sample.json());
                if *is_transform {
                    self.frames.note_transform(topic, time, value.transform());
                } else if let Some(pose) = value.pose() {
                    self.frames.note(topic, time, pose);
                }
            }
        }
        let (moving, fixed) = self.frames.take();
        (time, moving, fixed)
    }
}
