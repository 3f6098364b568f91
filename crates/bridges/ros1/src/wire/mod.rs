//! Protocols of ROS 1.
//! XML-RPC with the master and nodes, and TCPROS for topics and services.

mod api;
mod context;
mod header;
mod http;
mod master;
mod node;
mod parts;
mod publication;
mod service;
mod subscription;
mod xml;

pub use context::NodeContext;
pub use master::CallError;
pub use node::RosNode;
pub use parts::NodeParts;
pub use publication::TopicPublication;
pub use service::{RosrpcServer, call_service};
pub use subscription::TopicSubscription;
pub use xml::XmlValue;
