//! Other agents on this agent's board.

mod agent_listener;
mod carriers;
mod connection;
mod connections;
mod context;
mod dialing;
mod exchange;
mod export;
mod handle;
mod import;
mod inspection;
mod messages;
mod peer;
mod refusals;
mod rights;
mod state;

use slate_blackboard::interface::Descriptor;

pub(crate) use carriers::KnownCarriers;
pub(crate) use context::lock;
pub use context::{Clock, Notice};
pub use handle::{Notifier, PeerError, Peers, Setup};
pub use import::Status;
pub use peer::Peer;
pub use refusals::Rejected;
pub use rights::{Allowance, Rights};
pub use slate_runtime::sharing::RemoteProperty;
pub use state::{PeerState, ReadState, ServedState};

use crate::session::{DeliveryStatus, Options};

/// Requested property of another agent.
#[derive(Clone, Debug)]
pub struct WantedProperty {
    /// Path in the other agent.
    pub path: String,
    /// Delivery options.
    pub options: Options,
    /// Expected interface, if known.
    /// The mirror then exists before the other agent is present.
    pub expected: Option<&'static Descriptor>,
    /// Capacity of the tail of a mirror that precedes the other agent.
    pub capacity: usize,
    /// Smallest number of values that the mirror keeps.
    pub depth: usize,
}

impl WantedProperty {
    /// Requests the property at a path, of any interface.
    pub fn new(path: &str, options: Options) -> Self {
        Self { path: path.into(), options, expected: None, capacity: 0, depth: 1 }
    }

    /// Sets the expected interface, and the capacity of its tail in items.
    #[must_use]
    pub fn expect(self, descriptor: &'static Descriptor, capacity: usize) -> Self {
        Self { expected: Some(descriptor), capacity, ..self }
    }

    /// Sets the number of values that the mirror keeps.
    #[must_use]
    pub fn depth(self, depth: usize) -> Self {
        Self { depth, ..self }
    }
}

/// Event between this agent and another one.
#[derive(Clone, Debug)]
pub enum PeerEvent {
    /// Connection of the other agent.
    Connected {
        /// Number unique to each start of the agent.
        instance: u64,
    },
    /// Loss of the connection.
    Disconnected {
        /// Reason in words.
        reason: String,
    },
    /// Refusal between this agent and the other one.
    Refused {
        /// Reason in words.
        reason: String,
    },
    /// Agent or stranger that was refused.
    /// It receives the reason, and nothing else happens. Repeated refusals are reported from time to time.
    Rejected {
        /// Identity, as far as known, and reason.
        reason: String,
    },
    /// Subscription of this agent without values, at least for now.
    Unserved {
        /// Path in the other agent.
        path: String,
        /// Reason in words.
        reason: String,
    },
    /// Answer to a message of this agent.
    Answered {
        /// The message.
        ticket: u64,
        /// Delivery status.
        answer: DeliveryStatus,
    },
    /// Message of the team's knowledge from the other agent.
    Knowledge {
        /// Message.
        bytes: Vec<u8>,
    },
    /// Answer to a question of this agent.
    Listed {
        /// The question.
        request: u32,
        /// Properties, or the reason for a failure.
        answer: Result<Vec<RemoteProperty>, String>,
    },
}
