use std::cell::UnsafeCell;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use slate_blackboard::wake::Wake;

use super::{HistogramPublisher, SharedLoop};
use crate::clock::monotonic;
use crate::isolation::Isolation;
use crate::runner::{Health, ModuleCondition, Runner, count};
use crate::timing::{Label, Span, Trace, TraceTrack};

const IDLE: u64 = 0;
const RUNNING: u64 = 1;
/// State while the watchdog writes safe outputs, or a late module is taken back.
const CLAIMED: u64 = 2;
const LATE: u64 = 3;
const RETURNED: u64 = 4;

/// Bits of a cell's word with its state.
const STATE: u64 = 7;
/// Bit of a step made by a worker, so that the loop continues without it.
const BY_WORKER: u64 = 8;
/// Increment of the word by each step or other call.
/// It lets the watchdog tell a long one from many short ones.
const CALL: u64 = 16;

/// Cell of a module's runner: decides which thread may use its runner.
/// Also when a step does not return.
///
/// While a step runs, the runner belongs to the thread that makes it. When the watchdog gives the step up, the runner
/// belongs to the host again, and the late thread touches nothing once it returns.
///
/// In this order, as for [`Runner`].
#[repr(C, align(64))]
pub struct RunnerCell {
    /// Number of the last call, whether a worker makes it, and the state.
    /// A call is a step or another call. All are in one word, which changes before and after each step.
    word: AtomicU64,
    /// True if the module's own thread must end.
    retired: AtomicBool,
    /// True if every step is timed.
    pub has_deadline: bool,
    /// True if the module runs in a process of its own.
    pub is_isolated: bool,
    /// Process of the module.
    isolation: Option<Arc<Isolation>>,
    /// True if its steps reach beyond its ports, so that they never run beside others.
    pub is_exclusive: bool,
    /// True if it has a turn in every cycle.
    in_every_cycle: bool,
    /// True if its own thread waits for its turn in the loop.
    is_turn_signaled: bool,
    /// Steps begun.
    ticks: AtomicU64,
    /// Monotonic time of the last call's begin, ns; 0 if it was not timed.
    /// A call is a step or another call.
    started: AtomicU64,
    /// Duration of the last timed step, wall-clock ns.
    duration: AtomicU64,
    /// Monotonic time of the return of the last late step, ns.
    returned: AtomicU64,
    /// Return code of the late step.
    late_code: AtomicI32,
    /// Number of turns that the loop has signaled.
    signaled_turns: AtomicU64,
    /// Runner, valid until the cell is dropped.
    runner: UnsafeCell<ManuallyDrop<Runner>>,
    /// True if it reads values of the last cycle at the beginning of a cycle.
    reads_previous: AtomicBool,
    /// Name of the module.
    pub name: Arc<str>,
    /// Condition of the module.
    pub health: Arc<Health>,
    /// Shows how long its steps take.
    pub publication: HistogramPublisher,
    /// Trace of its steps, from the first start of tracing on.
    /// Written by the thread that drives the cell.
    track: OnceLock<(TraceTrack, Label)>,
    /// Wakes the module's own thread, if it has one.
    pub wake: Arc<Wake>,
    /// Receiver of the runner when the last owner drops the cell.
    runner_sender: OnceLock<Sender<Runner>>,
}

impl Drop for RunnerCell {
    fn drop(&mut self) {
        // SAFETY: the cell has no other owner, and the runner is taken nowhere else.
        let runner = unsafe { ManuallyDrop::take(self.runner.get_mut()) };
        if let Some(runner_sender) = self.runner_sender.take() {
            // Sending fails if the receiver no longer waits.
            let _ = runner_sender.send(runner);
        }
    }
}

// SAFETY: `word` says which thread may use the runner and write to the track, as described above.
unsafe impl Sync for RunnerCell {}

