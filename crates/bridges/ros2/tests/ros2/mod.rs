//! An agent with topics of ROS 2.

mod names;
#[cfg(feature = "external-tools")]
mod rclpy;
mod settings;
#[cfg(feature = "external-tools")]
mod zenoh;
