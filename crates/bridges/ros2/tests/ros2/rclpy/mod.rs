//! Agents and nodes of ROS 2 in Python, with rclpy and Fast DDS.

mod actions;
mod agent;
mod hostile;
mod lifecycle;
mod lockstep;
mod node;
mod parameters;
mod peer;
mod replay;
mod robot;
mod services;
mod topics;
mod type_hashes;
