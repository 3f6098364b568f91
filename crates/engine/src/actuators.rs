//! Gates of an agent's actuators: arbitration, limits and expiry of commands.
//! A command passes its gate in the thread of its commander, so that no wake-up delays it.
//!
//! On the wall clock a gate decides at the present time, and not at that of the cycle, which may be long past when a step
//! returns. The watchdog expires stale commands while no other thread does.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use slate_blackboard::channel::{Budget, Channel, Latest, Writer};
use slate_blackboard::interface::{Descriptor, View};
use slate_blackboard::wake::Wake;
use slate_blackboard::{Board, BoardError};
use slate_module::Priority;
use slate_safety::{Gate, GateState, StopLatch, Verdict};
use slate_sorted::SortedMap;

use crate::clock::{Clock, monotonic};
use crate::digest::Digest;
use crate::{ActuatorSnapshot, Bytes, PropertySnapshot};

/// Gate with the property that the actuator reads.
#[derive(Debug)]
pub struct Actuator {
    name: String,
    /// Possible commanders: paths of ports and of modules; the gate counts them from 1.
    commanders: Vec<String>,
    descriptor: &'static Descriptor,
    /// Teleoperation commands of the person who holds the controls.
    /// The loop reads them, so that an operator never enters the gate.
    controls: Mutex<Controls>,
    inner: Mutex<CommandedState>,
    /// Stop of the gate, for tools, which read it without entering the gate.
    stop: Mutex<PublishedStop>,
    /// Stop of the whole agent.
    stop_latch: StopLatch,
    clock: Arc<Clock>,
    /// Time to live of a command, ns.
    time_to_live: u64,
    /// Agent's time at which the present command expires, ns; `u64::MAX` if safe.
    /// Written inside the gate; a reader enters the gate to learn whether the command still holds.
    expires: Arc<AtomicU64>,
}

/// Controls of an operator, and their holder.
#[derive(Debug)]
struct Controls {
    /// Writer of the commands; `None` while the controls are held.
    writer: Option<Writer>,
    holder: Option<Holder>,
}

/// Stop of one gate, as tools see it.
#[derive(Debug, Default)]
struct PublishedStop {
    reason: Option<String>,
    /// Number of the gate's change of stop that it shows.
    revision: u64,
}

/// Person at the controls, or a program that stands for one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// Name of the holder, for display.
    pub who: String,
    /// Begin of the control, ns of the agent's time.
    pub since: u64,
}

/// Name under which an operator commands.
const TELEOPERATION: &str = "teleoperation";

#[derive(Debug)]
struct CommandedState {
    gate: Gate,
    command: Writer,
    state: Writer,
    index: u32,
    wakes: Vec<Arc<Wake>>,
    /// Commands from the controls; a value's stamp is the monotonic time of its expiry.
    controls: Option<Latest>,
    /// True if the last poll of the controls found a command.
    is_teleoperated: bool,
    last_state: Option<GateState>,
    /// Number of changes of the gate's stop.
    stop_revision: u64,
    /// True if a command has passed since the last publication.
    /// Only changes and renewals are published.
    fresh: bool,
    /// Last command written to the actuator, with its time.
    /// A cycle that does not change it writes it once.
    written: (Option<u64>, Vec<u8>),
    expires: Arc<AtomicU64>,
}

impl Actuator {
    /// Returns a gate with its properties on the board.
    ///
    /// # Errors
    /// When something else has the name of one.
    pub fn new(
        name: &str,
        commanders: Vec<String>,
        gate: Gate,
        command: Writer,
        state: Writer,
        (index, clock): (u32, Arc<Clock>),
    ) -> Self {
        let descriptor = gate.descriptor();
        let channel = Channel::new(descriptor.shape(0), 1, Budget { latest: 1, queues: 0, window: 0 });
        let (writer, controls) = channel.writer().ok().zip(channel.latest().ok()).unzip();
        let time_to_live = gate.time_to_live();
        let stop_latch = gate.latch().clone();
        let expires = Arc::new(AtomicU64::new(u64::MAX));
        let inner = CommandedState {
            gate,
            command,
            state,
            index,
            wakes: Vec::new(),
            controls,
            is_teleoperated: false,
            last_state: None,
            stop_revision: 0,
            fresh: false,
            written: (None, Vec::with_capacity(descriptor.size)),
            expires: Arc::clone(&expires),
        };
        Self {
            name: name.into(),
            commanders,
            descriptor,
            controls: Mutex::new(Controls { writer, holder: None }),
            inner: Mutex::new(inner),
            stop: Mutex::default(),
            stop_latch,
            clock,
            time_to_live,
            expires,
        }
    }

