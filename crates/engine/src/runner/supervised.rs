use std::sync::Arc;

use crate::isolation::{Isolation, Supervisor};
use slate_blackboard::channel::Writer;
use slate_blackboard::interface::View;

/// Supervision of a module whose instance is in a process of its own.
pub struct Supervised {
    /// Settings of its process.
    pub isolation: Arc<Isolation>,
    /// Restart policy.
    pub supervisor: Supervisor,
    /// True if its actuators stay armed when it fails.
    pub rearm: bool,
    /// True if the main loop signals its turns, without waiting for it.
    pub is_turn_signaled: bool,
    /// Writes `/module/process`.
    pub process: Writer,
    /// Number of restarts.
    pub restarts: u32,
    /// Time of the last write of `/module/process`, ns.
    pub written: u64,
}

/// Period of writing `/module/process`, ns.
/// Reading the values takes some microseconds.
const PROCESS_PERIOD: u64 = 1_000_000_000;

impl Supervised {
    /// Writes `/module/process`, if it is time or it `changed`.
    pub(super) fn write(&mut self, now: u64, changed: bool) {
        if changed || now.saturating_sub(self.written) >= PROCESS_PERIOD {
            self.written = now;
            let mut process = self.isolation.process_record.process(self.restarts);
            // Only a recorder in lockstep may hold a writer up; the next one comes soon.
            let _ = self.process.write(View::of(&mut process).bytes(), 0, now);
        }
    }

    /// Describes the end of the process and its restart; false if it stays off.
    pub(super) fn schedule_restart(&mut self, now: u64) -> (String, bool) {
        let reason = self.isolation.process_record.last_end();
        match self.supervisor.failed(now) {
            Some(delay) => {
                let delay = delay / 1_000_000;
                (format!("its process {reason}; it restarts in {delay} ms"), true)
            }
            None => (format!("its process {reason}; {}", Supervisor::limit()), false),
        }
    }
}
