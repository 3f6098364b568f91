//! Interface between a node and its middleware.

#[cfg(feature = "dds")]
mod dds;
mod found;
#[cfg(feature = "zenoh")]
mod zenoh;

use std::sync::Arc;
use std::task::Waker;

use slate_dds::TopicQuality;
use slate_runtime::Composer;
use slate_sorted::{SortedMap, SortedSet};
use slate_topics::{MessageType, RosError, RosMessage, ServiceType};

use crate::settings::RosSettings;
use crate::wire_settings::RosWireSettings;
pub use found::{FoundEndpoint, FoundTopic};

/// Type of a topic.
#[derive(Clone, Debug)]
pub struct WireType {
    /// Type in ROS notation, such as `sensor_msgs/msg/LaserScan`.
    pub name: String,
    /// Hash by which nodes compare the type.
    pub hash: Option<String>,
}

impl From<&RosMessage> for WireType {
    fn from(message: &RosMessage) -> Self {
        Self { name: message.name().into(), hash: message.type_hash() }
    }
}

impl From<&MessageType> for WireType {
    fn from(message: &MessageType) -> Self {
        Self { name: message.name().into(), hash: message.type_hash() }
    }
}

/// Middleware of a node.
/// Opened endpoints are visible to others from [`announce`](NodeWire::announce) on.
pub trait NodeWire: Send + Sync {
    /// Reads a topic.
    ///
    /// # Errors
    /// When the middleware refuses.
    fn reader(
        &self,
        topic: &str,
        of: &WireType,
        quality: TopicQuality,
    ) -> Result<Arc<dyn TopicReader>, RosError>;

    /// Writes a topic.
    ///
    /// # Errors
    /// When the middleware refuses.
    fn writer(
        &self,
        topic: &str,
        of: &WireType,
        quality: TopicQuality,
    ) -> Result<Arc<dyn TopicWriter>, RosError>;

    /// Offers a service.
    ///
    /// # Errors
    /// When the middleware refuses.
    fn server(&self, service: &str, of: &ServiceType) -> Result<Box<dyn RequestReader>, RosError>;

    /// Calls a service.
    ///
    /// # Errors
    /// When the middleware refuses.
    fn caller(&self, service: &str, of: &ServiceType) -> Result<Box<dyn RequestWriter>, RosError>;

    /// Tells others of the node; once, when all of it is open.
    ///
    /// # Errors
    /// When the middleware refuses.
    fn announce(&self) -> Result<(), RosError>;

    /// Takes note of others that have come and gone, and logs those that can't match.
    fn check_matches(&self, composer: &Composer);

    /// Bytes that no other node has.
    fn identity(&self) -> [u8; 12];
}

/// Subscription of a topic.
pub trait TopicReader: Send + Sync {
    /// Wakes a thread at the next message.
    fn set_waker(&self, waker: &Waker);

    /// Takes the next message, in CDR with its header, if one has come.
    ///
    /// # Errors
    /// It can't be read; the reason in words.
    fn take(&self) -> Result<Option<Vec<u8>>, String>;

    /// Returns the number of messages dropped for lack of room since the last call.
    fn take_dropped(&self) -> u64;

    /// Returns the number of connected publishers.
    fn publishers(&self) -> usize;
}

/// Publisher of a topic.
pub trait TopicWriter: Send + Sync {
    /// Sends a message, in CDR with its header.
    ///
    /// # Errors
    /// The middleware refuses it; the reason in words.
    fn write(&self, message: Vec<u8>) -> Result<(), String>;

    /// Returns the number of connected subscriptions.
    fn subscriptions(&self) -> usize;

    /// Returns whether any program receives messages, even one that is not a node.
    fn has_receivers(&self) -> bool {
        self.subscriptions() > 0
    }
}

/// Server's end of a service.
pub trait RequestReader: Send + Sync {
    /// Wakes a thread at the next request.
    fn set_waker(&self, waker: &Waker);

