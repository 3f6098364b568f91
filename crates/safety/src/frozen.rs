//! A gate that outlives its process: what a snapshot keeps of it, and how another gate goes on from there.

use serde::{Deserialize, Serialize};
use slate_module::{Priority, blackboard::bytes};

use crate::gate::Lease;
use crate::stop::stopped;
use crate::{Gate, RefusalReason};

/// How a gate stands, without its configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrozenGate {
    /// What the holder of the lease commands, within limits.
    #[serde(with = "bytes")]
    pub command: Vec<u8>,
    /// Who has the actuator.
    pub lease: Option<FrozenLease>,
    /// The host's time from which rate limits count, nanoseconds.
    pub given_at: Option<u64>,
    /// Whether commands pass.
    pub armed: bool,
    /// Why this gate, or the agent, is stopped.
    pub stop: Option<String>,
    /// Commands that took effect unchanged.
    pub passed: u64,
    /// Commands that took effect with a value changed.
    pub limited: u64,
    /// Commands that took no effect.
    pub refused: u64,
    /// Commands whose time to live ended before another one came.
    pub expired: u64,
    /// Why the last refused command was refused, as its number.
    pub last_refusal: u8,
    /// For each limit, the value in the command that passed last, and the one that the actuator got last.
    pub limits: Vec<(f64, f64)>,
}

/// Who has an actuator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrozenLease {
    /// The number of the commander.
    pub commander: u32,
    /// The priority of its last offer, as its number.
    pub priority: u32,
    /// When the last offer came, nanoseconds.
    pub renewed: u64,
    /// Whether that offer could be used.
    pub commanding: bool,
}

impl Gate {
    /// How the gate stands now.
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

    /// Whether a gate of this configuration can go on from there.
    pub fn fits(&self, frozen: &FrozenGate) -> bool {
        frozen.command.len() == self.command.len() && frozen.limits.len() == self.configuration.bounds.len()
    }

    /// Goes on from there; false, and nothing is changed, when that does not fit. What was stopped is stopped, and what is
    /// stopped now stays so. The gate is disarmed, unless it was armed, is not stopped, and `rearm` says that no person has
    /// to do it: then it has its lease again.
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
