//! State shared by the threads of all connections.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_blackboard::Board;
use slate_blackboard::wake::Wake;

use super::carriers::KnownCarriers;
use super::refusals::Refusals;
use super::{PeerEvent, Rights};
use crate::carrier::{Carrier, CarrierError, Link};
use crate::session::{Identity, Limits};

/// Monotonic clock of this agent, ns.
pub type Clock = Arc<dyn Fn() -> u64 + Send + Sync>;

/// Callback for events of another agent, with its name.
/// It runs in a thread of the connection to that agent, which waits for it to return.
pub type Notice = Arc<dyn Fn(&str, &PeerEvent) + Send + Sync>;

/// Identity and settings of the agent that shares.
pub(super) struct PeerContext {
    pub board: Arc<Board>,
    pub identity: Identity,
    pub clock: Clock,
    pub time: Option<Clock>,
    pub limits: Limits,
    pub rights: Rights,
    pub carriers: KnownCarriers,
    pub poll: Option<u64>,
    pub updated: Option<Arc<Wake>>,
    pub notice: Option<Notice>,
    pub refusals: Mutex<Refusals>,
    pub ended: AtomicBool,
}

impl PeerContext {
    pub fn now(&self) -> u64 {
        (self.clock)()
    }

    /// Returns the offset of the values' clock to the agent's, ns.
    pub fn clock_offset(&self) -> i64 {
        let clock_offset = |time: &Clock| time().cast_signed().wrapping_sub(self.now().cast_signed());
        self.time.as_ref().map_or(0, clock_offset)
    }

    pub fn carrier(&self, endpoint: &str) -> Result<&Arc<dyn Carrier>, CarrierError> {
        self.carriers.of(endpoint)
    }

    /// Publishes and reports a refusal.
    pub fn report_rejection(&self, agent: &str, from: &str, reason: &str) {
        let line = lock(&self.refusals).record(self.now(), from, reason);
        if let (Some(reason), Some(notice)) = (line, &self.notice) {
            notice(agent, &PeerEvent::Rejected { reason });
        }
    }
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns an error if the other end is authenticated as a different agent.
pub(super) fn impostor(link: &dyn Link, agent: &str) -> Option<String> {
    let name = link.authenticated().filter(|name| *name != agent)?;
    Some(format!("the certificate there is that of agent `{name}`, and not of agent `{agent}`"))
}
