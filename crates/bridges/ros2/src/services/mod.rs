//! Services of ROS: inboxes that are offered, and outboxes that call.

mod caller;
mod client;
mod server;

pub use caller::ServiceCaller;
pub use client::{CallContext, ServiceClient, receiver_of};
pub use server::{DEPTH, ServeContext, ServiceGroup, ServiceHandler, ServiceServer, serve, wait_for_start};
