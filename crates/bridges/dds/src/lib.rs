//! Topics of any DDS program as properties of an agent, both ways.
//! See [DDS](https://www.omg.org/spec/DDS).
//!
//! A [`DdsSettings`] is the table `[dds]` of a configuration, and its links with `dds:`: inputs that read topics, and topics that
//! have the values of properties. The type of a topic is a struct of an [`IdlFile`], whose members are the fields of the interface
//! by their names, or the message that ROS has for the interface: a [`DdsMessage`]. `DdsBridge` needs the feature `rtps`.
//!
//! Nothing of it runs in a tick. What comes in waits in a bounded queue; a thread takes it from there and sets the inputs, in
//! lockstep between two cycles, so that a run with DDS is repeated bit for bit from its recording.

#[cfg(feature = "rtps")]
mod bridge;
mod check;
mod error;
mod idl;
#[cfg(feature = "rtps")]
mod inbound;
mod message;
#[cfg(feature = "rtps")]
mod participant;
mod quality;
mod settings;
mod topic_type;
#[cfg(feature = "rtps")]
pub mod wire;

#[cfg(feature = "rtps")]
pub use bridge::DdsBridge;
pub use check::check_topics;
pub use error::DdsError;
pub use idl::{IdlEnum, IdlError, IdlFile, IdlKind, IdlMember, IdlStruct};
pub use message::{DdsMessage, IdlMessage, ros_type_name};
pub use quality::{Representation, TopicQuality};
pub use settings::{DdsSettings, TABLE};
pub use slate_topics::{TopicInput, TopicMismatch, TopicOutput, TopicStatus};
pub use topic_type::{DdsTopic, TopicType};
