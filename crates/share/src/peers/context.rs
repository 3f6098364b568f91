//! What the threads of all connections use.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_blackboard::Board;
use slate_blackboard::wake::Wake;

use super::carriers::KnownCarriers;
use super::refusals::Refusals;
use super::{Happening, Rights};
use crate::carrier::{Carrier, CarrierError, Link};
use crate::session::{Identity, Limits};

/// This agent's clock, nanoseconds. It goes on steadily.
pub type Clock = Arc<dyn Fn() -> u64 + Send + Sync>;

/// Is told what happens between this agent and another one, by its name, in one of the threads of that, which goes on
/// when this returns.
pub type Notice = Arc<dyn Fn(&str, &Happening) + Send + Sync>;

/// The agent that shares, and how it does.
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

    /// What the clock of the values shows more than the agent's, nanoseconds.
    pub fn lead(&self) -> i64 {
        let lead = |time: &Clock| time().cast_signed().wrapping_sub(self.now().cast_signed());
        self.time.as_ref().map_or(0, lead)
    }

    pub fn carrier(&self, endpoint: &str) -> Result<&Arc<dyn Carrier>, CarrierError> {
        self.carriers.of(endpoint)
    }

    /// Shows and tells that somebody may not come in.
    pub fn rejected(&self, agent: &str, from: &str, reason: &str) {
        let line = locked(&self.refusals).note(self.now(), from, reason);
        if let (Some(reason), Some(notice)) = (line, &self.notice) {
            notice(agent, &Happening::Rejected { reason });
        }
    }
}

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Why whoever is at the other end is not that agent, if something proves that.
pub(super) fn impostor(link: &dyn Link, agent: &str) -> Option<String> {
    let name = link.authenticated().filter(|name| *name != agent)?;
    Some(format!("the certificate there is that of agent `{name}`, and not of agent `{agent}`"))
}
