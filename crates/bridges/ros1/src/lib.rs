//! Agent as a node of [ROS 1](https://wiki.ros.org).
//! Topics, services, parameters and frames, both ways.
//!
//! A [`Ros1Settings`] is the table `[ros1]` of a configuration and its links with `ros1:`. A [`RosMessage`] is how values lie on
//! the wire: as the message that ROS has for their interface, or else as `slate_msgs/NAME`. `Ros1Bridge` needs the feature
//! `tcpros`.
//!
//! Nothing of it runs in a tick. What comes in waits in a bounded queue; a thread takes it from there and sets the inputs, in
//! lockstep between two cycles, so that a run with ROS is repeated bit for bit from its recording.

#[cfg(feature = "tcpros")]
mod bridge;
mod check;
mod checksum;
#[cfg(feature = "tcpros")]
mod frame_inputs;
#[cfg(feature = "tcpros")]
mod input_list;
mod name;
#[cfg(feature = "tcpros")]
mod node_topics;
#[cfg(feature = "tcpros")]
mod outbound;
#[cfg(feature = "tcpros")]
mod parameters;
#[cfg(feature = "tcpros")]
mod services;
mod settings;
#[cfg(feature = "tcpros")]
mod wire;

#[cfg(feature = "tcpros")]
pub use bridge::Ros1Bridge;
pub use check::check_topics;
pub use checksum::{message_checksum, service_checksum};
pub use name::{check_name, node_of_agent};
pub use settings::{Ros1Settings, SCHEME, TopicQueue};
pub use slate_topics::{RosError, RosMessage, TopicInput, TopicOutput, TopicSettings};
