//! Agents and programs on the wire of `rmw_zenoh`: in Python with zenoh-ros2-sdk, through a router of eclipse-zenoh.

mod node;
mod peer;
mod replay;
mod services;
mod topics;
