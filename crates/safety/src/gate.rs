use slate_module::blackboard::interface::{CanonicalForm, Descriptor};
use slate_module::{Optional, Priority};

use crate::stop::stopped;
use crate::{
    GateConfiguration, GateMode, GateState, LeasePriority, Reason, RefusalReason, StopLatch, Verdict,
};

/// Gate of one actuator; initially disarmed.
///
/// The commander with the highest priority holds the lease: plan, teleoperation, reflex, in ascending order; a stop is a state of the gate.
/// Among equals the first keeps it. Each offer of the holder renews the lease, with its priority; it ends by withdrawal or after the time
/// to live.
#[derive(Debug)]
pub struct Gate {
    pub(crate) configuration: GateConfiguration,
    form: CanonicalForm,
    /// Command of the lease's holder, within limits.
    pub(crate) command: Vec<u8>,
    pub(crate) lease: Option<Lease>,
    /// Start time of rate limits.
    /// It is that of the actuator's newest offer, or of its safe command.
    pub(crate) given_at: Option<u64>,
    /// State of the stop latch when the gate was armed.
    pub(crate) armed: Option<u64>,
    /// Reason of this gate's own stop.
    pub(crate) stop: Option<String>,
    pub(crate) passed: u64,
    pub(crate) limited: u64,
    pub(crate) refused: u64,
    pub(crate) expired: u64,
    pub(crate) last_refusal: RefusalReason,
}

#[derive(Debug)]
pub(crate) struct Lease {
    pub(crate) commander: u32,
    pub(crate) priority: Priority,
    /// Time of the newest offer, nanoseconds.
    pub(crate) renewed: u64,
    /// True if this offer was usable.
    /// Else the actuator gets its safe command.
    pub(crate) commanding: bool,
}

/// Output to an actuator.
#[derive(Debug)]
pub struct Output<'a> {
    /// Passed or safe command, a value of the actuator's interface.
    pub command: &'a [u8],
    /// State of the gate.
    pub state: GateState,
}

/// Error of arming a stopped gate.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("gate `{gate}` is stopped ({reason}): reset the stop first")]
pub struct StillStopped {
    /// Name of the gate.
    pub gate: String,
    /// Reason of the stop.
    pub reason: String,
}

impl Gate {
    /// Returns a disarmed gate.
    pub fn new(configuration: GateConfiguration) -> Self {
        let mut gate = Self {
            form: CanonicalForm::new(configuration.descriptor),
            command: configuration.safe.clone(),
            lease: None,
            given_at: None,
            armed: None,
            stop: None,
            passed: 0,
            limited: 0,
            refused: 0,
            expired: 0,
            last_refusal: RefusalReason::NONE,
            configuration,
        };
        let GateConfiguration { bounds, safe, .. } = &mut gate.configuration;
        bounds.iter_mut().for_each(|bound| bound.give(safe));
        gate
    }

    /// Returns the name of the gate.
    pub fn name(&self) -> &str {
        &self.configuration.name
    }