    /// Returns the later of the cycle's time and the clock's, ns.
    fn decision_time(&self, now: u64) -> u64 {
        now.max(self.clock.now())
    }

    /// Wakes a thread when a command has passed.
    pub fn add_wake(&self, wake: Arc<Wake>) {
        self.locked().wakes.push(wake);
    }

    /// Wakes these threads, and no others, when a command has passed.
    pub fn set_wakes(&self, wakes: Vec<Arc<Wake>>) {
        let old = std::mem::replace(&mut self.locked().wakes, wakes);
        drop(old);
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the interface of its commands.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// Returns the size of a command, bytes.
    pub fn size(&self) -> usize {
        self.descriptor.size
    }

    /// Returns the number of a commander by its path; `None` if it may not command.
    pub fn commander(&self, path: &str) -> Option<u32> {
        self.commanders.iter().position(|other| other == path).map(|index| index as u32 + 1)
    }

    /// Returns the path of a commander by its number, from the agent's root.
    pub fn commander_name(&self, number: u32) -> &str {
        match (number as usize).checked_sub(1) {
            Some(index) if index == self.commanders.len() => TELEOPERATION,
            Some(index) => self.commanders.get(index).map_or("", String::as_str),
            None => "",
        }
    }

    /// Takes the controls; the error is the name of their present holder.
    pub fn take_controls(&self, holder: Holder) -> Result<Writer, String> {
        let mut controls = self.controls();
        match controls.writer.take() {
            Some(writer) => {
                controls.holder = Some(holder);
                Ok(writer)
            }
            None => Err(controls.holder.as_ref().map_or_else(String::new, |other| other.who.clone())),
        }
    }

    /// Leaves the controls to the next one.
    pub fn release_controls(&self, writer: Writer) {
        *self.controls() = Controls { writer: Some(writer), holder: None };
    }

    /// Returns the present holder of the controls.
    pub fn holder(&self) -> Option<Holder> {
        self.controls().holder.clone()
    }

    fn controls(&self) -> MutexGuard<'_, Controls> {
        self.controls.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the state of the gate; `None` while another thread is in it.
    pub fn try_state(&self, now: u64) -> Option<GateState> {
        let mut inner = self.try_lock()?;
        inner.publish(self.decision_time(now));
        inner.last_state
    }

    fn locked(&self) -> MutexGuard<'_, CommandedState> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Locks the gate; `None` while another thread is in it.
    /// No thread waits on the wall clock: the other thread is a commander that holds the lease, or the loop that expires
    /// stale commands. Under a time source it waits, so that the result does not depend on other threads.
    fn try_lock(&self) -> Option<MutexGuard<'_, CommandedState>> {
        if self.clock.is_driven() {
            return Some(self.locked());
        }
        for _ in 0..64 {
            match self.inner.try_lock() {
                Ok(inner) => return Some(inner),
                Err(TryLockError::Poisoned(error)) => return Some(error.into_inner()),
                Err(TryLockError::WouldBlock) => std::hint::spin_loop(),
            }
        }
        None
    }

    /// Offers a commander's command, made by a step at the agent's time `now`, ns.
    pub fn offer(&self, commander: u32, priority: Priority, command: &[u8], now: u64) {
        // A reflex must not be lost, whatever else is in the gate for some nanoseconds.
        let inner = if priority == Priority::Reflex { Some(self.locked()) } else { self.try_lock() };
        let Some(mut inner) = inner else { return };
        let at = self.decision_time(now);
        if at - now >= self.time_to_live {
            // Of a step that took so long: the actuator has had its safe command since, or another commander's.
            inner.gate.drop_late(commander, at);
        } else {
            let verdict = inner.gate.offer(commander, priority, command, now);
            inner.fresh |= matches!(verdict, Verdict::Passed | Verdict::Limited);
        }
        inner.publish(at);
    }

