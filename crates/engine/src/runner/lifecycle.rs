//! Lifecycle of a module's instance: begin, end, exchange, recovery from failures.

use slate_module::{Level, ModuleKind, Refusal};

use super::status::{PANIC_LIMIT, PANIC_ROW_LENGTH};
use super::wiring::InputWiring;
use super::{ModuleCondition, ReplacedHandles, Retired, Runner, Shadow, Wiring};
use crate::isolation::Proxy;

impl Runner {
    /// Replaces the readers of the ports, from the next step on.
    /// The module must be in no step.
    pub fn rewire(&mut self, wiring: Wiring) -> ReplacedHandles {
        let Wiring { inputs, sources, groups, previous_groups, queues, outboxes, conversions, switch } =
            wiring;
        let mut replaced = ReplacedHandles::default();
        let wiring = InputWiring { inputs, sources, groups, previous_groups, conversions };
        self.inputs.rewire(wiring, &mut replaced);
        self.entries.rewire(queues, outboxes, &mut replaced);
        if let Some((reader, is_linked)) = switch {
            replaced.readers.push(self.switch.rewire(reader, is_linked));
        }
        self.update_shortcuts();
        self.schedule.set_rewired(true);
        replaced
    }

    /// Creates an instance with the present parameters.
    ///
    /// # Errors
    /// The module's refusal.
    pub fn create(&mut self) -> Result<*mut (), Refusal> {
        self.code.create(self.params.newest())
    }

    /// Acts as [`create`](Runner::create), in a thread with a timeout.
    ///
    /// # Errors
    /// The module's refusal, or that the call does not return.
    pub fn create_with_timeout(&mut self) -> Result<*mut (), Refusal> {
        self.code.create_with_timeout(self.params.newest())
    }

    /// Exchanges code and instance; returns the old ones.
    /// Failures of the old code are cleared.
    pub fn exchange(&mut self, kind: ModuleKind, instance: *mut ()) -> Retired {
        self.status.forget_panics();
        let mut is_restarting = false;
        if let Some(supervised) = &mut self.supervised {
            supervised.supervisor.forget();
            is_restarting = supervised.supervisor.is_waiting();
        }
        let last_tick = self.schedule.last_tick();
        if instance.is_null() && !is_restarting {
            // The exchange is taken back, and the old code had failed for good.
            self.set_condition(ModuleCondition::FAULTED, last_tick);
        } else if self.condition() == ModuleCondition::FAULTED {
            self.set_condition(ModuleCondition::WORKING, last_tick);
        }
        let old = self.code.exchange(kind, instance);
        self.services.withdraw(self.code.kind());
        self.services.begin(self.code.kind());
        self.write_process(last_tick, true);
        old
    }

    /// Restores the saved state of another instance in a module that has not begun yet.
    ///
    /// # Errors
    /// Why it restarts with a fresh state: the state doesn't fit, or the call does not return.
    pub fn restore(&mut self, state: &[u8]) -> Result<(), String> {
        let fits = self.code.restore(state);
        if !self.code.has_instance() {
            match self.create() {
                Ok(instance) => self.code.set_instance(instance),
                Err(refusal) => {
                    self.set_condition(ModuleCondition::FAULTED, 0);
                    self.log.write(Level::Error, &refusal.0);
                }
            }
        }
        fits
    }

    /// Starts a shadow with new code, from the next step on.
    pub fn begin_shadow(&mut self, shadow: Shadow) {
        self.shadow = Some(shadow);
        self.update_shortcuts();
    }

    /// Gives up a running step: outputs become safe, and its services are withheld.
    /// The step may still read its inputs, so they are pinned before the loop continues.
    pub fn give_up(&mut self, now: u64) {
        // SAFETY: the loop is in this step, or in one that has pinned what it reads; both are over before it continues.
        unsafe { self.set_in_turn(false) };
        self.set_condition(ModuleCondition::LATE, now);
        self.publish_safe(now);
        self.services.suspend(true);
    }