    /// Takes the next request, if one has come.
    ///
    /// # Errors
    /// It can't be read; the reason in words.
    fn take(&self) -> Result<Option<ServiceRequest>, String>;
}

/// Request of a service.
pub struct ServiceRequest {
    /// Message in CDR with its header.
    pub message: Vec<u8>,
    /// Responder to the client.
    pub responder: Box<dyn Responder>,
}

/// Sends the response to a request.
pub trait Responder: Send + Sync {
    /// Sends the response, in CDR with its header.
    /// It may wait until the client can receive it, but not when `is_ended`.
    ///
    /// # Errors
    /// The client does not listen, or the middleware refuses; the reason in words.
    fn reply(self: Box<Self>, message: Vec<u8>, is_ended: &dyn Fn() -> bool) -> Result<(), String>;
}

/// Number of a request among those of its client.
pub type RequestNumber = i64;

/// Client's end of a service.
pub trait RequestWriter: Send + Sync {
    /// Returns whether a server is available.
    fn has_server(&self) -> bool;

    /// Sends a request, in CDR with its header; its number identifies the response.
    ///
    /// # Errors
    /// The middleware refuses it; the reason in words.
    fn send(&self, request: Vec<u8>) -> Result<RequestNumber, String>;

    /// Wakes a thread at the next response.
    fn set_waker(&self, waker: &Waker);

    /// Takes the next response and the number of its request, if one has come.
    ///
    /// # Errors
    /// It can't be read; the reason in words.
    fn take(&self) -> Result<Option<(RequestNumber, Vec<u8>)>, String>;
}

/// Connects the node of an agent as its settings say.
///
/// # Errors
/// When the middleware refuses, or this program is built without it.
pub fn open(settings: &RosSettings, composer: &Composer) -> Result<Arc<dyn NodeWire>, RosError> {
    // Each wire needs it, but not all builds have all wires.
    let _ = composer;
    match &settings.wire {
        #[cfg(feature = "dds")]
        RosWireSettings::Dds => Ok(Arc::new(dds::DdsWire::open(settings)?)),
        #[cfg(feature = "zenoh")]
        RosWireSettings::Zenoh { router } => Ok(Arc::new(zenoh::ZenohWire::open(settings, router, composer))),
        #[allow(unreachable_patterns, reason = "all wires are built in")]
        wire => Err(wire.is_missing()),
    }
}

/// View of a domain for tools.
pub trait DomainView: Send {
    /// Updates the view by added and removed entities.
    fn take(&mut self);

    /// Returns the nodes by name.
    fn nodes(&self) -> SortedSet<String>;

    /// Returns the topics by name, without those of services.
    fn topics(&self) -> SortedMap<String, FoundTopic>;

    /// Returns the services by name, with the type of each.
    fn services(&self) -> SortedMap<String, String>;

    /// Reads a topic.
    ///
    /// # Errors
    /// When the middleware refuses.
    fn reader(
        &self,
        topic: &str,
        of: &WireType,
        quality: TopicQuality,
    ) -> Result<Arc<dyn TopicReader>, RosError>;
}

/// Looks at a domain: on this machine, and on others if they are trusted.
///
/// # Errors
/// When the middleware refuses, or this program is built without it.
pub fn explore(domain: u16, wire: &RosWireSettings, trusted: bool) -> Result<Box<dyn DomainView>, RosError> {
    let _ = (domain, trusted);
    match wire {
        #[cfg(feature = "dds")]
        RosWireSettings::Dds => Ok(Box::new(dds::DdsView::join(domain, trusted)?)),
        #[cfg(feature = "zenoh")]
        RosWireSettings::Zenoh { router } => Ok(Box::new(zenoh::ZenohView::join(domain, router)?)),
        #[allow(unreachable_patterns, reason = "all wires are built in")]
        wire => Err(wire.is_missing()),
    }
}