impl RunnerCell {
    /// Returns a cell for that module.
    pub fn new(mut runner: Runner) -> Self {
        runner.update_shortcuts();
        Self {
            word: AtomicU64::new(IDLE),
            retired: AtomicBool::new(false),
            has_deadline: runner.timing.has_deadline(),
            is_isolated: runner.supervised.is_some(),
            isolation: runner.supervised.as_ref().map(|supervised| Arc::clone(&supervised.isolation)),
            is_exclusive: runner.services.are_needed(),
            in_every_cycle: runner.schedule.is_in_every_cycle(),
            is_turn_signaled: runner
                .supervised
                .as_ref()
                .is_some_and(|supervised| supervised.is_turn_signaled),
            ticks: AtomicU64::new(0),
            started: AtomicU64::new(0),
            duration: AtomicU64::new(0),
            returned: AtomicU64::new(0),
            late_code: AtomicI32::new(0),
            signaled_turns: AtomicU64::new(0),
            reads_previous: AtomicBool::new(runner.inputs.have_previous() || runner.entries.have_previous()),
            name: Arc::clone(&runner.name),
            health: Arc::clone(runner.status.health()),
            publication: HistogramPublisher::new(runner.timing.take_histogram()),
            track: OnceLock::new(),
            wake: Arc::clone(&runner.wake),
            runner: UnsafeCell::new(ManuallyDrop::new(runner)),
            runner_sender: OnceLock::new(),
        }
    }

    /// Closes the connection to the module's process, so that a waiting step returns.
    pub fn disconnect(&self) {
        if let Some(isolation) = &self.isolation {
            isolation.process_record.disconnect();
        }
    }

    /// Closes the connection to a process that opens the module's code.
    pub fn disconnect_launched(&self) {
        if let Some(isolation) = &self.isolation {
            isolation.process_record.disconnect_launched();
        }
    }

    /// Returns the runner.
    ///
    /// # Safety
    /// The caller drives this cell (the holder of the loop's token, or the module's own thread) and the cell is idle;
    /// or it has just claimed the cell.
    #[allow(clippy::mut_from_ref, reason = "the state of the cell grants the access")]
    pub unsafe fn runner(&self) -> &mut Runner {
        // SAFETY: passed on to the caller.
        unsafe { &mut *self.runner.get() }
    }

    /// Sets whether the module writes in turn with the steps of the loop.
    /// It does from the time when the loop has it, and until the loop gives up a step of it. A module with a thread or
    /// a process of its own does not.
    ///
    /// # Safety
    /// The caller has the loop's token between two cycles, and the loop has the module from then on, or not.
    pub unsafe fn set_in_turn(&self, in_turn: bool) {
        // A late module left the turns when its step was given up.
        if !self.is_turn_signaled && !self.is_isolated && self.is_idle() {
            // SAFETY: the cell is idle, and only the holder of the token makes its steps.
            unsafe { self.runner().set_in_turn(in_turn) };
        }
    }

    /// Begins a step, made by a worker (`by_worker`) or the driver of the cell.
    /// `started` is the monotonic time, ns, or 0 if the step is not timed.
    #[inline]
    pub fn begin(&self, by_worker: bool, started: u64) {
        count(&self.ticks);
        self.begin_call(by_worker, started);
    }

    /// Begins another call of the module, watched like a step and not counted as one.
    #[inline]
    pub fn begin_call(&self, by_worker: bool, started: u64) {
        self.started.store(started, Ordering::Relaxed);
        let calls = self.word.load(Ordering::Relaxed) & !(STATE | BY_WORKER);
        let by_worker = if by_worker { BY_WORKER } else { 0 };
        self.word.store(calls.wrapping_add(CALL) | by_worker | RUNNING, Ordering::Release);
    }

    #[inline]
    fn state(&self) -> u64 {
        self.word.load(Ordering::Acquire) & STATE
    }

    /// Changes from one state to another; false if the state is another one.
    #[inline]
    fn transition(&self, from: u64, to: u64) -> bool {
        let word = self.word.load(Ordering::Relaxed);
        word & STATE == from && self.exchange(word, to)
    }

    /// Changes the state from that word; false if the word has changed.
    #[inline]
    fn exchange(&self, word: u64, to: u64) -> bool {
        let next = word & !STATE | to;
        self.word.compare_exchange(word, next, Ordering::AcqRel, Ordering::Relaxed).is_ok()
    }

