//! Topics of other middleware as properties of an agent: what the bridges to it share.
//!
//! A topic fills an input ([`InboundTopics`]) or has the values of a property ([`OutboundTopic`]), and an inbox is a service
//! ([`InboxHandler`]). A node has frames ([`FrameMessages`], [`FrameReader`]), parameters ([`ParameterTable`]) and a log
//! ([`LogLines`]). Bridges bring names, messages and the wire. All of it runs in threads of the bridge; no tick waits for it.

mod check;
mod error;
mod frames;
mod inbound;
mod log_lines;
mod message;
mod misfit;
mod options;
mod outbound;
mod parameters;
mod published;
mod service_settings;
mod service_type;
mod services;
mod status;
mod table_reader;
mod topic_settings;

pub use check::{check_clock, check_ports, topic_input, topic_output};
pub use error::RosError;
pub use frames::{FrameMessages, FrameReader, frame_input};
pub use inbound::{InboundTopic, InboundTopics};
pub use log_lines::{LogLines, NodeLogLine};
pub use message::RosMessage;
pub use misfit::{TopicMisfit, input, output};
pub use options::{FrameInput, NodeOptions, OPTION_KEYS, ParameterAccess};
pub use outbound::{OutboundStatus, OutboundTopic, OutboundValue, date};
pub use parameters::{NodeParameter, ParameterTable, value_of};
pub use published::{PublishedTopic, TopicMessage, TopicSink, publish};
pub use service_settings::{ServiceCall, ServiceOffer, ServicesReader};
pub use service_type::ServiceType;
pub use services::{AgentOperations, FieldPairs, InboxHandler, answer_input, bytes, inbox, json, outbox};
pub use status::TopicStatus;
pub use table_reader::{KeyedValue, NameResolver, TableReader};
pub use topic_settings::{TopicInput, TopicOptions, TopicOutput, TopicSettings, link_help};
