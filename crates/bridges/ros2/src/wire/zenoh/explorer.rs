//! Content of a domain on Zenoh.

use std::sync::Arc;

use slate_dds::TopicQuality;
use slate_network::NetworkEndpoint;
use slate_sorted::{SortedMap, SortedSet};
use slate_topics::RosError;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::session::ZenohId;

use super::connection::{HELP, follow, open_session};
use super::graph::Graph;
use super::session_endpoint::SessionEndpoint;
use super::token::{EndpointKind, Entity};
use super::topic_endpoint;
use super::topics::ZenohTopicReader;
use crate::name::message_name;
use crate::wire::{DomainView, FoundEndpoint, FoundTopic, TopicReader, WireType};

/// Looks at a domain; it has no node.
pub struct ZenohView {
    domain: u16,
    session: Session,
    graph: Arc<Graph>,
    _tokens: Subscriber<()>,
}

impl ZenohView {
    /// Connects to a router.
    ///
    /// # Errors
    /// When it is not reached.
    pub fn join(domain: u16, router: &NetworkEndpoint) -> Result<Self, RosError> {
        let identity = ZenohId::default();
        let session = open_session(router, identity).map_err(|error| refused(router, &error))?;
        let graph = Arc::new(Graph::new(domain, &identity.to_string()));
        let tokens = follow(&session, domain, &graph).map_err(|error| refused(router, &error))?;
        Ok(Self { domain, session, graph, _tokens: tokens })
    }
}

fn refused(router: &NetworkEndpoint, error: &dyn std::fmt::Display) -> RosError {
    let network = format!("ROS 2 can't be used through `{router}`");
    RosError::Network { network, reason: error.to_string(), help: HELP }
}

impl DomainView for ZenohView {
    fn take(&mut self) {
        // Zenoh's threads do.
    }

    fn nodes(&self) -> SortedSet<String> {
        self.graph.entities().into_iter().map(|own| own.node).collect()
    }

    fn topics(&self) -> SortedMap<String, FoundTopic> {
        let mut topics: SortedMap<String, FoundTopic> = SortedMap::new();
        for Entity { node, endpoint, .. } in self.graph.entities() {
            let Some(own) = endpoint else { continue };
            let found = FoundEndpoint {
                node: Some(node),
                message: message_name(&own.type_name),
                type_hash: Some(own.hash),
                reliable: own.quality.reliable,
                transient_local: own.quality.transient_local,
            };
            match own.kind {
                EndpointKind::Publisher => topics.entry(own.name).or_default().publishers.push(found),
                EndpointKind::Subscription => topics.entry(own.name).or_default().subscriptions.push(found),
                EndpointKind::Server | EndpointKind::Client => {}
            }
        }
        topics
    }

    fn services(&self) -> SortedMap<String, String> {
        let endpoints = self.graph.entities().into_iter().filter_map(|own| own.endpoint);
        let servers = endpoints.filter(|own| own.kind == EndpointKind::Server);
        servers.map(|own| (own.name, message_name(&own.type_name))).collect()
    }

    fn reader(
        &self,
        topic: &str,
        of: &WireType,
        quality: TopicQuality,
    ) -> Result<Arc<dyn TopicReader>, RosError> {
        let endpoint = topic_endpoint(EndpointKind::Subscription, topic, of, quality)?;
        let publishers = self.graph.add_own(&endpoint);
        let reader = ZenohTopicReader::new(endpoint.key(self.domain), quality, publishers);
        let declared = reader.declare(&self.session);
        let wrong = |error: zenoh::Error| RosError::definition(topic, error.to_string());
        declared.map(|()| Arc::new(reader) as Arc<dyn TopicReader>).map_err(wrong)
    }
}
