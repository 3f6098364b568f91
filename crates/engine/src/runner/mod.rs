//! A module at work: before a tick its inputs are pinned and its frame is filled, afterwards its outputs are
//! checked and committed. The step in between touches nothing but the frame and its own state.

mod commit;
mod conversion;
mod frozen;
mod health;
mod ports;
mod prepare;
mod requirements;
mod retired;
mod shadow;
mod slots;
mod supervision;
mod wiring;

use std::cell::Cell;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_blackboard::Settings;
use slate_blackboard::channel::{Latest, Writer};
use slate_blackboard::commit::CommitWord;
use slate_blackboard::interface::View;
use slate_blackboard::wake::Wake;
use slate_module::{Frame, Host, ModuleKind, Random, Refusal, Trigger};

pub use crate::memory::Memory;
use crate::service::{AspectPort, HostService, ProviderPort};
pub use commit::priority;
pub use conversion::{Conversion, ConvertedSource};
pub use frozen::FrozenRunner;
pub use health::{Health, count};
pub use ports::{InboxPort, InputAge, InputPort, OutboxPort, OutputPort, QueueGauge, QueuePort};
pub use requirements::{PortName, Requirements};
pub use retired::{Patience, Retired, describe};
pub use shadow::{Shadow, ShadowState};
pub use slate_composition::own::{ModuleCondition, ModuleState, ModuleTiming};
pub use slate_composition::{OwnSetup, Wire};
pub use slots::Slots;
pub use supervision::Supervised;
pub use wiring::{ConversionWiring, OutboxWiring, QueueWiring, SourceWiring, Unwired, Wiring};

use crate::log::ModuleLog;

/// Inputs `first..end` that are written by one module and so are pinned together, and with them what it writes of the
/// sources of others.
#[derive(Debug)]
pub struct Group {
    /// What the module's commits count.
    pub word: CommitWord,
    /// Its first input.
    pub first: u32,
    /// Behind its last input.
    pub end: u32,
    /// Its first source.
    pub first_source: u32,
    /// Behind its last source.
    pub end_source: u32,
}

/// A module, its state, its ports and its frame.
///
/// In this order, so that what every step of a module with few ports looks at shares few cache lines: the time of a
/// loop with many short modules is the time that their lines take to come.
#[repr(C)]
pub struct Runner {
    /// How the module is; nothing before it was said for the first time.
    pub condition: Option<ModuleCondition>,
    /// Whether the parameters may have changed.
    pub params_changed: bool,
    /// Whether it has ports, services or new code beside it.
    pub has_company: bool,
    /// Whether its ports are inputs and outputs alone, and nothing else comes with its steps.
    pub has_only_values: bool,
    /// Whether it was found to run, and does so until something is set, or its condition changes.
    pub is_steady: bool,
    /// Whether there are links that do not fit as they are, or are pinned when a cycle begins.
    pub has_conversions: bool,
    /// Whether each input is of another writer and pinned before the step, so that the groups say nothing more.
    pub reads_apart: bool,
    /// Whether it has a turn in every cycle, whatever else it waits for.
    pub in_every_cycle: bool,
    /// What the host has set in all modules, and how much of it this one has seen.
    pub settings: Settings,
    /// How many settings had been made at the last look.
    pub settings_seen: Option<u64>,
    /// The time of the last tick, nanoseconds.
    pub last_tick: u64,
    /// The step of `kind`.
    pub tick: StepCode,
    /// Its state, in memory of its own.
    pub instance: *mut (),
    /// What the next step sees.
    pub frame: Frame,
    /// The slots of its ports in the frame.
    pub slots: Slots,
    /// What was measured of its steps.
    pub measured: Measured,
    /// Inputs, in the order of the groups.
    pub inputs: Vec<InputPort>,
    /// The readers of `inputs`, apart from them so that a group can be pinned in one go.
    pub readers: Vec<Latest>,
    /// Outputs.
    pub outputs: Vec<OutputPort>,
    /// Which inputs are pinned together.
    pub groups: Vec<Group>,
    /// The readers of what is converted.
    pub sources: Vec<Latest>,
    /// What makes it tick.
    pub trigger: Trigger,
    /// When the next tick of a periodic module is due.
    pub due: u64,
    /// What watches over it when it is isolated.
    pub supervised: Option<Box<Supervised>>,
    /// How long a step may take, nanoseconds.
    pub deadline: Option<u64>,
    /// The module's name.
    pub name: Arc<str>,
    /// Its code.
    pub kind: ModuleKind,
    /// How it is, for others.
    pub health: Arc<Health>,
    /// Queue inputs.
    pub queues: Vec<QueuePort>,
    /// Inboxes.
    pub inboxes: Vec<InboxPort>,
    /// Outboxes.
    pub outboxes: Vec<OutboxPort>,
    /// Whether its links have changed since its last step: what they lead to is news.
    pub rewired: bool,
    /// What links fill that do not fit as they are.
    pub conversions: Vec<Conversion>,
    /// What is pinned when a cycle begins, and not before the step.
    pub early: Vec<Group>,
    /// Services of other modules.
    pub aspects: Vec<AspectPort>,
    /// Services for other modules.
    pub providers: Vec<ProviderPort>,
    /// New code beside this one.
    pub shadow: Option<Shadow>,
    /// Services of the host.
    pub services: Vec<Box<dyn HostService>>,
    /// What `enabled` said last.
    pub on: bool,
    /// Whether another module switches this one.
    pub is_switched: bool,
    /// Reads its parameters.
    pub params: Latest,
    /// Reads its switch.
    pub enabled: Latest,
    /// Writes `/module/state`.
    pub state: Writer,
    /// Writes `/module/timing`.
    pub timing: Writer,
    /// Writes `/module/histogram`; taken by who shows it.
    pub histogram: Option<Writer>,
    /// Makes what a step wrote visible at once.
    pub commit: CommitWord,
    /// Wakes this module's own thread, if it has one.
    pub wake: Arc<Wake>,
    /// Its log.
    pub log: Box<ModuleLog>,
    /// What the instance is made with, also anew after a panic.
    pub setup: OwnSetup,
    /// The inputs without whose value it does not run.
    pub requirements: Requirements,
    /// What it waits for while its condition is `Waiting`.
    pub waiting_for: PortName,
    /// How long its end is waited for.
    pub patience: Patience,
    /// Behind `frame.random`.
    pub random: Box<Cell<Random>>,
    /// Behind `frame.host`.
    #[allow(dead_code, reason = "the frame points to it")]
    pub host: Box<Host>,
    /// A value of all zeros behind inputs that were never written.
    pub zeros: Arc<Memory>,
    /// Panics until now.
    pub panics: u32,
    /// Panics without many ticks between them, and the tick of the last one.
    pub panics_in_a_row: u32,
    /// The tick of the last panic.
    pub last_panic: u64,
}

