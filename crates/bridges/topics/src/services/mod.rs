//! Inboxes as services, and messages of outboxes as requests.

mod actions;
mod fit;
mod inbox;
mod operations;

pub use actions::{CallingPorts, OfferedPorts, check_actions};
pub use fit::{FieldPairs, FittingPort, NamedPort, answer_input, bytes, check_services, inbox, json, outbox};
pub use inbox::InboxHandler;
pub use operations::AgentOperations;
