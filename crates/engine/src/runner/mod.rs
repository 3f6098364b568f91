//! Runner of a module: prepares its inputs, makes a step and commits its outputs.
//! Before a tick it pins the inputs and fills the frame; afterwards it checks and commits the outputs. The step in
//! between touches nothing but the frame and its own state.

mod code;
mod conversion;
mod entry_ports;
mod health;
mod inputs;
mod lifecycle;
mod outputs;
mod parameters;
mod ports;
mod requirements;
mod retired;
mod schedule;
mod services;
mod shadow;
mod slots;
mod snapshot;
mod status;
mod step_frame;
mod supervised;
mod switch;
mod timing;
mod wiring;

use std::sync::Arc;

use slate_blackboard::wake::Wake;

pub use crate::aligned_memory::AlignedMemory;
use crate::digest::Digest;
use crate::log::ModuleLog;
pub use code::{ModuleCode, StepCall, StepCode};
pub use conversion::{Conversion, Conversions, ConvertedSource};
pub use entry_ports::EntryPorts;
pub use health::{Health, count};
pub use inputs::{Group, Inputs};
pub use outputs::{Outputs, priority};
pub use parameters::ParameterReader;
pub use ports::{InboxPort, InputAge, InputPort, OutboxPort, OutputPort, QueueGauge, QueuePort};
pub use requirements::{PortName, Requirements};
pub(crate) use retired::within_create_timeout;
pub use retired::{CallTimeout, Retired, describe};
pub use schedule::TickSchedule;
pub use services::ModuleServices;
pub use shadow::{Shadow, ShadowState};
pub use slate_composition::own::{ModuleCondition, ModuleState, ModuleTiming};
pub use slate_composition::{LinkEnd, OwnSetup};
pub use slots::Slots;
pub use snapshot::RunnerSnapshot;
pub use status::RunnerStatus;
pub use step_frame::StepFrame;
pub use supervised::Supervised;
pub use switch::ModuleSwitch;
pub use timing::{Measured, StepTiming};
pub use wiring::{ConversionWiring, OutboxWiring, QueueWiring, ReplacedHandles, SourceWiring, Wiring};

/// Runner: a module with its state, ports and frame.
///
/// The fields are in this order so that all data of a step of a module with few ports share few cache lines: the time
/// of a loop with many short modules is the time of fetching their lines. Seldom needed data are behind a pointer.
#[repr(C)]
pub struct Runner {
    /// Work that its turns may skip.
    pub shortcuts: Shortcuts,
    /// Condition of the module.
    pub status: RunnerStatus,
    /// Switch of the module.
    pub switch: ModuleSwitch,
    /// Reader of its parameters.
    pub params: ParameterReader,
    /// Code and instance.
    pub code: ModuleCode,
    /// Frame of the next step.
    pub frame: StepFrame,
    /// Schedule of its ticks.
    pub schedule: TickSchedule,
    /// Timing of its steps.
    pub timing: StepTiming,
    /// Inputs.
    pub inputs: Inputs,
    /// Outputs.
    pub outputs: Outputs,
    /// Supervision of an isolated module.
    pub supervised: Option<Box<Supervised>>,
    /// Name of the module.
    pub name: Arc<str>,
    /// Log.
    pub log: Box<ModuleLog>,
    /// Queues, inboxes and outboxes.
    pub entries: EntryPorts,
    /// Services that it uses and provides.
    pub services: ModuleServices,
    /// New code beside this one.
    pub shadow: Option<Shadow>,
    /// Wakes this module's own thread, if it has one.
    pub wake: Arc<Wake>,
}

/// Work that most turns of most modules may skip.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shortcuts {
    /// True if the module was found to run.
    /// It does so until something is set, or its condition changes.
    is_steady: bool,
    /// True if it has entry ports, services or new code beside it.
    needs_preparation: bool,
    /// True if it has only inputs and outputs, and its steps need nothing else.
    has_only_values: bool,
    /// True if moreover each input is the value of a property with another writer.
    is_plain: bool,
    /// True if it has conversions, or inputs pinned at the beginning of a cycle.
    has_conversions: bool,
}

// SAFETY: the raw pointers lead to memory that the runner owns (instance, frame, slots) or that its handles keep
// alive (values), and the holder of the runner uses them alone.
unsafe impl Send for Runner {}

impl Runner {
    /// Returns the call of a step, to be made without a reference to the runner.
    /// A hung step keeps it for ever. The runner stays at its address until the step has ended.
    pub fn call(&self) -> StepCall {
        self.code.call(&raw const self.frame.frame)
    }

    /// Returns true if a step is due at `now`, ns.
    /// It takes no new values; [`prepare`](Runner::prepare) does.
    #[inline]
    pub fn is_due(&mut self, now: u64) -> bool {
        let may_run = self.is_known_enabled() || self.check_enabled(now) && self.ensure_instance(now);
        may_run && (self.schedule.is_in_every_cycle() || self.is_time(now))
    }

