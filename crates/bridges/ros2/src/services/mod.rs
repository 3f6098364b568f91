//! Services of ROS: inboxes that are offered, and outboxes that call.

mod client;
mod server;
mod threads;

pub use server::{ServiceHandler, ServiceServer};
pub use threads::{ServiceGroup, ServiceThreads};
