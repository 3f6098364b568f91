//! Agents and nodes of ROS 2 in Python, with rclpy and Fast DDS.

mod agent;
mod hostile;
mod peer;
mod replay;
mod topics;
