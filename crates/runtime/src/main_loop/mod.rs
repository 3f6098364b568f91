//! The main loop: stages in order, and in each stage the modules in the order of their links.
//!
//! The loop is a token, not a thread: when a step hangs on the wall clock, the watchdog moves the loop to another
//! thread and goes on without the late module. Under a time source the loop is in lockstep: everything depends on the
//! virtual time alone, and a step that hangs ends the run.

mod pace;
mod seat;
mod threads;
mod watchdog;
mod workers;

use std::cell::UnsafeCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

use slate_blackboard::Board;
use slate_module::Level as LogLevel;

use crate::actuators::Actuator;
use crate::clock::Clock;
use crate::digest::Digest;
use crate::log::Logger;
use crate::runner::Committed;

pub(crate) use pace::Pace;
pub use pace::Rate;
pub(crate) use seat::Seat;
pub(crate) use threads::ModuleThreads;
pub(crate) use watchdog::Watchdog;
pub(crate) use workers::Workers;

/// What the application sees at the end of a cycle.
#[derive(Debug)]
pub struct Cycle<'a> {
    /// The agent's time, nanoseconds.
    pub now: u64,
    /// Counts cycles from 1.
    pub number: u64,
    /// Everything that the robot knows.
    pub board: &'a Board,
}

/// What the application wants after a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// The next cycle.
    Continue,
    /// The end of the run.
    Stop,
}

/// What is called at the end of each cycle, on the loop's thread.
pub type Observer = Box<dyn FnMut(&Cycle<'_>) -> Control + Send>;

/// Why a run ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// The observer, or somebody else, asked for it.
    Stopped,
    /// A step did not return, and in lockstep nothing can go on without it.
    Hung {
        /// The module.
        module: String,
    },
    /// Too many threads were lost to steps that did not return.
    TooManyHung {
        /// The modules.
        modules: Vec<String>,
    },
}

/// What the loop works on. Whoever holds the token has it alone.
pub(crate) struct Core {
    /// The seats of each stage, in order; a level holds modules that do not depend on each other.
    pub stages: Vec<Vec<Level>>,
    pub actuators: Vec<Arc<Actuator>>,
    pub digest: Option<Digest>,
    pub pace: Pace,
    pub observer: Option<Observer>,
    pub workers: Workers,
    pub cycle: u64,
    /// Where the loop stands, for the thread that takes the token over.
    position: Position,
    overruns: u64,
}

/// Modules of one stage that do not depend on each other.
pub(crate) type Level = Vec<Arc<Seat>>;

#[derive(Clone, Copy, Debug, Default)]
struct Position {
    stage: usize,
    level: usize,
    seat: usize,
    /// Whether the cycle has begun.
    inside: bool,
}

/// The loop as all threads see it.
pub(crate) struct Shared {
    pub board: Arc<Board>,
    pub clock: Arc<Clock>,
    pub logger: Arc<Logger>,
    pub period: u64,
    pub lockstep: bool,
    pub stop: AtomicBool,
    core: UnsafeCell<Core>,
    end: Mutex<Option<End>>,
    ended: Condvar,
}

// SAFETY: the core is used only by the thread that holds the token.
unsafe impl Sync for Shared {}

impl Shared {
    #[allow(clippy::too_many_arguments, reason = "the parts of a loop, each named once")]
    pub fn new(
        board: Arc<Board>,
        clock: Arc<Clock>,
        logger: Arc<Logger>,
        period: u64,
        lockstep: bool,
        stages: Vec<Vec<Level>>,
        actuators: Vec<Arc<Actuator>>,
        digest: Option<Digest>,
        workers: Workers,
        pace: Pace,
    ) -> Self {
        let core = Core {
            stages,
            actuators,
            digest,
            pace,
            observer: None,
            workers,
            cycle: 0,
            position: Position::default(),
            overruns: 0,
        };
        Self {
            board,
            clock,
            logger,
            period,
            lockstep,
            stop: AtomicBool::new(false),
            core: UnsafeCell::new(core),
            end: Mutex::new(None),
            ended: Condvar::new(),
        }
    }

    /// The core.
    ///
    /// # Safety
    /// The caller holds the token, or nobody does.
    #[allow(clippy::mut_from_ref, reason = "the token grants the access")]
    pub unsafe fn core(&self) -> &mut Core {
        // SAFETY: passed on to the caller.
        unsafe { &mut *self.core.get() }
    }

    /// Before a run.
    pub fn begin(&self) {
        *self.end.lock().unwrap_or_else(PoisonError::into_inner) = None;
        self.stop.store(false, Ordering::Release);
    }

    /// Ends the run, unless it has ended already.
    pub fn finish(&self, end: End) {
        let mut slot = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        slot.get_or_insert(end);
        self.stop.store(true, Ordering::Release);
        self.ended.notify_all();
    }