    /// Changes a state that no other thread ends.
    fn set_state(&self, to: u64) {
        self.word.store(self.word.load(Ordering::Relaxed) & !STATE | to, Ordering::Release);
    }

    /// Claims the cell between two steps; false if it is not idle.
    /// It excludes the module's own thread, or a thread that exchanges its code.
    pub fn claim(&self) -> bool {
        self.transition(IDLE, CLAIMED)
    }

    /// Claims the cell as soon as its step has ended; false when that does not return.
    pub fn claim_when_idle(&self) -> bool {
        while !self.claim() {
            if self.is_late() {
                return false;
            }
            if !self.reclaim() {
                std::thread::sleep(Duration::from_micros(50));
            }
        }
        true
    }

    /// Lets others in again, unless the cell was given up meanwhile.
    pub fn release(&self) {
        // It fails when the cell is late, which then stays so.
        let _ = self.transition(CLAIMED, IDLE);
    }

    /// Makes a call of the module outside its step, watched like one.
    /// `None` if it was given up. The cell is claimed (and stays so) or belongs to the loop.
    pub fn call<R>(&self, claimed: bool, call: impl FnOnce() -> R) -> Option<R> {
        self.begin_call(false, monotonic());
        let result = call();
        let ended = if claimed { self.end_claimed(0) } else { self.end(0) };
        ended.then_some(result)
    }

    /// Returns true if it reads values of the last cycle at the beginning of a cycle.
    /// The plan is made anew when that changes.
    pub fn reads_previous(&self) -> bool {
        self.reads_previous.load(Ordering::Relaxed)
    }

    /// Sets whether it reads values of the last cycle.
    pub fn set_reads_previous(&self, reads_previous: bool) {
        self.reads_previous.store(reads_previous, Ordering::Relaxed);
    }

    /// Returns true if the loop signals the turns of the module's own thread.
    pub fn is_turn_signaled(&self) -> bool {
        self.is_turn_signaled
    }

    /// Signals the turn of a module that waits for it; false for all others.
    #[inline]
    pub fn signal_turn(&self) -> bool {
        if !self.is_turn_signaled {
            return false;
        }
        self.signaled_turns.store(self.signaled_turns.load(Ordering::Relaxed) + 1, Ordering::Release);
        self.wake.notify(1);
        true
    }

    /// Returns the number of turns signaled; `None` if the loop does not signal them.
    pub fn signaled_turns(&self) -> Option<u64> {
        self.is_turn_signaled.then(|| self.signaled_turns.load(Ordering::Acquire))
    }

    /// Lets the module's own thread end.
    pub fn retire(&self) {
        self.retired.store(true, Ordering::Release);
        self.wake.notify(1);
    }

    /// Returns true if the module's own thread must end.
    pub fn is_retired(&self) -> bool {
        self.retired.load(Ordering::Acquire)
    }

    /// Releases the cell and returns its runner once no other owner is left.
    /// Other owners are such as the watchdog. `None` if that takes longer than `limit`.
    pub fn into_runner(self: Arc<Self>, limit: Duration) -> Option<Runner> {
        let (runner_sender, left) = channel();
        // No other sender was set, as a module is released once.
        let _ = self.runner_sender.set(runner_sender);
        drop(self);
        left.recv_timeout(limit).ok()
    }

    /// Ends a step with its return code; false if the step was given up.
    /// If true, the runner still belongs to the caller.
    #[inline]
    pub fn end(&self, code: i32) -> bool {
        self.end_as(IDLE, code)
    }

    /// Acts as [`end`](RunnerCell::end), and the cell stays claimed.
    pub fn end_claimed(&self, code: i32) -> bool {
        self.end_as(CLAIMED, code)
    }

    #[inline]
    fn end_as(&self, next: u64, code: i32) -> bool {
        self.transition(RUNNING, next) || self.end_late(next, code)
    }

    #[cold]
    fn end_late(&self, next: u64, code: i32) -> bool {
        loop {
            match self.state() {
                RUNNING if self.transition(RUNNING, next) => return true,
                LATE => {
                    self.returned.store(monotonic(), Ordering::Relaxed);
                    self.late_code.store(code, Ordering::Relaxed);
                    self.set_state(RETURNED);
                    return false;
                }
                // The watchdog is just publishing the safe values, which takes microseconds.
                _ => std::thread::yield_now(),
            }
        }
    }

