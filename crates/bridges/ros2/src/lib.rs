//! Topics of [ROS 2](https://docs.ros.org) as properties of an agent, both ways, over DDS.
//!
//! A [`RosSettings`] is the table `[ros2]` of a configuration, and its links with `ros2:`: inputs that read topics, and topics
//! that have the values of properties. A [`RosMessage`] is how values lie on the wire: as the message that ROS has for their interface, or else as that
//! of recordings, `slate_msgs/msg/NAME`. `RosBridge` needs the feature `dds`.
//!
//! Nothing of it runs in a tick. What comes in waits in a bounded queue; a thread takes it from there and sets the inputs, in
//! lockstep between two cycles, so that a run with ROS is repeated bit for bit from its recording.

#[cfg(feature = "dds")]
mod actions;
#[cfg(feature = "dds")]
mod bridge;
mod check;
#[cfg(feature = "dds")]
mod explorer;
#[cfg(feature = "dds")]
mod frame_inputs;
#[cfg(feature = "dds")]
mod graph;
#[cfg(feature = "dds")]
mod inbound;
#[cfg(feature = "dds")]
mod lifecycle;
mod name;
#[cfg(feature = "dds")]
mod node;
#[cfg(feature = "dds")]
mod outbound;
#[cfg(feature = "dds")]
mod parameters;
#[cfg(feature = "dds")]
mod participant;
#[cfg(feature = "dds")]
mod services;
mod settings;
#[cfg(feature = "dds")]
mod threads;

#[cfg(feature = "dds")]
pub use bridge::RosBridge;
pub use check::check_topics;
#[cfg(feature = "dds")]
pub use explorer::{FoundEndpoint, FoundTopic, RosExplorer, TopicStream, known_type_hash};
pub use name::{NodeName, check_topic, type_name, wire_topic};
pub use settings::{RosSettings, TABLE};
pub use slate_dds::TopicQuality;
pub use slate_topics::{
    ActionCall, ActionOffer, ActionType, CancelMessage, FrameInput, NodeAccess, NodeOptions, RosError,
    RosMessage, ServiceCall, ServiceOffer, ServiceType, TopicInput, TopicMisfit, TopicOutput, TopicSettings,
    TopicStatus, TopicWait, WaitPer, type_hash,
};