    /// Waits for the end of the run.
    pub fn wait(&self) -> End {
        let mut slot = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            match slot.clone() {
                Some(end) => return end,
                None => slot = self.ended.wait(slot).unwrap_or_else(PoisonError::into_inner),
            }
        }
    }
}

/// Drives the loop until the run ends or this thread loses the token.
pub(crate) fn drive(shared: &Shared) {
    while !shared.stop.load(Ordering::Acquire) {
        match cycle(shared) {
            Flow::Next => {}
            Flow::Stop => return shared.finish(End::Stopped),
            Flow::Lost => return,
        }
    }
    shared.finish(End::Stopped);
}

/// How a cycle ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Flow {
    Next,
    Stop,
    /// The step that this thread made was given up: another thread has the loop.
    Lost,
}

/// One cycle, or the rest of one that another thread began.
pub(crate) fn cycle(shared: &Shared) -> Flow {
    // SAFETY: this thread holds the token; every reference ends before a step is made, as the step may lose it.
    let now = unsafe {
        let core = shared.core();
        if !core.position.inside {
            let behind = core.pace.wait(shared, core.cycle);
            if behind > 0 {
                core.overruns += 1;
                if core.overruns.is_power_of_two() {
                    let text = format!(
                        "the main loop took {:.1} ms longer than its period ({} overruns)",
                        behind as f64 * 1e-6,
                        core.overruns
                    );
                    shared.logger.log(shared.clock.now(), LogLevel::Warn, &text);
                }
            }
            if shared.lockstep || matches!(*shared.clock, Clock::Driven(_)) {
                shared.clock.set(core.cycle * shared.period);
            }
            core.cycle += 1;
            core.position = Position { inside: true, ..Position::default() };
        }
        shared.clock.now()
    };
    loop {
        // SAFETY: as above.
        let seat = unsafe {
            let core = shared.core();
            let position = core.position;
            let Some(stage) = core.stages.get(position.stage) else { break };
            let Some(level) = stage.get(position.level) else {
                core.position = Position { stage: position.stage + 1, level: 0, seat: 0, inside: true };
                continue;
            };
            if position.seat == 0 && core.workers.pays(level) {
                core.position = Position { level: position.level + 1, ..position };
                // Raw, as the core must not be borrowed while steps are made.
                let (level, workers): (*const Level, *const Workers) = (level, &raw const core.workers);
                let digest = core.digest.as_mut().map(std::ptr::from_mut);
                if !(*workers).run(&*level, now, digest.map(|digest| &mut *digest)) {
                    return Flow::Lost;
                }
                continue;
            }
            let Some(seat) = level.get(position.seat) else {
                core.position = Position { level: position.level + 1, seat: 0, ..position };
                continue;
            };
            core.position.seat += 1;
            Arc::as_ptr(seat)
        };
        // SAFETY: the core keeps the seat alive, and seats are never removed while the loop runs.
        if !step(shared, unsafe { &*seat }, now) {
            return Flow::Lost;
        }
    }
    // SAFETY: as above; no step is left in this cycle.
    let core = unsafe { shared.core() };
    core.position.inside = false;
    for actuator in &core.actuators {
        actuator.expire(now, core.digest.as_mut());
    }
    let Some(observer) = core.observer.as_mut() else { return Flow::Next };
    match observer(&Cycle { now, number: core.cycle, board: &shared.board }) {
        Control::Continue => Flow::Next,
        Control::Stop => Flow::Stop,
    }
}

/// One module's step, if it is due; false when the step was given up while this thread made it.
fn step(shared: &Shared, seat: &Seat, now: u64) -> bool {
    if !seat.is_idle() && !seat.readmit() {
        return true;
    }
    // SAFETY: the caller holds the token and the seat is idle; the references end before the step.
    let call = unsafe {
        let runner = seat.runner();
        if !runner.is_due(now) {
            return true;
        }
        runner.log.set_time(now);
        runner.prepare(now);
        runner.call()
    };
    seat.begin();
    let start = measured();
    // SAFETY: the runner was prepared, and the seat keeps others out.
    let code = unsafe { call.make() };
    let duration = start.elapsed().as_nanos() as u64;
    if !seat.end() {
        return false;
    }
    // SAFETY: the step was not given up, so this thread still holds the token.
    unsafe {
        let runner = seat.runner();
        runner.time(duration);
        let digest = shared.core().digest.as_mut();
        let _: Committed = runner.commit(now, code, digest);
    }
    true
}

/// The start of a step.
#[allow(clippy::disallowed_methods, reason = "the host measures its modules; nothing they see depends on it")]
fn measured() -> std::time::Instant {
    std::time::Instant::now()
}
