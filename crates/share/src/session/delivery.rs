use serde::{Deserialize, Serialize};

/// Delivery status of a message to another agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DeliveryStatus {
    /// Arrival in the mailbox.
    Accepted,
    /// Completion by the receiver.
    Done,
    /// Refusal by the receiver, with a code that the interface defines.
    Refused(u16),
    /// Full mailbox: earlier messages are unanswered, and this one was not delivered.
    Full,
    /// Missing mailbox, or one of another interface.
    NoMailbox,
    /// Disappearance of the other agent or its mailbox; the outcome is unknown.
    Vanished,
    /// Refusal by the other agent's rights.
    Denied,
}

impl DeliveryStatus {
    /// Returns whether no other answer follows.
    pub fn is_final(self) -> bool {
        self != Self::Accepted
    }
}
