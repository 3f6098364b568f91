use serde::{Deserialize, Serialize};

/// How a message fares that was sent to another agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DeliveryStatus {
    /// It is in the mailbox.
    Accepted,
    /// The receiver has dealt with it.
    Done,
    /// The receiver refused it, for a reason that the interface defines.
    Refused(u16),
    /// The receiver has not answered the last messages; this one was not delivered.
    Full,
    /// There is no such mailbox, or it takes messages of another interface.
    NoMailbox,
    /// The other agent, or the mailbox, went away: nobody knows whether it was dealt with.
    Vanished,
    /// The other agent does not allow this one to send messages there.
    Denied,
}

impl DeliveryStatus {
    /// Whether no other answer follows.
    pub fn is_final(self) -> bool {
        self != Self::Accepted
    }
}
