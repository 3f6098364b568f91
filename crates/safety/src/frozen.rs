//! Handover of a gate between processes: snapshot and restore.

use serde::{Deserialize, Serialize};
use slate_module::{Priority, blackboard::bytes};

use crate::gate::Lease;
use crate::stop::stopped;
use crate::{Gate, RefusalReason};

/// State of a gate, without its configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrozenGate {
    /// Command of the lease's holder, within limits.
    #[serde(with = "bytes")]
    pub command: Vec<u8>,
    /// Lease on the actuator.
    pub lease: Option<FrozenLease>,
    /// Start time of rate limits, nanoseconds.
    pub given_at: Option<u64>,
    /// Arm state: true if the gate is armed.
    pub armed: bool,
    /// Reason of a stop of the gate or the agent.
    pub stop: Option<String>,
    /// Number of commands passed unchanged.
    pub passed: u64,
    /// Number of commands passed with a limited value.
    pub limited: u64,
    /// Number of refused commands.
    pub refused: u64,
    /// Number of commands whose time to live ended.
    pub expired: u64,
    /// Reason of the newest refusal, as its number.
    pub last_refusal: u8,
    /// Values of the newest passed command and of the actuator, for each limit.
    pub limits: Vec<(f64, f64)>,
}

/// Lease on an actuator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrozenLease {
    /// Number of the commander.
    pub commander: u32,
    /// Priority of its newest offer, as its number.
    pub priority: u32,
    /// Time of the newest offer, nanoseconds.
    pub renewed: u64,
    /// True if this offer was usable.
    pub commanding: bool,
}

impl Gate {
    /// Returns the present state.
    pub fn freeze(&self) -> FrozenGate {
        let lease = self.lease.as_ref().map(|lease| FrozenLease {
            commander: lease.commander,
            priority: lease.priority as u32,
            renewed: lease.renewed,
            commanding: lease.commanding,
        });
        FrozenGate {
            command: self.command.clone(),
            lease,
            given_at: self.given_at,
            armed: self.armed == Some(self.configuration.stop_latch.word()),
            stop: self.stop_reason(),
            passed: self.passed,
            limited: self.limited,
            refused: self.refused,
            expired: self.expired,
            last_refusal: self.last_refusal.0,
            limits: self.configuration.bounds.iter().map(|bound| bound.memory()).collect(),
        }
    }

    /// Returns whether the state fits this gate's configuration.
    pub fn fits(&self, frozen: &FrozenGate) -> bool {
        frozen.command.len() == self.command.len() && frozen.limits.len() == self.configuration.bounds.len()
    }

    /// Restores a state; returns false, without a change, if it does not fit.
    ///
    /// Stops of both states hold. The gate is disarmed, unless it was armed, is not stopped, and `rearm` permits it; then it has its lease
    /// again.
    pub fn thaw(&mut self, frozen: &FrozenGate, rearm: bool) -> bool {
        if !self.fits(frozen) {
            return false;
        }
        self.disarm();
        self.command.clone_from(&frozen.command);
        self.given_at = frozen.given_at;
        (self.passed, self.limited) = (frozen.passed, frozen.limited);
        (self.refused, self.expired) = (frozen.refused, frozen.expired);
        self.last_refusal = RefusalReason(frozen.last_refusal);
        for (bound, memory) in self.configuration.bounds.iter_mut().zip(&frozen.limits) {
            bound.remember(*memory);
        }
        if let Some(reason) = &frozen.stop {
            self.stop.get_or_insert_with(|| reason.clone());
        }
        let word = self.configuration.stop_latch.word();
        if rearm && frozen.armed && self.stop.is_none() && !stopped(word) {
            self.armed = Some(word);
            self.lease = frozen.lease.as_ref().map(|lease| Lease {
                commander: lease.commander,
                priority: priority(lease.priority),
                renewed: lease.renewed,
                commanding: lease.commanding,
            });
        }
        true
    }
}

fn priority(number: u32) -> Priority {
    match number {
        3 => Priority::Reflex,
        2 => Priority::Teleoperation,
        _ => Priority::Plan,
    }
}