    /// Takes back a late step that has returned `code`; the module may run again.
    /// Its outputs are dropped. After a panic the module begins with a fresh state.
    pub fn reclaim(&mut self, code: i32) {
        self.services.suspend(false);
        self.outputs.reclaim_drafts();
        self.services.abandon();
        self.entries.lose_messages(&self.frame.slots);
        let last_tick = self.schedule.last_tick();
        // The process of an isolated one says by itself how it ended.
        if !(0..=2).contains(&code) && self.supervised.is_none() {
            return self.recover(last_tick);
        }
        self.set_condition(ModuleCondition::DEGRADED, last_tick);
    }

    /// Recovers from a panic: publishes safe values and makes a new instance.
    /// The new one knows of no message, so none is counted; an isolated one may also have ended long after its last
    /// step was committed.
    pub(super) fn recover(&mut self, now: u64) {
        self.services.abandon();
        // Before anything else, the actuators of an isolated one wait until they are armed.
        if self.supervised.as_ref().is_some_and(|supervised| !supervised.rearm) {
            self.outputs.disarm(&self.log, now);
        }
        self.status.count_panic(self.frame.number());
        self.set_condition(ModuleCondition::FAILED, now);
        self.publish_safe(now);
        self.retire().end_without_timeout();
        if self.supervised.is_some() {
            return self.report_exit(now);
        }
        let instance = if self.status.panics_too_often() {
            Err(format!(
                "panicked {PANIC_LIMIT} times with at most {PANIC_ROW_LENGTH} ticks in between; it stays off until its plugin is reloaded"
            ))
        } else {
            self.create().map_err(|refusal| refusal.to_string())
        };
        match instance {
            Ok(instance) => {
                self.code.set_instance(instance);
                self.log.write(Level::Error, "panicked; restarted with a fresh state");
            }
            Err(reason) => {
                self.set_condition(ModuleCondition::FAULTED, now);
                self.log.write(Level::Error, &reason);
            }
        }
    }

    /// Takes the instance out, so that it ends apart from the ports.
    /// No thread runs it: a late module is never retired.
    pub fn retire(&mut self) -> Retired {
        let retired = self.code.retire();
        self.services.withdraw(self.code.kind());
        self.services.end();
        retired
    }

    /// Returns true if an instance exists; makes a due one of an isolated module.
    /// An isolated instance may have ended between two ticks.
    pub(super) fn ensure_instance(&mut self, now: u64) -> bool {
        let Some(supervised) = &mut self.supervised else { return true };
        if !self.code.has_instance() {
            return supervised.supervisor.take_due(now) && self.restart(now);
        }
        // SAFETY: the instances of an isolated module are proxies, and this one is not in use.
        let is_alive = unsafe { (*self.code.instance().cast::<Proxy>()).is_alive() };
        if !is_alive {
            self.recover(now);
        }
        is_alive
    }

    /// Reports the end of an isolated instance, and the time of its restart.
    fn report_exit(&mut self, now: u64) {
        let Some(supervised) = &mut self.supervised else { return };
        let (text, is_restarting) = supervised.schedule_restart(now);
        self.log.write(Level::Error, &text);
        if !is_restarting {
            self.set_condition(ModuleCondition::FAULTED, now);
        }
        self.write_process(now, true);
    }

    /// Makes another instance in a process of its own.
    fn restart(&mut self, now: u64) -> bool {
        if let Some(supervised) = &mut self.supervised {
            supervised.restarts += 1;
        }
        match self.create() {
            Ok(instance) => {
                self.code.set_instance(instance);
                self.log.write(Level::Warn, "restarted in another process, with a fresh state");
                self.write_process(now, true);
                true
            }
            Err(refusal) => {
                self.log.write(Level::Error, &format!("it can't be set up again: {refusal}"));
                self.report_exit(now);
                false
            }
        }
    }

    /// Writes `/module/process`, if it is time or it `changed`.
    pub fn write_process(&mut self, now: u64, changed: bool) {
        if let Some(supervised) = &mut self.supervised {
            supervised.write(now, changed);
        }
    }
}

impl Drop for Runner {
    fn drop(&mut self) {
        drop(self.retire());
    }
}
