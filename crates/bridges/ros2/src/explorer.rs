//! Content of a domain, for tools: nodes, topics, and the messages of a topic.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::{Duration, Instant};

use rustdds::policy::{Durability, Reliability};
use rustdds::{DomainParticipantStatusEvent as Event, EndpointDescription, GUID, QosPolicies};
use slate_record::ros::{
    Definition, DefinitionFiles, Schema, Value, WireFormat, message_definition, transforms_definition,
};

use crate::graph;
use crate::name::{NodeName, message_name};
use crate::participant::{RosParticipant, TopicReader};
use slate_dds::TopicQuality;
use slate_dds::wire::sent_type_hash;
use slate_topics::{RosError, type_hash};

/// Period of the check for news.
const POLL_PERIOD: Duration = Duration::from_millis(5);

/// Messages that are kept for a tool that is slow.
const DEPTH: u16 = 1000;

/// Name of the node that explores; it is not announced.
const NODE: &str = "slate_ros";

const ENTITIES: &str = "Gid gid\nNodeEntitiesInfo[] nodes\n====\nMSG: rmw_dds_common/Gid\nuint8[16] data\n====\n\
                        MSG: rmw_dds_common/NodeEntitiesInfo\nstring namespace\nstring name\nGid[] readers\nGid[] writers\n";

/// Messages of nodes that ROS's `common_interfaces` don't have.
const OTHERS: [(&str, &str); 2] = [
    ("rosgraph_msgs/msg/Clock", "builtin_interfaces/Time clock"),
    (
        "rcl_interfaces/msg/Log",
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line",
    ),
];

/// A publisher or a subscription in a domain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundEndpoint {
    /// The node that has it, such as `/talker`; nothing if that is not announced.
    pub node: Option<String>,
    /// The type as ROS calls it.
    pub message: String,
    /// Hash of the type, if the node sends one: nodes of Slate don't.
    pub type_hash: Option<String>,
    /// `RELIABLE`; else `BEST_EFFORT`.
    pub reliable: bool,
    /// `TRANSIENT_LOCAL`; else `VOLATILE`.
    pub transient_local: bool,
}

/// A topic in a domain.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FoundTopic {
    /// Its publishers.
    pub publishers: Vec<FoundEndpoint>,
    /// Its subscriptions.
    pub subscriptions: Vec<FoundEndpoint>,
}

/// Looks at a domain.
pub struct RosExplorer {
    participant: RosParticipant,
    entities: TopicReader,
    schema: Schema,
    /// By endpoint: whether it writes, and what it is.
    endpoints: BTreeMap<GUID, (bool, EndpointDescription)>,
    /// Nodes by endpoint, and all of them by participant.
    nodes: BTreeMap<GUID, String>,
    all_nodes: BTreeMap<Vec<u8>, BTreeSet<String>>,
}

impl std::fmt::Debug for RosExplorer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RosExplorer").field("endpoints", &self.endpoints.len()).finish_non_exhaustive()
    }
}

