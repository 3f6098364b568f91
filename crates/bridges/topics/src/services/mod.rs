//! Inboxes as services, and messages of outboxes as requests.

mod fit;
mod inbox;
mod operations;

pub use fit::{FieldPairs, answer_input, bytes, check_services, inbox, json, outbox};
pub use inbox::InboxHandler;
pub use operations::AgentOperations;
