//! Content of a domain, for tools: nodes, topics, and the messages of a topic.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use slate_dds::TopicQuality;
use slate_ros_messages::{
    Definition, DefinitionFiles, Schema, WireFormat, message_definition, transforms_definition,
};
use slate_sorted::{SortedMap, SortedSet};
use slate_topics::{RosError, type_hash};

use crate::wire::{DomainView, FoundTopic, TopicReader, WireType, explore};
use crate::wire_settings::RosWireSettings;

/// Period of the check for news.
const POLL_PERIOD: Duration = Duration::from_millis(5);

/// Messages that are kept for a tool that is slow.
const DEPTH: u16 = 1000;

/// Messages of nodes that ROS's `common_interfaces` don't have.
const OTHERS: [(&str, &str); 2] = [
    ("rosgraph_msgs/msg/Clock", "builtin_interfaces/Time clock"),
    (
        "rcl_interfaces/msg/Log",
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line",
    ),
];

/// Looks at a domain.
pub struct RosExplorer {
    view: Box<dyn DomainView>,
}

impl std::fmt::Debug for RosExplorer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RosExplorer").finish_non_exhaustive()
    }
}

impl RosExplorer {
    /// Joins a domain on a wire: on this machine, and on others if they are trusted.
    ///
    /// # Errors
    /// When the middleware refuses, has no router, or is not built in.
    pub fn join(domain: u16, wire: &RosWireSettings, trusted: bool) -> Result<Self, RosError> {
        Ok(Self { view: explore(domain, wire, trusted)? })
    }

    /// Gathers nodes and topics for this time.
    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    pub fn discover(&mut self, time: Duration) {
        let began = Instant::now();
        while began.elapsed() < time {
            self.view.take();
            std::thread::sleep(POLL_PERIOD);
        }
    }

    /// Returns the nodes by name.
    pub fn nodes(&self) -> SortedSet<String> {
        self.view.nodes()
    }

    /// Returns the topics by name, without those of services.
    pub fn topics(&self) -> SortedMap<String, FoundTopic> {
        self.view.topics()
    }

    /// Returns the services by name, with the type of each.
    pub fn services(&self) -> SortedMap<String, String> {
        self.view.services()
    }

    /// Reads an existing topic with the quality that its publishers offer.
    ///
    /// # Errors
    /// When it has no publisher, or the middleware refuses.
    pub fn subscribe(&self, topic: &str) -> Result<TopicStream, RosError> {
        let found = self.topics().remove(topic).unwrap_or_default();
        let Some(first) = found.publishers.first() else {
            return Err(RosError::definition(topic, "it has no publisher".into()));
        };
        let quality = TopicQuality {
            reliable: found.publishers.iter().all(|own| own.reliable),
            transient_local: found.publishers.iter().all(|own| own.transient_local),
            depth: DEPTH,
        };
        let of = WireType { name: first.message.clone(), hash: first.type_hash.clone() };
        let reader = self.view.reader(topic, &of, quality)?;
        Ok(TopicStream { message: of.name, reader })
    }
}

/// Messages of a topic.
pub struct TopicStream {
    message: String,
    reader: Arc<dyn TopicReader>,
}

impl std::fmt::Debug for TopicStream {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TopicStream").field("message", &self.message).finish_non_exhaustive()
    }
}

impl TopicStream {
    /// Returns the type in ROS.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Returns the next message, in CDR with its header.
    /// `None` if none arrives within `limit`.
    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    pub fn next(&self, limit: Duration) -> Option<Vec<u8>> {
        let began = Instant::now();
        loop {
            if let Ok(Some(message)) = self.reader.take() {
                return Some(message);
            }
            if began.elapsed() >= limit {
                return None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Returns the schema of its messages.
    /// It comes from the `.msg` file of a path, or else from the built-in ones.
    ///
    /// # Errors
    /// In words, when they can't be.
    pub fn schema(&self, definition: Option<&Path>) -> Result<Schema, String> {
        let own = definition_of(&self.message, definition)?;
        Schema::parse(&own.name, &own.text).map_err(|error| error.to_string())
    }
}

/// Returns the hash (`RIHS01`) of a type.
/// It comes from the `.msg` file of a path, or else from the built-in ones.
///
/// # Errors
/// The definition is invalid or not known; the reason in words.
pub fn known_type_hash(message: &str, definition: Option<&Path>) -> Result<String, String> {
    type_hash(&definition_of(message, definition)?).map_err(|error| error.to_string())
}

fn definition_of(message: &str, path: Option<&Path>) -> Result<Definition, String> {
    if let Some(path) = path {
        let files = DefinitionFiles::read(WireFormat::Cdr, path, Some(message));
        let files = files.map_err(|error| error.to_string())?;
        files.schema().map_err(|error| error.to_string())?;
        return Ok(files.definition().clone());
    }
    let other = OTHERS.iter().find(|(name, _)| *name == message);
    if let Some((name, text)) = other {
        return Ok(Definition { name: (*name).into(), text: (*text).into() });
    }
    let transforms = transforms_definition();
    let known = if message == transforms.name { Some(transforms) } else { message_definition(message) };
    known.ok_or_else(|| format!("the definition of {message} is unknown"))
}
