//! Wire of `rmw_zenoh`: a client of a router of Zenoh.

mod attachment;
mod connection;
mod explorer;
mod graph;
mod quality;
mod queue;
mod services;
mod session_endpoint;
mod token;
mod topics;

use std::sync::{Arc, Mutex};

use slate_dds::TopicQuality;
use slate_network::NetworkEndpoint;
use slate_runtime::Composer;
use slate_topics::{RosError, ServiceType};
use zenoh::session::ZenohId;

use super::{NodeWire, RequestReader, RequestWriter, TopicReader, TopicWriter, WireType};
use crate::name::type_name;
use crate::settings::{RosSettings, TABLE};
use connection::{NodeSession, RouterConnection};
pub use explorer::ZenohView;
use graph::Graph;
use queue::locked;
use services::{ZenohCaller, ZenohServer};
use session_endpoint::SessionEndpoint;
use token::{EndpointKind, GraphEndpoint, TokenOwner, gid};
use topics::{ZenohTopicReader, ZenohTopicWriter};

/// Quality of service of services.
const SERVICE: TopicQuality = TopicQuality { reliable: true, transient_local: false, depth: 10 };

/// Node on Zenoh.
pub struct ZenohWire {
    owner: TokenOwner,
    identity: ZenohId,
    router: NetworkEndpoint,
    composer: Composer,
    graph: Arc<Graph>,
    /// Endpoints and their tokens, until the node is announced.
    endpoints: Mutex<Vec<(String, Arc<dyn SessionEndpoint>)>>,
    connection: Mutex<Option<RouterConnection>>,
}

impl ZenohWire {
    /// Creates the node of settings; it connects when it is announced.
    pub fn open(settings: &RosSettings, router: &NetworkEndpoint, composer: &Composer) -> Self {
        let identity = ZenohId::default();
        let session = identity.to_string();
        let graph = Arc::new(Graph::new(settings.domain, &session));
        let owner = TokenOwner { domain: settings.domain, session, node: settings.node.clone() };
        let (router, composer) = (router.clone(), composer.clone());
        let (endpoints, connection) = (Mutex::default(), Mutex::default());
        Self { owner, identity, router, composer, graph, endpoints, connection }
    }

    /// Adds an endpoint that a function creates.
    /// It receives its key, its identity and the number of its other ends.
    fn add<D: SessionEndpoint + 'static>(
        &self,
        endpoint: &GraphEndpoint,
        make: impl FnOnce(String, attachment::Gid, Arc<std::sync::atomic::AtomicUsize>) -> D,
    ) -> Arc<D> {
        let mut endpoints = locked(&self.endpoints);
        // That of the node is 0.
        let token = self.owner.endpoint_token(endpoint, endpoints.len() + 1);
        let key = endpoint.key(self.owner.domain);
        let made = Arc::new(make(key, gid(&token), self.graph.add_own(endpoint)));
        endpoints.push((token, Arc::clone(&made) as Arc<dyn SessionEndpoint>));
        made
    }
}

impl NodeWire for ZenohWire {
    fn reader(
        &self,
        topic: &str,
        of: &WireType,
        quality: TopicQuality,
    ) -> Result<Arc<dyn TopicReader>, RosError> {
        let endpoint = topic_endpoint(EndpointKind::Subscription, topic, of, quality)?;
        Ok(self.add(&endpoint, |key, _, publishers| ZenohTopicReader::new(key, quality, publishers)))
    }

    fn writer(
        &self,
        topic: &str,
        of: &WireType,
        quality: TopicQuality,
    ) -> Result<Arc<dyn TopicWriter>, RosError> {
        let endpoint = topic_endpoint(EndpointKind::Publisher, topic, of, quality)?;
        Ok(self.add(&endpoint, |key, gid, subscriptions| {
            ZenohTopicWriter::new(key, gid, quality, subscriptions)
        }))
    }

    fn server(&self, service: &str, of: &ServiceType) -> Result<Box<dyn RequestReader>, RosError> {
        let endpoint = service_endpoint(EndpointKind::Server, service, of)?;
        Ok(Box::new(self.add(&endpoint, |key, _, _| ZenohServer::new(key))))
    }

    fn caller(&self, service: &str, of: &ServiceType) -> Result<Box<dyn RequestWriter>, RosError> {
        let endpoint = service_endpoint(EndpointKind::Client, service, of)?;
        Ok(Box::new(self.add(&endpoint, |key, gid, servers| ZenohCaller::new(service, key, gid, servers))))
    }

    fn announce(&self) -> Result<(), RosError> {
        let link = NodeSession {
            identity: self.identity,
            router: self.router.clone(),
            domain: self.owner.domain,
            node_token: self.owner.node_token(),
            endpoints: std::mem::take(&mut *locked(&self.endpoints)),
            graph: Arc::clone(&self.graph),
            composer: self.composer.clone(),
        };
        *locked(&self.connection) = Some(RouterConnection::start(link)?);
        Ok(())
    }

    fn check_matches(&self, composer: &Composer) {
        self.graph.log_mismatches(TABLE, composer);
    }

    fn identity(&self) -> [u8; 12] {
        let mut first = [0; 12];
        first.copy_from_slice(&self.identity.to_le_bytes()[..12]);
        first
    }
}

fn topic_endpoint(
    kind: EndpointKind,
    topic: &str,
    of: &WireType,
    quality: TopicQuality,
) -> Result<GraphEndpoint, RosError> {
    let hash = of.hash.clone().ok_or_else(|| without_hash(&of.name))?;
    Ok(GraphEndpoint { kind, name: topic.into(), type_name: type_name(&of.name), hash, quality })
}

fn service_endpoint(kind: EndpointKind, service: &str, of: &ServiceType) -> Result<GraphEndpoint, RosError> {
    let hash = of.type_hash().ok_or_else(|| without_hash(of.name()))?;
    Ok(GraphEndpoint { kind, name: service.into(), type_name: type_name(of.name()), hash, quality: SERVICE })
}

/// Creates the error of a type without a hash.
/// The key of messages has the hash of their type.
fn without_hash(name: &str) -> RosError {
    RosError::definition(name, "its definition is not complete, so it has no type hash".into())
}
