use std::sync::Arc;

use slate_blackboard::channel::Writer;
use slate_blackboard::interface::View;
use slate_module::Level;

use super::{ModuleCondition, Runner};
use crate::isolation::{Isolation, Proxy, Supervisor};

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

impl Runner {
    /// Whether there is an instance: an isolated one may have ended between two ticks, or may have to be made anew.
    pub(super) fn is_up(&mut self, now: u64) -> bool {
        let Some(supervised) = &mut self.supervised else { return true };
        if self.instance.is_null() {
            return supervised.supervisor.take_due(now) && self.rise(now);
        }
        // SAFETY: the instances of an isolated module are proxies, and this one is not in use.
        let alive = unsafe { (*self.instance.cast::<Proxy>()).is_alive() };
        if !alive {
            self.recover(now);
        }
        alive
    }

    /// After the end of an isolated instance, before anything else: its actuators wait for somebody to arm them.
    pub(super) fn disarm(&mut self, now: u64) {
        if self.supervised.as_ref().is_some_and(|supervised| !supervised.rearm) {
            for (actuator, _) in self.outputs.iter().filter_map(|output| output.actuator.as_ref()) {
                actuator.disarm(now);
                let name = actuator.name();
                self.log.write(
                    Level::Error,
                    &format!("its actuator {name} is disarmed: `slate arm` lets it go on"),
                );
            }
        }
    }

    /// After the end of an isolated instance: says how it ended and when there will be another one.
    pub(super) fn fall(&mut self, now: u64) {
        let Some(supervised) = &mut self.supervised else { return };
        let reason = supervised.isolation.account.last_end();
        match supervised.supervisor.failed(now) {
            Some(delay) => {
                let delay = delay / 1_000_000;
                self.log.write(Level::Error, &format!("its process {reason}; it starts anew in {delay} ms"));
            }
            None => {
                let limit = Supervisor::limit();
                self.log.write(Level::Error, &format!("its process {reason}; {limit}"));
                self.set_condition(ModuleCondition::FAULTED, now);
            }
        }
        self.show_process(now, true);
    }

    /// Makes another instance in a process of its own.
    fn rise(&mut self, now: u64) -> bool {
        if let Some(supervised) = &mut self.supervised {
            supervised.restarts += 1;
        }
        match self.create() {
            Ok(instance) => {
                self.instance = instance;
                self.log.write(Level::Warn, "started anew in another process, with a fresh state");
                self.show_process(now, true);
                true
            }
            Err(refusal) => {
                self.log.write(Level::Error, &format!("it can't be set up again: {refusal}"));
                self.fall(now);
                false
            }
        }
    }

    /// Writes `/module/process`, if it is time or it `changed`.
    pub fn show_process(&mut self, now: u64, changed: bool) {
        let Some(supervised) = &mut self.supervised else { return };
        if changed || now.saturating_sub(supervised.shown) >= SHOWING_PERIOD {
            supervised.shown = now;
            let mut process = supervised.isolation.account.process(supervised.restarts);
            // Only a recorder in lockstep may hold a writer up; the next one comes soon.
            let _ = supervised.process.write(View::of(&mut process).bytes(), 0, now);
        }
    }
}
