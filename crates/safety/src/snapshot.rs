//! Handover of a gate between processes: snapshot and restore.

use serde::{Deserialize, Serialize};
use slate_module::{Priority, blackboard::bytes};

use crate::gate::Lease;
use crate::stop::stopped;
use crate::{Gate, RefusalReason};

/// State of a gate, without its configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GateSnapshot {
    /// Command of the lease's holder, within limits.
    #[serde(with = "bytes")]
    pub command: Vec<u8>,
    /// Lease on the actuator.
    pub lease: Option<LeaseSnapshot>,
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
pub struct LeaseSnapshot {
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
    pub fn snapshot(&self) -> GateSnapshot {
        let lease = self.lease.as_ref().map(|lease| LeaseSnapshot {
            commander: lease.commander,
            priority: lease.priority as u32,
            renewed: lease.renewed,
            commanding: lease.commanding,
        });
        GateSnapshot {
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
    pub fn fits(&self, saved: &GateSnapshot) -> bool {
        saved.command.len() == self.command.len() && saved.limits.len() == self.configuration.bounds.len()
    }

    /// Restores a state; returns false, without a change, if it does not fit.
    ///
    /// Stops of both states hold. The gate is disarmed, unless it was armed, is not stopped, and `rearm` permits it; then it has its lease
    /// again.
    pub fn restore(&mut self, saved: &GateSnapshot, rearm: bool) -> bool {
        if !self.fits(saved) {
            return false;
        }
        self.disarm();
        self.command.clone_from(&saved.command);
        self.given_at = saved.given_at;
        (self.passed, self.limited) = (saved.passed, saved.limited);
        (self.refused, self.expired) = (saved.refused, saved.expired);
        self.last_refusal = RefusalReason(saved.last_refusal);
        for (bound, memory) in self.configuration.bounds.iter_mut().zip(&saved.limits) {
            bound.remember(*memory);
        }
        if let Some(reason) = &saved.stop {
            self.stop.get_or_insert_with(|| reason.clone());
        }
        let word = self.configuration.stop_latch.word();
        if rearm && saved.armed && self.stop.is_none() && !stopped(word) {
            self.armed = Some(word);
            self.lease = saved.lease.as_ref().map(|lease| Lease {
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
