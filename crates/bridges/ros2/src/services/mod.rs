//! Services of ROS: their types, and messages of modules as their requests.

#[cfg(feature = "dds")]
mod client;
mod fit;
#[cfg(feature = "dds")]
mod inbox;
#[cfg(feature = "dds")]
mod operations;
#[cfg(feature = "dds")]
mod server;
#[cfg(feature = "dds")]
mod threads;

#[cfg(feature = "dds")]
pub use fit::bytes;
pub use fit::check_services;
#[cfg(feature = "dds")]
pub use operations::AgentOperations;
#[cfg(feature = "dds")]
pub use server::{ServiceHandler, ServiceServer};
#[cfg(feature = "dds")]
pub use threads::{ServiceGroup, ServiceThreads};