    #[inline]
    fn is_time(&mut self, now: u64) -> bool {
        let Self { schedule, frame, inputs, entries, shortcuts, .. } = self;
        let has_update = || {
            inputs.have_updates()
                || entries.have_updates()
                || shortcuts.has_conversions
                    && (inputs.conversions.have_updates()
                        || inputs.have_previous_updates()
                        || entries.have_previous_updates())
        };
        schedule.is_due(now, frame.number(), has_update)
    }

    /// Returns true if the module may run at `now`, ns: `enabled` is enforced here.
    #[inline]
    pub fn is_enabled(&mut self, now: u64) -> bool {
        self.is_known_enabled() || self.check_enabled(now)
    }

    #[inline]
    fn is_known_enabled(&self) -> bool {
        self.shortcuts.is_steady && self.switch.is_unchanged()
    }

    fn check_enabled(&mut self, now: u64) -> bool {
        // Two properties less to look at, which nearly never change.
        let changed = self.switch.check_settings();
        if changed {
            self.params.expect_change();
        }
        if self.switch.is_linked() && self.shortcuts.has_conversions {
            self.inputs.conversions.convert_switch();
        }
        let is_on = if changed || self.switch.is_linked() { self.switch.read() } else { self.switch.is_on() };
        // Also while it is switched off, so that it keeps no service that is no longer provided.
        let mut missing = if self.shortcuts.needs_preparation {
            self.services.missing(&mut self.frame.slots)
        } else {
            None
        };
        if is_on && missing.is_none() && self.inputs.requirements.is_open() {
            missing = self.missing_input();
        }
        let condition = self.condition();
        if !is_on || missing.is_some() {
            let idle_condition = if is_on { ModuleCondition::WAITING } else { ModuleCondition::INACTIVE };
            if let Some(port) = missing {
                self.status.wait_for(port);
            }
            if condition.is_working() || condition == ModuleCondition::FAILED {
                self.set_condition(idle_condition, now);
                self.publish_safe(now);
                // Its own services may need the missing service.
                self.services.withdraw(self.code.kind());
                self.services.abandon();
            } else if matches!(condition, ModuleCondition::INACTIVE | ModuleCondition::WAITING) {
                self.set_condition(idle_condition, now);
            }
            return false;
        }
        if matches!(condition, ModuleCondition::INACTIVE | ModuleCondition::WAITING) {
            self.set_condition(ModuleCondition::WORKING, now);
        }
        let is_enabled = condition != ModuleCondition::FAULTED && condition != ModuleCondition::LATE;
        self.shortcuts.is_steady = is_enabled
            && !self.switch.is_linked()
            && self.services.aspects.is_empty()
            && self.supervised.is_none();
        is_enabled
    }

    /// Returns the first required input without a value.
    fn missing_input(&mut self) -> Option<PortName> {
        let missing = self.inputs.missing()?;
        if self.inputs.conversions.is_empty() {
            return Some(missing);
        }
        // Otherwise inputs of links are only written before the step that this one waits for.
        let is_updated = self.inputs.conversions.have_updates();
        self.inputs.refresh_sources();
        self.convert();
        if is_updated {
            self.schedule.set_rewired(true);
        }
        self.inputs.missing()
    }

    /// Returns the condition of the module.
    pub fn condition(&self) -> ModuleCondition {
        self.status.condition()
    }

    /// Changes how the module is, and shows it.
    #[inline]
    pub fn set_condition(&mut self, condition: ModuleCondition, now: u64) {
        if !self.status.is_published(condition) {
            self.shortcuts.is_steady = false;
            self.status.change(condition, self.frame.number(), now);
        }
    }

    /// Recomputes the shortcuts after ports, services or shadow changed.
    pub fn update_shortcuts(&mut self) {
        let has_previous = self.inputs.have_previous() || self.entries.have_previous();
        let has_conversions = !self.inputs.conversions.is_empty() || has_previous;
        let has_services = !self.services.host.is_empty() || !self.services.providers.is_empty();
        let has_slots = !self.frame.slots.is_empty();
        self.inputs.update_pinning();
        let has_only_values = self.entries.is_empty() && !has_services && self.shadow.is_none();
        self.shortcuts = Shortcuts {
            is_steady: false,
            needs_preparation: has_slots || has_conversions || has_services || self.shadow.is_some(),
            has_only_values,
            is_plain: has_only_values && !has_conversions && self.inputs.pins_singly,
            has_conversions,
        };
    }

    /// Pins the early values, those of the last cycle, before the steps of this one.
    pub fn pin_previous(&mut self) {
        self.inputs.pin_previous();
        self.entries.pull_previous();
    }

    /// Pins the inputs and fills the frame for a step at `now`.
    pub fn prepare(&mut self, now: u64) {
        if self.shortcuts.needs_preparation {
            self.inputs.pin();
        }
        self.prepare_pinned(now);
    }