/// The code of a step.
pub type StepCode = unsafe extern "C" fn(*mut (), *const Frame) -> i32;

/// What was measured since `/module/timing` was written last.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Measured {
    written: u64,
    period: u64,
    longest: u64,
    jitter: u64,
}

/// `/module/timing` is written this often, nanoseconds.
const TIMING_PERIOD: u64 = 100_000_000;

// SAFETY: the raw pointers lead to memory that the runner owns (instance, frame, slots) or that its handles keep
// alive (values), and whoever holds the runner uses them alone.
unsafe impl Send for Runner {}

/// After that many panics in a row a module stays off, as starting it again does not help.
const PANIC_LIMIT: u32 = 5;
/// After that many ticks a panic is no longer of the same row.
const PANIC_ROW: u64 = 100;

impl Runner {
    /// The call of a step, to be made without holding a reference to the runner: a hung step keeps it for ever. The runner
    /// stays where it is until the step has ended.
    pub fn call(&self) -> StepCall {
        StepCall { tick: self.tick, instance: self.instance, frame: &raw const self.frame }
    }

    /// Whether a step is due at `now`. Only looks; what is new is taken by [`prepare`](Runner::prepare).
    #[inline]
    pub fn is_due(&mut self, now: u64) -> bool {
        let is_up = self.is_as_before() || self.look_whether_enabled(now) && self.is_up(now);
        if !is_up {
            return false;
        }
        if self.in_every_cycle {
            return true;
        }
        match &self.trigger {
            Trigger::Stage => true,
            Trigger::Every(period) => {
                if now < self.due {
                    return false;
                }
                // Periods are counted from the first tick, so that they do not drift; missed ones are left out.
                let first = self.frame.number == 0;
                self.due =
                    if first { now + period } else { self.due + ((now - self.due) / period + 1) * period };
                true
            }
            Trigger::On { timeout, .. } => {
                let waited = now.saturating_sub(self.last_tick);
                timeout.is_some_and(|timeout| self.frame.number == 0 || waited >= timeout)
                    || self.has_news()
                    || std::mem::take(&mut self.rewired)
            }
        }
    }

    /// Whether a port that triggers has something new.
    pub fn has_news(&self) -> bool {
        self.inputs.iter().zip(&self.readers).any(|(input, reader)| input.wakes && reader.has_news())
            || self.queues.iter().any(|queue| queue.triggers && !queue.is_early && queue.reader.waiting() > 0)
            || self.inboxes.iter().any(|inbox| inbox.triggers && inbox.receiver.has_messages())
            || self.has_conversions && (self.has_converted_news() || self.has_early_news())
    }

