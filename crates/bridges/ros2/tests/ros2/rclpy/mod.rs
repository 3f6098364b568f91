//! Agents and ROS 2 nodes in Python, with rclpy and Fast DDS.

pub mod actions;
pub mod agent;
mod hostile;
mod lifecycle;
mod lockstep;
mod node;
mod parameters;
pub mod peer;
mod replay;
pub mod robot;
mod services;
mod topics;
pub mod type_hashes;
