//! Other agents on this agent's board.

mod carriers;
mod context;
mod dialling;
mod exchange;
mod export;
mod handle;
mod import;
mod inspection;
mod line;
mod lines;
mod listener;
mod messages;
mod peer;
mod refusals;
mod rights;
mod state;

use slate_blackboard::interface::Descriptor;

pub(crate) use carriers::KnownCarriers;
pub(crate) use context::locked;
pub use context::{Clock, Notice};
pub use handle::{Notifier, PeerError, Peers, Setup};
pub use import::Status;
pub use peer::Peer;
pub use refusals::Rejected;
pub use rights::{Allowance, Rights};
pub use slate_runtime::sharing::RemoteProperty;
pub use state::{PeerState, ReadState, ServedState};

use crate::session::{DeliveryStatus, Options};

/// A property of another agent that is wanted here.
#[derive(Clone, Debug)]
pub struct Want {
    /// Its path in the other agent.
    pub path: String,
    /// How it is to be served.
    pub options: Options,
    /// What it has to be, where that is known: then the mirror is there before the other agent is.
    pub expected: Option<&'static Descriptor>,
    /// Room in the mirror's tail, for a mirror that is made before the other agent is there.
    pub capacity: usize,
    /// How many values the mirror keeps at least.
    pub depth: usize,
}

impl Want {
    /// Whatever is at that path.
    pub fn new(path: &str, options: Options) -> Self {
        Self { path: path.into(), options, expected: None, capacity: 0, depth: 1 }
    }

    /// A property of that interface; its tail has room for `capacity` items.
    #[must_use]
    pub fn expect(self, descriptor: &'static Descriptor, capacity: usize) -> Self {
        Self { expected: Some(descriptor), capacity, ..self }
    }

    /// The mirror keeps that many values.
    #[must_use]
    pub fn depth(self, depth: usize) -> Self {
        Self { depth, ..self }
    }
}

/// What happens between this agent and another one, for whoever is interested.
#[derive(Clone, Debug)]
pub enum Happening {
    /// The other agent is there.
    Connected {
        /// Another number after each of its starts.
        instance: u64,
    },
    /// The other agent is gone.
    Disconnected {
        /// In words.
        reason: String,
    },
    /// One of both refuses the other.
    Refused {
        /// In words.
        reason: String,
    },
    /// Somebody was not let in. It was told so, and nothing else happens; of those who come again and again this is told
    /// now and then.
    Rejected {
        /// Who, as far as that is known, and why.
        reason: String,
    },
    /// A subscription of this agent brings no values, or none yet.
    Unserved {
        /// Path in the other agent.
        path: String,
        /// In words.
        reason: String,
    },
    /// A message of this agent was answered.
    Answered {
        /// The message.
        ticket: u64,
        /// How it fares.
        answer: DeliveryStatus,
    },
    /// The other agent tells something of the team's knowledge.
    Told {
        /// What it tells.
        bytes: Vec<u8>,
    },
    /// A question of this agent was answered.
    Listed {
        /// The question.
        request: u32,
        /// The properties there are, or why that is not known.
        answer: Result<Vec<RemoteProperty>, String>,
    },
}
