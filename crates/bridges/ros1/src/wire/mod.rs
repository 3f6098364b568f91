//! The wire of ROS 1: XML-RPC with the master and nodes, and TCPROS for topics and services.

mod api;
mod header;
mod http;
mod master;
mod node;
mod publication;
mod service;
mod subscription;
mod xml;

pub use master::CallError;
pub use node::{NodeParts, RosNode};
pub use publication::Publication;
pub use service::{ServiceServer, call_service};
pub use subscription::Subscription;
pub use xml::XmlValue;