    /// Whether the module may run at `now`: `enabled` is enforced here.
    #[inline]
    pub fn is_enabled(&mut self, now: u64) -> bool {
        self.is_as_before() || self.look_whether_enabled(now)
    }

    #[inline]
    fn is_as_before(&self) -> bool {
        self.is_steady && self.settings_seen == Some(self.settings.count())
    }

    fn look_whether_enabled(&mut self, now: u64) -> bool {
        // Two properties less to look at, which nearly never change.
        let settings = Some(self.settings.count());
        let changed = settings != self.settings_seen;
        if changed {
            (self.settings_seen, self.params_changed) = (settings, true);
        }
        if self.is_switched && self.has_conversions {
            self.convert_switch();
        }
        if (changed || self.is_switched) && self.enabled.refresh() {
            let value = self.enabled.value();
            self.on = value.is_none_or(|loan| loan.bytes().first().is_some_and(|byte| *byte != 0));
        }
        // Also while it is switched off, so that it keeps no service that nobody provides any more.
        let mut missing = if self.has_company { self.missing_service() } else { None };
        if self.on && missing.is_none() && self.requirements.is_open() {
            missing = self.missing_input();
        }
        let condition = self.condition();
        if !self.on || missing.is_some() {
            let rest = if self.on { ModuleCondition::WAITING } else { ModuleCondition::INACTIVE };
            if let Some(port) = missing.filter(|port| *port != self.waiting_for) {
                self.waiting_for = port;
                // So that its state is told anew.
                self.condition = self.condition.filter(|condition| *condition != ModuleCondition::WAITING);
            }
            if condition.is_working() || condition == ModuleCondition::FAILED {
                self.set_condition(rest, now);
                self.publish_safe(now);
                // What others use of it may use what it misses now.
                self.withdraw();
                self.services.iter_mut().for_each(|service| service.abandon());
            } else if matches!(condition, ModuleCondition::INACTIVE | ModuleCondition::WAITING) {
                self.set_condition(rest, now);
            }
            return false;
        }
        if matches!(condition, ModuleCondition::INACTIVE | ModuleCondition::WAITING) {
            self.set_condition(ModuleCondition::WORKING, now);
        }
        let is_enabled = condition != ModuleCondition::FAULTED && condition != ModuleCondition::LATE;
        self.is_steady =
            is_enabled && !self.is_switched && self.aspects.is_empty() && self.supervised.is_none();
        is_enabled
    }

    /// Ends the services that it provides.
    fn withdraw(&mut self) {
        self.providers.iter_mut().for_each(|provider| provider.withdraw(&self.kind));
    }

    /// The first service of another module that it needs and that is not provided.
    fn missing_service(&mut self) -> Option<PortName> {
        let mut missing = None;
        for aspect in &mut self.aspects {
            match aspect.table() {
                Some(table) => self.slots[aspect.slot].data = table.cast_mut(),
                None => missing = missing.or(Some(aspect.name)),
            }
        }
        missing
    }

    /// The first required input without a value.
    fn missing_input(&mut self) -> Option<PortName> {
        let missing = self.requirements.missing(&self.inputs, &self.readers)?;
        if self.conversions.is_empty() {
            return Some(missing);
        }
        // What links fill is else only written before the step that this one waits for.
        let is_news = self.has_converted_news();
        for group in &self.groups {
            let sources = &mut self.sources[group.first_source as usize..group.end_source as usize];
            sources.iter_mut().for_each(|source| _ = source.refresh());
        }
        self.convert();
        self.rewired |= is_news;
        self.requirements.missing(&self.inputs, &self.readers)
    }

    /// How the module is.
    pub fn condition(&self) -> ModuleCondition {
        self.condition.unwrap_or(ModuleCondition::WORKING)
    }

    /// Looks whether there is anything but the step itself to take care of.
    pub fn look_for_company(&mut self) {
        let ports = !(self.slots.is_empty() && self.services.is_empty() && self.shadow.is_none());
        self.has_company = ports || self.has_conversions;
        self.has_only_values = self.queues.is_empty()
            && self.inboxes.is_empty()
            && self.outboxes.is_empty()
            && self.providers.is_empty()
            && self.services.is_empty()
            && self.shadow.is_none();
        self.reads_apart = self.early.is_empty() && self.groups.iter().all(Group::is_one_reader);
        self.in_every_cycle = self.trigger == Trigger::Stage;
        self.is_steady = false;
    }