    /// Takes back a cell whose late step has returned.
    pub fn reclaim(&self) -> bool {
        if !self.transition(RETURNED, CLAIMED) {
            return false;
        }
        // SAFETY: the late thread is out of the runner, and the cell was claimed.
        unsafe { self.runner() }.reclaim(self.late_code.load(Ordering::Relaxed));
        self.set_state(IDLE);
        true
    }

    /// Returns true if no step runs, so that one may begin.
    #[inline]
    pub fn is_idle(&self) -> bool {
        self.state() == IDLE
    }

    /// Returns true if the running step was given up.
    pub fn is_given_up(&self) -> bool {
        matches!(self.state(), LATE | RETURNED)
    }

    /// Returns true if a step was given up and has not returned.
    pub fn is_late(&self) -> bool {
        self.state() == LATE
    }

    /// Returns true if a worker makes the step that runs, or was given up.
    pub fn is_by_worker(&self) -> bool {
        self.word.load(Ordering::Relaxed) & BY_WORKER != 0
    }

    /// Returns the number of the running step; `None` if none runs.
    pub fn running(&self) -> Option<u64> {
        let word = self.word.load(Ordering::Acquire);
        (word & STATE == RUNNING).then_some(word / CALL)
    }

    /// Gives up a step if it still runs; true if it did.
    /// Its outputs become safe, and its later writes are dropped.
    pub fn give_up(&self, step: u64, now: u64) -> bool {
        let word = self.word.load(Ordering::Relaxed);
        // Else it has ended; the next one belongs to another call.
        if word & STATE != RUNNING || word / CALL != step || !self.exchange(word, CLAIMED) {
            return false;
        }
        // SAFETY: the cell was claimed, so the late thread will not touch the runner.
        unsafe { self.runner() }.give_up(now);
        self.set_state(LATE);
        true
    }

    /// Sets the number of steps; only for the owner of the cell.
    pub fn set_ticks(&self, ticks: u64) {
        self.ticks.store(ticks, Ordering::Relaxed);
    }

    /// Steps begun.
    pub fn ticks(&self) -> u64 {
        self.ticks.load(Ordering::Relaxed)
    }

    /// Measures a step, as [`Runner::measure`] does.
    pub fn measure(&self, runner: &mut Runner, duration: u64, stands_for: u32) {
        self.duration.store(duration, Ordering::Relaxed);
        runner.measure(duration, stands_for);
    }

    /// Returns the duration of the last timed step, wall-clock ns.
    pub fn duration(&self) -> u64 {
        self.duration.load(Ordering::Relaxed)
    }

    /// Returns the monotonic time of the last step's begin, ns; 0 if not timed.
    pub fn started(&self) -> u64 {
        self.started.load(Ordering::Relaxed)
    }

    /// Returns the monotonic time of the return of the last late step, ns.
    pub fn returned(&self) -> u64 {
        self.returned.load(Ordering::Relaxed)
    }

    /// Returns true if a cycle without a turn counts as a miss.
    pub fn misses_its_turn(&self) -> bool {
        self.in_every_cycle && self.is_idle() && self.health.condition() != ModuleCondition::INACTIVE
    }

    /// Counts a turn that it did not get.
    pub fn count_miss(&self) {
        count(&self.health.misses);
    }

    /// Enables recording of its steps.
    pub fn add_track(&self, trace: &Trace) {
        if self.track.get().is_none()
            // A cell that this one takes the place of is still there.
            && let (Ok(track), Ok(label)) = (trace.track_after(&self.name), trace.label(&self.name))
        {
            // Another thread may have made the same.
            let _ = self.track.set((track, label));
        }
    }

    /// Records a step from a monotonic time on, ns; for the driver of the cell.
    pub fn record(&self, shared: &SharedLoop, start: u64, duration: u64, cycle: u64) {
        if let Some((track, label)) = self.track.get() {
            track.record(Span { label: *label, start: shared.clock.at(start), duration, cycle });
        }
    }
}
