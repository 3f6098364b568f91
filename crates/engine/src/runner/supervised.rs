use std::sync::Arc;

use crate::isolation::{Isolation, Supervisor};
use slate_blackboard::channel::Writer;
use slate_blackboard::interface::View;

/// What belongs to a module whose instance is in a process of its own.
pub struct Supervised {
    /// What the process is started with.
    pub isolation: Arc<Isolation>,
    /// What says when it is started again.
    pub supervisor: Supervisor,
    /// Whether its actuators stay armed when it fails.
    pub rearm: bool,
    /// Whether the main loop says when it runs, without waiting for it.
    pub is_kicked: bool,
    /// Writes `/module/process`.
    pub process: Writer,
    /// How often it was started again.
    pub restarts: u32,
    /// When that was written last.
    pub shown: u64,
}

/// `/module/process` is written this often, nanoseconds: looking takes some microseconds.
const SHOWING_PERIOD: u64 = 1_000_000_000;

impl Supervised {
    /// Writes `/module/process`, if it is time or it `changed`.
    pub(super) fn show(&mut self, now: u64, changed: bool) {
        if changed || now.saturating_sub(self.shown) >= SHOWING_PERIOD {
            self.shown = now;
            let mut process = self.isolation.account.process(self.restarts);
            // Only a recorder in lockstep may hold a writer up; the next one comes soon.
            let _ = self.process.write(View::of(&mut process).bytes(), 0, now);
        }
    }

    /// After the end of the process: how it ended and when there will be another one, in words, and whether there will.
    pub(super) fn fall(&mut self, now: u64) -> (String, bool) {
        let reason = self.isolation.account.last_end();
        match self.supervisor.failed(now) {
            Some(delay) => {
                let delay = delay / 1_000_000;
                (format!("its process {reason}; it starts anew in {delay} ms"), true)
            }
            None => (format!("its process {reason}; {}", Supervisor::limit()), false),
        }
    }
}