    /// Ends the command of a commander.
    pub fn withdraw(&self, commander: u32, now: u64) {
        // Nor must the end of a command.
        let mut inner = self.locked();
        let at = self.decision_time(now);
        inner.gate.withdraw(commander, at);
        inner.publish(at);
    }

    /// Returns the time to live of a command that is not renewed, ns.
    pub fn time_to_live(&self) -> u64 {
        self.time_to_live
    }

    /// Returns the expiry of the present command, in the agent's time, ns.
    /// A renewal postpones it. `None` for the safe command.
    pub fn expires(&self) -> Option<u64> {
        Some(self.expires.load(Ordering::Acquire)).filter(|expires| *expires != u64::MAX)
    }

    /// Applies the safe command if the present one has expired; true if it had.
    /// For the watchdog of the loop. Before the expiry the gate is not entered, so that it delays no other thread.
    pub fn expire_stale(&self) -> bool {
        if !self.is_stale() {
            return false;
        }
        let Some(mut inner) = self.try_lock() else { return false };
        // Another thread may have changed the gate meanwhile, so this is checked anew.
        let now = self.clock.now();
        inner.publish(now);
        true
    }

    /// Acts as [`expire_stale`](Actuator::expire_stale) before a read of the command.
    /// It waits for another thread that is in the gate.
    pub fn expire_before_read(&self) {
        if self.is_stale() {
            self.locked().publish(self.clock.now());
        }
    }

    fn is_stale(&self) -> bool {
        self.expires().is_some_and(|expires| self.clock.now() >= expires)
    }

    /// Applies the controls and expires a stale command.
    /// Adds the actuator's command to the digest.
    pub fn expire(&self, now: u64, digest: Option<&mut Digest>) {
        let Some(mut inner) = self.try_lock() else { return };
        let at = self.decision_time(now);
        inner.follow_controls(self.commanders.len() as u32 + 1, at);
        inner.publish(at);
        if let Some(digest) = digest {
            let index = inner.index;
            digest.add(index, inner.gate.output(at).command);
        }
    }

    /// Returns the gate's state for a snapshot.
    pub fn snapshot(&self) -> ActuatorSnapshot {
        let inner = self.locked();
        ActuatorSnapshot {
            commanders: self.commanders.clone(),
            index: inner.index,
            gate: inner.gate.snapshot(),
            shown: inner.last_state.map(|mut state| Bytes(View::of(&mut state).bytes().to_vec())),
            fresh: inner.fresh,
        }
    }

    /// Returns true if the actuator can resume from this snapshot.
    pub fn fits(&self, saved: &ActuatorSnapshot) -> bool {
        self.commanders == saved.commanders && self.locked().gate.fits(&saved.gate)
    }

    /// Resumes from a snapshot, with the values of its properties.
    /// A mismatch was rejected before, by [`fits`](Actuator::fits).
    ///
    /// # Errors
    /// A property that does not take its values.
    pub fn restore(
        &self,
        saved: &ActuatorSnapshot,
        board: &Board,
        properties: &SortedMap<String, PropertySnapshot>,
        (rearm, now): (bool, u64),
    ) -> Result<(), BoardError> {
        let mut inner = self.locked();
        let CommandedState { command, state, .. } = &mut *inner;
        for (own, writer) in [("command", command), ("gate", state)] {
            let path = format!("{}/{own}", self.name);
            if let (Some(saved), Some((property, _))) = (properties.get(&path), board.get(&path)) {
                property.restore(&saved.values, Some(writer))?;
            }
        }
        inner.gate.restore(&saved.gate, rearm);
        (inner.index, inner.fresh) = (saved.index, saved.fresh);
        inner.written.0 = None;
        inner.last_state =
            saved.shown.as_ref().filter(|published| published.0.len() == size_of::<GateState>()).map(
                // SAFETY: the length was checked, every bit pattern of an interface is valid, and no alignment is needed.
                |published| unsafe { published.0.as_ptr().cast::<GateState>().read_unaligned() },
            );
        if !rearm {
            // The actuator's last command is outdated.
            inner.publish(now);
        }
        self.publish_stop(inner);
        Ok(())
    }

