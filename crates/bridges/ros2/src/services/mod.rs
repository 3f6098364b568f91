//! Services of ROS: inboxes that are offered, and outboxes that call.

mod caller;
mod client;
mod server;
mod threads;

pub use caller::ServiceCaller;
pub use client::{CallContext, receiver_of};
pub use server::{ServeContext, ServiceHandler, ServiceServer, wait_for_start};
pub use threads::{ServiceGroup, ServiceThreads};
