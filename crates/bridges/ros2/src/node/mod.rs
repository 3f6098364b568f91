//! Topics that each node publishes: time, frames, log and changes of parameters.

mod clock;
mod frames;
mod log;
mod parameter_events;
mod transition_events;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_module::Level;
use slate_topics::NodeAccess;

use crate::settings::RosSettings;
use crate::wire::{NodeWire, TopicWriter};
use clock::ClockTopic;
use frames::FrameTopics;
pub use frames::{FIXED, MESSAGE, MOVING, frames_type};
use log::LogTopic;
use parameter_events::ParameterEvents;
use slate_topics::RosError;
use transition_events::TransitionEvents;

/// Period of the check whether something has changed without a notice.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Topic that a node publishes by itself.
trait NodeTopic: Send + Sync {
    /// Publishes the new values.
    ///
    /// # Errors
    /// Why it can't, in words.
    fn publish(&mut self, surface: &ControlSurface) -> Result<(), String>;

    /// Returns whether each cycle must be published, where cycles wait for nodes.
    fn is_of_cycles(&self) -> bool {
        false
    }
}

/// Topics of a node.
#[derive(Default)]
pub struct NodeTopics {
    topics: Vec<Box<dyn NodeTopic>>,
    clock: Option<Arc<dyn TopicWriter>>,
    logged: Vec<String>,
}

impl NodeTopics {
    /// Opens the topics of the settings.
    ///
    /// # Errors
    /// When the middleware refuses, or the agent has no time of its own to publish.
    pub fn open(
        wire: &dyn NodeWire,
        surface: &Arc<ControlSurface>,
        settings: &RosSettings,
    ) -> Result<Self, RosError> {
        let mut topics: Vec<Box<dyn NodeTopic>> = Vec::new();
        let (options, mut clock) = (&settings.options, None);
        if options.clock {
            let topic = ClockTopic::open(wire)?;
            clock = Some(Arc::clone(topic.writer()));
            topics.push(Box::new(topic));
        }
        if options.transforms {
            topics.push(Box::new(FrameTopics::open(wire, surface, settings)?));
        }
        if options.log {
            topics.push(Box::new(LogTopic::open(wire, settings)?));
        }
        if options.parameters == NodeAccess::Set {
            topics.push(Box::new(ParameterEvents::open(wire, surface, settings)?));
        }
        if settings.lifecycle != NodeAccess::None {
            topics.push(Box::new(TransitionEvents::open(wire, surface, settings)?));
        }
        Ok(Self { topics, clock, logged: Vec::new() })
    }

    /// Returns the writer of the time, if that is published.
    pub fn clock(&self) -> Option<&Arc<dyn TopicWriter>> {
        self.clock.as_ref()
    }

    /// Returns whether the node has no topic to publish.
    pub fn is_empty(&self) -> bool {
        self.topics.is_empty()
    }

    /// Splits off the topics of each cycle, the time and frames.
    pub fn split_off_cycles(&mut self) -> Self {
        let topics = std::mem::take(&mut self.topics);
        let (cycles, others) = topics.into_iter().partition(|topic| topic.is_of_cycles());
        self.topics = others;
        Self { topics: cycles, clock: self.clock.clone(), logged: Vec::new() }
    }

    /// Publishes the new values until the end.
    pub fn run(mut self, surface: &ControlSurface, wake: &Wake, ended: &AtomicBool) {
        while !ended.load(Ordering::Acquire) {
            self.publish(surface);
            wake.wait_timeout(IDLE_PERIOD);
        }
    }

    /// Publishes the new values.
    pub fn publish(&mut self, surface: &ControlSurface) {
        for topic in &mut self.topics {
            // The same reason is logged once.
            if let Err(reason) = topic.publish(surface)
                && !self.logged.contains(&reason)
            {
                surface.agent.composer().log(Level::Warn, &format!("ros2: {reason}"));
                self.logged.push(reason);
            }
        }
    }
}

/// Writes a message.
fn write(writer: &dyn TopicWriter, message: Vec<u8>, topic: &str) -> Result<(), String> {
    writer.write(message).map_err(|error| format!("{topic} can't be published: {error}"))
}
