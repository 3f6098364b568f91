//! Content of a domain of DDS.

use std::sync::Arc;

use rustdds::policy::{Durability, Reliability};
use rustdds::{DomainParticipantStatusEvent as Event, EndpointDescription, GUID, QosPolicies};
use slate_dds::TopicQuality;
use slate_dds::wire::{Matches, sent_type_hash};
use slate_ros_messages::{Schema, Value};
use slate_sorted::{SortedMap, SortedSet};
use slate_topics::RosError;

use super::participant::{RosDataReader, RosParticipant};
use super::topics::DdsTopicReader;
use super::{WORDS, graph};
use crate::name::{NodeName, message_name};
use crate::wire::{DomainView, FoundEndpoint, FoundTopic, TopicReader, WireType};

/// Announcements of nodes that are kept.
const DEPTH: u16 = 1000;

/// Name of the node that explores; it is not announced.
const NODE: &str = "slate_ros";

const ENTITIES: &str = "Gid gid\nNodeEntitiesInfo[] nodes\n====\nMSG: rmw_dds_common/Gid\nuint8[16] data\n====\n\
                        MSG: rmw_dds_common/NodeEntitiesInfo\nstring namespace\nstring name\nGid[] readers\nGid[] writers\n";

/// Looks at a domain.
pub struct DdsView {
    participant: RosParticipant,
    entities: RosDataReader,
    schema: Schema,
    /// Endpoints: whether each writes, and its description.
    endpoints: SortedMap<GUID, (bool, EndpointDescription)>,
    /// Nodes by endpoint, and all of them by participant.
    nodes: SortedMap<GUID, String>,
    all_nodes: SortedMap<Vec<u8>, SortedSet<String>>,
}

impl DdsView {
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
        let (endpoints, nodes, all_nodes) = (SortedMap::new(), SortedMap::new(), SortedMap::new());
        Ok(Self { participant, entities, schema, endpoints, nodes, all_nodes })
    }

    fn note(&mut self, message: &Value) {
        let mut names = SortedSet::new();
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
}

impl DomainView for DdsView {
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

    fn nodes(&self) -> SortedSet<String> {
        self.all_nodes.values().flatten().cloned().collect()
    }

    fn topics(&self) -> SortedMap<String, FoundTopic> {
        let mut topics: SortedMap<String, FoundTopic> = SortedMap::new();
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

    fn services(&self) -> SortedMap<String, String> {
        let mut services = SortedMap::new();
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

    fn reader(
        &self,
        topic: &str,
        of: &WireType,
        quality: TopicQuality,
    ) -> Result<Arc<dyn TopicReader>, RosError> {
        let reader = self.participant.reader(topic, &of.name, quality)?;
        Ok(Arc::new(DdsTopicReader { reader, matches: Arc::new(Matches::new(WORDS)) }))
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