impl RosExplorer {
    /// Joins a domain: on this machine, and on others if they are trusted.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn join(domain: u16, trusted: bool) -> Result<Self, RosError> {
        let node = NodeName { namespace: "/".into(), name: NODE.into() };
        let participant = RosParticipant::join(domain, trusted, node)?;
        let quality = TopicQuality { reliable: true, transient_local: true, depth: DEPTH };
        let entities = participant.reader_at(graph::TOPIC.into(), graph::MESSAGE, quality)?;
        let schema = Schema::parse(graph::MESSAGE, ENTITIES);
        let schema = schema.map_err(|error| RosError::definition(graph::MESSAGE, error.to_string()))?;
        let (endpoints, nodes, all_nodes) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Ok(Self { participant, entities, schema, endpoints, nodes, all_nodes })
    }

    /// Gathers what is there, for so long.
    #[allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]
    pub fn look(&mut self, time: Duration) {
        let began = Instant::now();
        while began.elapsed() < time {
            self.take();
            std::thread::sleep(POLL_PERIOD);
        }
    }

    fn take(&mut self) {
        while let Some(event) = self.participant.next_status() {
            match event {
                Event::ReaderDetected { reader } => drop(self.endpoints.insert(reader.guid, (false, reader))),
                Event::WriterDetected { writer } => drop(self.endpoints.insert(writer.guid, (true, writer))),
                Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                    self.endpoints.remove(&guid);
                }
                Event::ParticipantLost { id, .. } => {
                    self.endpoints.retain(|guid, _| guid.prefix != id);
                    self.all_nodes.retain(|gid, _| !gid.starts_with(id.as_ref()));
                }
                _ => {}
            }
        }
        self.entities.drain_read_notifications();
        while let Ok(Some(change)) = self.entities.try_take_one() {
            // Programs before Iron have larger identities, and are not named.
            if let Ok(message) = self.schema.decode(&change.into_value().0) {
                self.note(&message);
            }
        }
    }

    fn note(&mut self, message: &Value) {
        let mut names = BTreeSet::new();
        for node in items(message, "nodes") {
            let text = |name: &str| match node.get(name) {
                Some(Value::Text(text)) => text.to_string(),
                _ => String::new(),
            };
            let name = format!("{}/{}", text("namespace").trim_end_matches('/'), text("name"));
            for gid in ["readers", "writers"].into_iter().flat_map(|list| items(node, list)) {
                if let Some(guid) = gid.get("data").and_then(guid) {
                    self.nodes.insert(GUID::from_bytes(guid), name.clone());
                }
            }
            names.insert(name);
        }
        if let Some(gid) = message.get("gid").and_then(|gid| gid.get("data")).and_then(guid) {
            self.all_nodes.insert(gid.to_vec(), names);
        }
    }

    /// The nodes by name.
    pub fn nodes(&self) -> BTreeSet<String> {
        self.all_nodes.values().flatten().cloned().collect()
    }

    /// The topics by name, without those of services.
    pub fn topics(&self) -> BTreeMap<String, FoundTopic> {
        let mut topics: BTreeMap<String, FoundTopic> = BTreeMap::new();
        for (guid, (writes, own)) in &self.endpoints {
            let Some(name) = own.topic_name.strip_prefix("rt/") else { continue };
            let topic = topics.entry(format!("/{name}")).or_default();
            let endpoint = FoundEndpoint {
                node: self.nodes.get(guid).cloned(),
                message: message_name(&own.type_name),
                type_hash: sent_type_hash(&own.user_data),
                reliable: matches!(own.qos.reliability(), Some(Reliability::Reliable { .. })),
                transient_local: is_kept(&own.qos),
            };
            if *writes { &mut topic.publishers } else { &mut topic.subscriptions }.push(endpoint);
        }
        topics
    }

    /// The services by name, with the type of each.
    pub fn services(&self) -> BTreeMap<String, String> {
        let mut services = BTreeMap::new();
        for (_, own) in self.endpoints.values().filter(|(writes, _)| !writes) {
            let name = own.topic_name.strip_prefix("rq/").and_then(|name| name.strip_suffix("Request"));
            if let Some(name) = name {
                let kind = message_name(&own.type_name);
                let kind = kind.strip_suffix("_Request").unwrap_or(&kind).to_owned();
                services.insert(format!("/{name}"), kind);
            }
        }
        services
    }

    /// Reads a topic that is there, as its publishers offer it.
    ///
    /// # Errors
    /// When it has no publisher, or DDS refuses.
    pub fn subscribe(&self, topic: &str) -> Result<TopicStream, RosError> {
        let found = self.topics().remove(topic).unwrap_or_default();
        let Some(first) = found.publishers.first() else {
            return Err(RosError::definition(topic, "nobody publishes it".into()));
        };
        let quality = TopicQuality {
            reliable: found.publishers.iter().all(|own| own.reliable),
            transient_local: found.publishers.iter().all(|own| own.transient_local),
            depth: DEPTH,
        };
        let reader = self.participant.reader(topic, &first.message, quality)?;
        Ok(TopicStream { message: first.message.clone(), reader })
    }
}

fn is_kept(quality: &QosPolicies) -> bool {
    !matches!(quality.durability(), None | Some(Durability::Volatile))
}

fn items<'v>(message: &'v Value, name: &str) -> &'v [Value] {
    match message.get(name) {
        Some(Value::List(items)) => items,
        _ => &[],
    }
}

fn guid(data: &Value) -> Option<[u8; 16]> {
    if let Value::Numbers(numbers) = data { numbers.bytes().try_into().ok() } else { None }
}

/// The messages of a topic.
pub struct TopicStream {
    message: String,
    reader: TopicReader,
}

impl std::fmt::Debug for TopicStream {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TopicStream").field("message", &self.message).finish_non_exhaustive()
    }
}

impl TopicStream {
    /// The type as ROS calls it.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The next message, in CDR with its header; nothing when none comes within `limit`.
    #[allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]
    pub fn next(&self, limit: Duration) -> Option<Vec<u8>> {
        let began = Instant::now();
        loop {
            self.reader.drain_read_notifications();
            if let Ok(Some(change)) = self.reader.try_take_one() {
                return Some(change.into_value().0);
            }
            if began.elapsed() >= limit {
                return None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// How its messages are read: by the `.msg` file of a path, or else as those that are built in.
    ///
    /// # Errors
    /// In words, when they can't be.
    pub fn schema(&self, definition: Option<&Path>) -> Result<Schema, String> {
        let own = definition_of(&self.message, definition)?;
        Schema::parse(&own.name, &own.text).map_err(|error| error.to_string())
    }
}

/// The hash of a type (`RIHS01`), of the `.msg` file of a path, or else as it is built in.
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
    known.ok_or_else(|| format!("the definition of {message} is not known here"))
}
