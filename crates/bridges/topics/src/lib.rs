//! Topics of other middleware as properties of an agent: what the bridges to it share.
//!
//! A topic fills an input ([`InboundTopics`]) or has the values of a property ([`OutboundTopic`]). Bridges bring names, messages
//! and the wire. All of it runs in threads of the bridge; no tick waits for it.

mod inbound;
mod misfit;
mod outbound;
mod status;

pub use inbound::{InboundTopic, InboundTopics};
pub use misfit::{TopicMisfit, input, output};
pub use outbound::{OutboundStatus, OutboundTopic, OutboundValue};
pub use status::TopicStatus;