    /// Changes how the module is, and shows it.
    #[inline]
    pub fn set_condition(&mut self, condition: ModuleCondition, now: u64) {
        if self.condition != Some(condition) {
            self.change_condition(condition, now);
        }
    }

    fn change_condition(&mut self, condition: ModuleCondition, now: u64) {
        self.condition = Some(condition);
        self.is_steady = false;
        self.health.set(condition);
        let mut state = ModuleState {
            ticks: self.frame.number,
            panics: self.panics.into(),
            condition,
            waiting_for: if condition == ModuleCondition::WAITING {
                self.waiting_for
            } else {
                PortName::default()
            },
        };
        // Only a recorder in lockstep may hold a writer up; the condition is then recorded with its next change.
        let _ = self.state.write(View::of(&mut state).bytes(), 0, now);
    }

    /// As [`create`](Runner::create), in a thread that is not waited for without end.
    pub fn create_patiently(&mut self) -> Result<*mut (), Refusal> {
        self.params.refresh();
        self.params_changed = true;
        let params = self.params.value();
        let bytes = params.as_ref().map_or(&[][..], |loan| loan.bytes());
        self.patience.create(&self.kind, &self.setup, bytes)
    }

    /// A fresh instance with the present parameters.
    pub fn create(&mut self) -> Result<*mut (), Refusal> {
        self.params.refresh();
        self.params_changed = true;
        let params = self.params.value();
        let bytes = params.as_ref().map_or(&[][..], |loan| loan.bytes());
        self.setup.with(|setup| self.kind.create(setup, bytes))
    }

    /// Goes on with other code and its instance; returns the old code and instance. What the old code did wrong is
    /// forgotten.
    pub fn exchange(&mut self, kind: ModuleKind, instance: *mut ()) -> Retired {
        self.panics_in_a_row = 0;
        let mut comes_again = false;
        if let Some(supervised) = &mut self.supervised {
            supervised.supervisor.forget();
            comes_again = supervised.supervisor.is_waiting();
        }
        if instance.is_null() && !comes_again {
            // The exchange is taken back, and the old code had failed for good.
            self.set_condition(ModuleCondition::FAULTED, self.last_tick);
        } else if self.condition() == ModuleCondition::FAULTED {
            self.set_condition(ModuleCondition::WORKING, self.last_tick);
        }
        self.tick = kind.table().tick;
        let kind = std::mem::replace(&mut self.kind, kind);
        self.withdraw();
        self.services.iter_mut().for_each(|service| service.begin(&self.kind));
        let old = std::mem::replace(&mut self.instance, instance);
        self.show_process(self.last_tick, true);
        Retired::new(kind, old, self.patience.clone())
    }

    /// Gives a module that has not begun yet the state that another instance has saved.
    ///
    /// # Errors
    /// Why it begins afresh: the state doesn't fit, or the call does not return.
    pub fn restore(&mut self, state: &[u8]) -> Result<(), String> {
        let instance = std::mem::replace(&mut self.instance, std::ptr::null_mut());
        let retired = Retired::new(self.kind.clone(), instance, self.patience.clone());
        let (retired, fits) = retired.restored(state.to_vec());
        self.instance = retired.into_parts().1;
        if self.instance.is_null() {
            match self.create() {
                Ok(instance) => self.instance = instance,
                Err(refusal) => {
                    self.set_condition(ModuleCondition::FAULTED, 0);
                    self.log.write(slate_module::Level::Error, &refusal.0);
                }
            }
        }
        fits
    }

    /// Takes the instance out, so that it ends apart from the ports. Nobody runs it: a late module is never retired.
    pub fn retire(&mut self) -> Retired {
        let instance = std::mem::replace(&mut self.instance, std::ptr::null_mut());
        self.withdraw();
        self.services.iter_mut().for_each(|service| service.end());
        Retired::new(self.kind.clone(), instance, self.patience.clone())
    }

    /// Ends the instance.
    pub fn destroy(&mut self) {
        self.retire().end_here();
    }
}

impl Drop for Runner {
    fn drop(&mut self) {
        drop(self.retire());
    }
}

/// A step that is ready to be made.
#[derive(Clone, Copy)]
pub struct StepCall {
    tick: StepCode,
    instance: *mut (),
    frame: *const Frame,
}

// SAFETY: instances are `Send`, and the frame is used by whoever makes the call alone.
unsafe impl Send for StepCall {}

impl StepCall {
    /// Makes the step; returns the outcome, or -1 after a panic.
    ///
    /// # Safety
    /// The runner was prepared and lives, and nobody else touches its instance and frame during the call.
    pub unsafe fn make(self) -> i32 {
        // SAFETY: passed on to the caller.
        unsafe { (self.tick)(self.instance, self.frame) }
    }
}
