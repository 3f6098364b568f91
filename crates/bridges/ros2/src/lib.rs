//! Topics of ROS 2 as properties of an agent, both ways, over DDS or Zenoh.
//! See [ROS 2](https://docs.ros.org).
//!
//! A [`RosSettings`] is the table `[ros2]` of a configuration, and its links with `ros2:`: inputs that read topics, and topics
//! that have the values of properties. A [`RosMessage`] is how values lie on the wire: as the message that ROS has for their interface, or else as that
//! of recordings, `slate_msgs/msg/NAME`. `RosBridge` needs the feature `dds` or `zenoh`, the wires that a node can have.
//!
//! Nothing of it runs in a tick. What comes in waits in a bounded queue; a thread takes it from there and sets the inputs, in
//! lockstep between two cycles, so that a run with ROS is repeated bit for bit from its recording.

#[cfg(feature = "wire")]
mod actions;
#[cfg(feature = "wire")]
mod bridge;
mod check;
#[cfg(feature = "wire")]
mod explorer;
#[cfg(feature = "wire")]
mod frame_inputs;
#[cfg(feature = "wire")]
mod inbound;
#[cfg(feature = "wire")]
mod lifecycle;
mod name;
#[cfg(feature = "wire")]
mod node;
#[cfg(feature = "wire")]
mod outbound;
#[cfg(feature = "wire")]
mod parameters;
#[cfg(feature = "wire")]
mod services;
mod settings;
#[cfg(feature = "wire")]
mod threads;
#[cfg(feature = "wire")]
mod wire;
mod wire_settings;

#[cfg(feature = "wire")]
pub use bridge::RosBridge;
pub use check::check_topics;
#[cfg(feature = "wire")]
pub use explorer::{RosExplorer, TopicStream, known_type_hash};
pub use name::{NodeName, check_topic, type_name, wire_topic};
pub use settings::{RosSettings, TABLE};
pub use slate_dds::TopicQuality;
pub use slate_topics::{
    ActionCall, ActionOffer, ActionType, CancelMessage, FrameInput, NodeAccess, NodeOptions, RosError,
    RosMessage, ServiceCall, ServiceOffer, ServiceType, TopicInput, TopicMismatch, TopicOutput,
    TopicSettings, TopicStatus, TopicWait, WaitPer, type_hash,
};
#[cfg(feature = "wire")]
pub use wire::{FoundEndpoint, FoundTopic};
pub use wire_settings::RosWireSettings;
