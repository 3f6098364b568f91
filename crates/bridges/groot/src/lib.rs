//! Behavior trees of an agent in Groot2 and other monitors of BehaviorTree.CPP.
//! See [Groot2](https://www.behaviortree.dev/groot).
//!
//! A [`GrootSettings`] is the table `[groot]` of a configuration, and a [`GrootBridge`] answers the requests of monitors: for
//! the tree that a Plan follows, the statuses of its nodes, and its blackboards. It only reads. Breakpoints are refused.
//!
//! The wire is that of `Groot2Publisher`: a socket REP of ZeroMQ (ZMTP 3.0, without security). It is written here, with
//! bounds on all that a client may send; the library `zeromq` makes room for any length that a client announces.
//!
//! Nothing of it runs in a tick. A Plan writes what monitors show while a request waits for it.

mod bridge;
mod error;
mod message_pack;
mod plan;
mod request;
mod settings;
mod wire;

pub use bridge::{GrootBridge, check_trees};
pub use error::GrootError;
pub use settings::{GrootSettings, ServedTrees, TABLE};