    /// Acts as [`prepare`](Runner::prepare), for the loop's only step at that time.
    ///
    /// # Safety
    /// The cells of the loop that write [in turn](slate_blackboard::channel::Writer::set_in_turn) are in no step until that
    /// one has ended, or was [given up](Runner::give_up).
    #[inline]
    pub unsafe fn prepare_in_turn(&mut self, now: u64) {
        // SAFETY: the values are looked at in the step, and their readers hold them when the step is given up.
        unsafe {
            if self.shortcuts.is_plain {
                let StepFrame { slots, zeros, .. } = &mut self.frame;
                self.inputs.show_in_turn(slots, zeros, now);
                self.outputs.prepare(slots);
                return self.begin_step(now);
            }
            self.inputs.take_in_turn();
        }
        self.prepare_pinned(now);
    }

    /// Fills the frame.
    fn prepare_pinned(&mut self, now: u64) {
        if self.shortcuts.needs_preparation {
            self.prepare_ports(now);
        }
        self.begin_step(now);
        if let Some(shadow) = &mut self.shadow {
            shadow.before(&self.frame.frame, &self.frame.slots, self.frame.random());
        }
    }

    /// Shows the parameters and the time to the next step, whose ports are prepared.
    #[inline(always)] // As for `commit`.
    fn begin_step(&mut self, now: u64) {
        self.params.show(&mut self.frame.frame);
        self.frame.begin(now, self.schedule.last_tick());
        self.schedule.tick(now);
    }

    fn prepare_ports(&mut self, now: u64) {
        if self.shortcuts.has_conversions {
            self.convert();
        }
        let StepFrame { slots, zeros, .. } = &mut self.frame;
        self.inputs.fill(slots, zeros, now);
        if self.shortcuts.has_conversions {
            self.inputs.conversions.mark(slots, now);
        }
        self.outputs.prepare(slots);
        if !self.shortcuts.has_only_values {
            self.entries.prepare(slots, &self.log, now);
            self.services.prepare(slots, now);
        }
    }

    /// Converts new values of linked sources.
    fn convert(&mut self) {
        self.inputs.conversions.convert(&mut self.inputs.readers, &mut self.params, &self.log);
    }

    /// Checks and commits the results of a step; `code` is its return code.
    #[inline(always)] // Part of every step. Left to the compiler it is a call or not, for a tenth of the step.
    pub fn commit(&mut self, now: u64, code: i32, digest: Option<&mut Digest>) {
        if !self.shortcuts.has_only_values {
            if let Some(shadow) = &mut self.shadow {
                shadow.after(&self.frame.slots);
            }
            self.entries.answer();
        }
        let condition = match code {
            0 => ModuleCondition::WORKING,
            1 => ModuleCondition::DEGRADED,
            2 => ModuleCondition::FAILED,
            _ => return self.recover(now),
        };
        self.set_condition(condition, now);
        if condition == ModuleCondition::FAILED {
            self.services.abandon();
            self.entries.lose_messages(&self.frame.slots);
            self.publish_safe(now);
        } else {
            self.publish(now, digest);
        }
    }

    #[inline(always)]
    fn publish(&mut self, now: u64, mut digest: Option<&mut Digest>) {
        self.outputs.publish(&self.frame, now, digest.as_deref_mut());
        if !self.shortcuts.has_only_values {
            self.services.commit(now, digest.as_deref_mut());
            self.entries.send(&self.frame.slots, now, digest);
        }
    }

    /// Publishes the safe values of all outputs, and ends their commands.
    pub fn publish_safe(&mut self, now: u64) {
        self.outputs.publish_safe(self.condition() == ModuleCondition::LATE, now);
        self.services.release(now);
    }

    /// Adds the duration of a step, wall-clock ns, which is counted next.
    /// It has the weight `stands_for` in the histogram.
    pub fn measure(&mut self, duration: u64, stands_for: u32) {
        self.timing.measure(self.status.health(), duration, stands_for);
    }

    /// Counts a step.
    #[inline]
    pub fn count(&mut self) {
        if self.timing.count(&self.frame.frame) {
            self.write_timing();
        }
    }

    /// Writes `/module/timing`.
    #[inline(never)]
    fn write_timing(&mut self) {
        let now = self.frame.frame.now;
        self.inputs.publish_ages(&self.frame.slots, now);
        self.timing.show(&self.frame.frame, self.status.health());
        self.write_process(now, false);
    }

    /// Sets whether the outputs are written in turn with the steps of the loop.
    ///
    /// # Safety
    /// As for [`Writer::set_in_turn`](slate_blackboard::channel::Writer::set_in_turn): from then on its steps, and all else
    /// that writes its outputs, are made by the holder of the loop's token, and in no other module's step.
    pub unsafe fn set_in_turn(&mut self, in_turn: bool) {
        // SAFETY: passed on to the caller.
        unsafe { self.outputs.set_in_turn(in_turn) };
        // Writers of its inputs may leave the loop, too.
        self.inputs.hold();
    }
}