    /// Lets commands through; the software stop must have been reset.
    pub fn arm(&self) -> bool {
        self.locked().gate.arm().is_ok()
    }

    /// Lets no command through until it is armed again.
    pub fn disarm(&self, now: u64) {
        let mut inner = self.locked();
        inner.gate.disarm();
        inner.publish(now);
    }

    /// Stops at once and stays stopped.
    pub fn stop(&self, reason: &str, now: u64) {
        let mut inner = self.locked();
        inner.gate.stop(reason);
        inner.publish(now);
        self.publish_stop(inner);
    }

    /// Returns the reason of the stop, if stopped.
    /// The gate is not entered, so that the query delays no command.
    pub fn stop_reason(&self) -> Option<String> {
        let own = self.published_stop().reason.clone();
        own.or_else(|| self.stop_latch.reason())
    }

    /// Ends a stop; the gate then has to be armed.
    pub fn reset(&self) {
        let mut inner = self.locked();
        inner.gate.reset();
        self.publish_stop(inner);
    }

    /// Unlocks the gate, then publishes its stop.
    /// In this order, as a reader of the stop may be suspended while it holds the stop's lock.
    fn publish_stop(&self, mut inner: MutexGuard<'_, CommandedState>) {
        inner.stop_revision += 1;
        let (revision, reason) = (inner.stop_revision, inner.gate.own_stop().map(str::to_owned));
        drop(inner);
        let mut published = self.published_stop();
        if published.revision < revision {
            *published = PublishedStop { reason, revision };
        }
    }

    fn published_stop(&self) -> MutexGuard<'_, PublishedStop> {
        self.stop.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl CommandedState {
    /// Offers the operator's command until it expires, as the operator may be gone.
    fn follow_controls(&mut self, commander: u32, now: u64) {
        let Some(controls) = &mut self.controls else { return };
        controls.refresh();
        let Some(command) = controls.value() else { return };
        let until = command.stamp().time;
        if until != 0 && monotonic() < until {
            let verdict = self.gate.offer(commander, Priority::Teleoperation, command.bytes(), now);
            self.fresh |= matches!(verdict, Verdict::Passed | Verdict::Limited);
            self.is_teleoperated = true;
        } else if std::mem::take(&mut self.is_teleoperated) {
            self.gate.withdraw(commander, now);
        }
    }

    /// Publishes the command that holds now, and the gate's state when it changed.
    fn publish(&mut self, now: u64) {
        let output = self.gate.output(now);
        let (time, command) = &mut self.written;
        if *time != Some(now) || command != output.command {
            // Only a recorder in lockstep may refuse, and then the value is recorded in the next cycle.
            let _ = self.command.write(output.command, 0, now);
            *time = Some(now);
            command.clear();
            command.extend_from_slice(output.command);
        }
        let mut state = output.state;
        let has_ended = self.last_state.is_some_and(|last| last.expired != state.expired);
        if self.last_state != Some(state) {
            let _ = self.state.write(View::of(&mut state).bytes(), 0, now);
            self.last_state = Some(state);
        }
        self.expires.store(self.gate.expires().unwrap_or(u64::MAX), Ordering::Release);
        // The driver of the actuator is also notified when no command holds any more.
        if std::mem::take(&mut self.fresh) || has_ended {
            self.wakes.iter().for_each(|wake| wake.notify(1));
        }
    }
}

/// Actuators of an agent, for callers that select one at run time.
#[derive(Debug, Default)]
pub struct ActuatorList(Mutex<Arc<SortedMap<String, Arc<Actuator>>>>);

impl ActuatorList {
    fn now(&self) -> Arc<SortedMap<String, Arc<Actuator>>> {
        Arc::clone(&self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Makes these all that there are.
    pub fn set(&self, actuators: SortedMap<String, Arc<Actuator>>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(actuators);
    }

    /// Returns the actuator of that name.
    pub fn get(&self, name: &str) -> Option<Arc<Actuator>> {
        self.now().get(name).cloned()
    }

    /// Returns all actuators.
    pub fn all(&self) -> Vec<Arc<Actuator>> {
        self.now().values().cloned().collect()
    }

    /// Returns their names.
    pub fn names(&self) -> Vec<String> {
        self.now().keys().cloned().collect()
    }
}
