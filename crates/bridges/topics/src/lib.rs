//! Common parts of the bridges: topics of other middleware as properties.
//!
//! A topic fills an input ([`InboundTopics`]) or has the values of a property ([`OutboundTopic`]), and an inbox is a service
//! ([`InboxHandler`]). A node has frames ([`FrameMessages`], [`FrameReader`]), parameters ([`ParameterTable`]) and a log
//! ([`LogLines`]). Bridges bring names, messages and the wire. All of it runs in threads of the bridge; no tick waits for it,
//! but in lockstep cycles wait for messages where the configuration says so ([`TopicWait`]).

mod action_settings;
mod action_type;
mod awaited;
mod check;
mod error;
mod frames;
mod inbound;
mod lockstep;
mod log_lines;
mod message;
mod message_type;
mod mismatch;
mod options;
mod outbound;
mod parameters;
mod published;
mod service_settings;
mod service_type;
mod services;
mod status;
mod table_reader;
mod threads;
mod topic_settings;
mod topic_wait;
mod type_hash;

pub use action_settings::{ActionCall, ActionOffer, CancelMessage};
pub use action_type::ActionType;
pub use check::{check_clock, check_ports, topic_input, topic_output};
pub use error::RosError;
pub use frames::{FrameMessages, FrameReader, frame_input};
pub use inbound::{InboundTopic, InboundTopics};
pub use lockstep::{AwaitedInput, ConnectionCount, LockstepTopics};
pub use log_lines::{LogLines, NodeLogLine};
pub use message::RosMessage;
pub use message_type::MessageType;
pub use mismatch::{TopicMismatch, input, output};
pub use options::{FrameInput, NodeAccess, NodeOptions, OPTION_KEYS};
pub use outbound::{OutboundStatus, OutboundTopic, OutboundValue, date};
pub use parameters::{NodeParameter, ParameterTable, value_of};
pub use published::{PublishedTopic, PublishedTopics, TopicMessage, TopicSink, publish};
pub use service_settings::{ServiceCall, ServiceOffer, ServicesReader};
pub use service_type::ServiceType;
pub use services::{
    AgentOperations, CallingPorts, FieldPairs, FittingPort, InboxHandler, NamedPort, OfferedPorts,
    answer_input, bytes, check_actions, inbox, json, outbox,
};
pub use status::TopicStatus;
pub use table_reader::{KeyedValue, NameResolver, TableReader};
pub use threads::{ReaderWaker, SHUTDOWN_TIMEOUT, join_threads};
pub use topic_settings::{TopicInput, TopicOptions, TopicOutput, TopicSettings, link_help};
pub use topic_wait::{CLOCK_TOPIC, TopicWait, WaitPer};
pub use type_hash::type_hash;
