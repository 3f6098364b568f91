//! Properties between agents: a module that is linked to another agent's property does not know that it is elsewhere.
//!
//! [`session`] is the protocol of two agents.

pub mod carrier;
pub mod encoding;
pub mod peers;
pub mod schema;
pub mod session;
