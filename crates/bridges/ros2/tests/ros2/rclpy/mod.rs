//! Agents and nodes of ROS 2 in Python, with rclpy and Fast DDS.

mod actions;
pub mod agent;
mod hostile;
mod lifecycle;
mod node;
mod parameters;
pub mod peer;
mod replay;
mod robot;
mod services;
mod topics;
mod type_hashes;