    /// Returns the interface of the commands.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.configuration.descriptor
    }

    /// Offers a command at the host's time `now` (nanoseconds).
    ///
    /// A commander with a higher priority takes the lease, even if its command is invalid (not finite, or of the wrong size): then the
    /// actuator gets its safe command, not a less urgent one.
    pub fn offer(&mut self, commander: u32, priority: Priority, command: &[u8], now: u64) -> Verdict {
        let verdict = self.judge(commander, priority, command, now);
        let count = match verdict {
            Verdict::Passed => &mut self.passed,
            Verdict::Limited => &mut self.limited,
            Verdict::Refused(reason) => {
                self.last_refusal = reason.into();
                &mut self.refused
            }
        };
        *count = count.saturating_add(1);
        verdict
    }

    fn judge(&mut self, commander: u32, priority: Priority, command: &[u8], now: u64) -> Verdict {
        match self.settle(now) {
            GateMode::ARMED => {}
            GateMode::STOPPED => return Verdict::Refused(Reason::Stopped),
            _ => return Verdict::Refused(Reason::Disarmed),
        }
        if let Some(lease) = &self.lease
            && lease.commander != commander
            && lease.priority >= priority
        {
            return Verdict::Refused(Reason::Leased { by: lease.commander, priority: lease.priority });
        }
        let mut lease = Lease { commander, priority, renewed: now, commanding: false };
        let verdict = self.take(command, now);
        lease.commanding = !matches!(verdict, Verdict::Refused(_));
        self.lease = Some(lease);
        verdict
    }

    /// Sets the command, within limits.
    fn take(&mut self, command: &[u8], now: u64) -> Verdict {
        if command.len() != self.command.len() {
            return Verdict::Refused(Reason::WrongSize);
        }
        self.command.copy_from_slice(command);
        if !self.form.canonicalize(&mut self.command, 0) {
            return Verdict::Refused(Reason::NotFinite);
        }
        let GateConfiguration { bounds, time_to_live, .. } = &mut self.configuration;
        let elapsed = self.given_at.map_or(0, |given_at| now.saturating_sub(given_at)).min(*time_to_live);
        let seconds = elapsed as f64 / 1e9;
        let mut limited = false;
        for bound in bounds {
            limited |= bound.apply(&mut self.command, seconds);
        }
        if limited { Verdict::Limited } else { Verdict::Passed }
    }

    /// Drops a command that arrives after its time to live.
    /// The time counts from its creation. Its commander loses the actuator, if it has it.
    pub fn drop_late(&mut self, commander: u32, now: u64) {
        self.withdraw(commander, now);
        self.expired = self.expired.saturating_add(1);
    }

    /// Returns the time to live of a command, nanoseconds.
    pub fn time_to_live(&self) -> u64 {
        self.configuration.time_to_live
    }

    /// Returns the host's time at which the command ends unless it is renewed.
    /// `None` while the actuator gets its safe one.
    pub fn expires(&self) -> Option<u64> {
        let lease = self.lease.as_ref().filter(|lease| lease.commanding)?;
        Some(lease.renewed.saturating_add(self.configuration.time_to_live))
    }

    /// Ends a commander's lease.
    /// The actuator gets its safe command until the next offer.
    pub fn withdraw(&mut self, commander: u32, now: u64) {
        self.settle(now);
        if self.lease.as_ref().is_some_and(|lease| lease.commander == commander) {
            self.lease = None;
        }
    }

    /// Returns the actuator's output at the host's time `now` (nanoseconds).
    ///
    /// The command within its time to live; else the safe command, without rate limit.
    pub fn output(&mut self, now: u64) -> Output<'_> {
        let mode = self.settle(now);
        let GateConfiguration { bounds, safe, .. } = &mut self.configuration;
        let mut state = GateState {
            passed: self.passed,
            limited: self.limited,
            refused: self.refused,
            expired: self.expired,
            age: Optional::none(),
            holder: 0,
            mode,
            priority: LeasePriority::NONE,
            last_refusal: self.last_refusal,
        };
        if let Some(lease) = &self.lease {
            state.holder = lease.commander;
            state.priority = lease.priority.into();
        }
        let Some(lease) = self.lease.as_ref().filter(|lease| lease.commanding) else {
            bounds.iter_mut().for_each(|bound| bound.give(safe));
            self.given_at = Some(now);
            return Output { command: safe, state };
        };
        bounds.iter_mut().for_each(|bound| bound.give_passed());
        self.given_at = Some(lease.renewed);
        state.age = Optional::some(now.saturating_sub(lease.renewed));
        Output { command: &self.command, state }
    }

    /// Arms the gate: commands pass from the next offer on.
    ///
    /// # Errors
    /// While this gate or the agent is stopped.
    pub fn arm(&mut self) -> Result<(), StillStopped> {
        let word = self.configuration.stop_latch.word();
        if self.stop.is_some() || stopped(word) {
            let reason = self.stop_reason().unwrap_or_default();
            return Err(StillStopped { gate: self.configuration.name.clone(), reason });
        }
        if self.armed != Some(word) {
            self.lease = None;
        }
        self.armed = Some(word);
        Ok(())
    }

    /// Disarms the gate: no command passes.
    pub fn disarm(&mut self) {
        self.armed = None;
        self.lease = None;
    }

    /// Stops this gate: safe command, and refusal of all offers.
    /// It lasts until [`reset`](Self::reset) and [`arm`](Self::arm).
    ///
    /// The first reason stays. A [`StopLatch`](crate::StopLatch) stops the whole agent.
    pub fn stop(&mut self, reason: &str) {
        self.disarm();
        self.stop.get_or_insert_with(|| reason.into());
    }

    /// Resets this gate's own stop; the gate stays disarmed.
    /// A [`StopLatch`](crate::StopLatch) has its own reset.
    pub fn reset(&mut self) {
        self.stop = None;
    }

    /// Returns the reason of a stop of the gate or the agent.
    /// Allocates: not for the tick path.
    pub fn stop_reason(&self) -> Option<String> {
        self.stop.clone().or_else(|| self.configuration.stop_latch.reason())
    }

    /// Returns the reason of this gate's own stop.
    pub fn own_stop(&self) -> Option<&str> {
        self.stop.as_deref()
    }

    /// Returns the agent's stop that this gate follows.
    pub fn latch(&self) -> &StopLatch {
        &self.configuration.stop_latch
    }

    /// Applies stops and the end of the time to live.
    fn settle(&mut self, now: u64) -> GateMode {
        let word = self.configuration.stop_latch.word();
        if self.armed != Some(word) {
            // Also when the agent was stopped and reset unnoticed: a reset does not arm.
            self.disarm();
        }
        // A clock that jumped back must not keep a command alive, so the distance counts both ways.
        let time_to_live = self.configuration.time_to_live;
        if let Some(lease) = self.lease.take_if(|lease| now.abs_diff(lease.renewed) >= time_to_live)
            && lease.commanding
        {
            self.expired = self.expired.saturating_add(1);
        }
        match self.armed {
            _ if self.stop.is_some() || stopped(word) => GateMode::STOPPED,
            Some(_) => GateMode::ARMED,
            None => GateMode::DISARMED,
        }
    }
}
