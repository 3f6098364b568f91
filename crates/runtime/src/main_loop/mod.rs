//! The main loop: stages in order, and in each stage the modules in the order of their links.
//!
//! The loop is a token, not a thread: when a step hangs on the wall clock, the watchdog moves the loop to another
//! thread and goes on without the late module. Under a time source the loop is in lockstep: everything depends on the
//! virtual time alone, and a step that hangs ends the run.

mod jobs;
mod pace;
mod seat;
mod threads;
mod watchdog;
mod workers;

use std::any::Any;
use std::cell::UnsafeCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use slate_blackboard::Board;
use slate_module::Level as LogLevel;

use crate::actuators::Actuator;
use crate::clock::Clock;
use crate::digest::Digest;
use crate::log::Logger;
use crate::runner::StepCall;

use jobs::{Jobs, Token};
pub(crate) use pace::Pace;
pub use pace::Rate;
pub(crate) use seat::Seat;
pub(crate) use threads::ModuleThreads;
pub(crate) use watchdog::{Watchdog, Watched};
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
    order: Order,
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

/// The modules of the loop in the order in which they run.
#[derive(Default)]
pub(crate) struct Order {
    seats: Vec<Arc<Seat>>,
    /// For each seat, where its level ends: modules up to there do not depend on each other.
    ends: Vec<usize>,
}

impl Order {
    /// From the levels of all stages.
    pub fn new(levels: impl Iterator<Item = Vec<Arc<Seat>>>) -> Self {
        let (mut seats, mut ends) = (Vec::new(), Vec::new());
        for level in levels {
            seats.extend(level);
            ends.resize(seats.len(), seats.len());
        }
        Self { seats, ends }
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Position {
    /// Whether the cycle has begun.
    inside: bool,
    /// The next seat.
    seat: usize,
    /// Whether workers were given steps that are not committed yet.
    helped: bool,
}

/// The loop as all threads see it.
pub(crate) struct Shared {
    pub board: Arc<Board>,
    pub clock: Arc<Clock>,
    pub logger: Arc<Logger>,
    pub period: u64,
    pub lockstep: bool,
    /// The number of the run that goes on; 0 for none.
    running: AtomicU64,
    core: UnsafeCell<Core>,
    token: Token,
    jobs: Jobs,
    watched: Mutex<Watched>,
    /// For a stop, which waits for nothing else.
    gates: Mutex<Arc<[Arc<Actuator>]>>,
    threads: Mutex<ModuleThreads>,
    ending: Mutex<Ending>,
    changed: Condvar,
}

/// How far the end of a run is.
#[derive(Default)]
struct Ending {
    runs: u64,
    end: Option<End>,
    /// Whether no thread holds the token any more.
    token_down: bool,
    /// Whether all threads of the run are gone, or lost.
    over: bool,
    /// What the observer panicked with.
    panic: Option<Box<dyn Any + Send>>,
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
        digest: Option<Digest>,
        workers: Workers,
        pace: Pace,
    ) -> Self {
        let core = Core {
            order: Order::default(),
            actuators: Vec::new(),
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
            running: AtomicU64::new(0),
            core: UnsafeCell::new(core),
            token: Token::default(),
            jobs: Jobs::default(),
            watched: Mutex::new(Arc::from([])),
            gates: Mutex::new(Arc::from([])),
            threads: Mutex::default(),
            ending: Mutex::default(),
            changed: Condvar::new(),
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

    fn ending(&self) -> MutexGuard<'_, Ending> {
        self.ending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The modules that the watchdog watches.
    pub fn watched(&self) -> Watched {
        Arc::clone(&self.watched.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The gates.
    pub fn actuators(&self) -> Arc<[Arc<Actuator>]> {
        Arc::clone(&self.gates.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The threads of modules.
    pub fn threads(&self) -> MutexGuard<'_, ModuleThreads> {
        self.threads.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// From the next cycle on the loop runs these modules, and ends stale commands of these actuators.
    pub fn compose(&self, order: Order, mut actuators: Vec<Arc<Actuator>>, watched: Watched) {
        *self.watched.lock().unwrap_or_else(PoisonError::into_inner) = watched;
        *self.gates.lock().unwrap_or_else(PoisonError::into_inner) = actuators.iter().cloned().collect();
        let exchanged = self.between_cycles(&[], move |shared| {
            // SAFETY: jobs are done by who has the token.
            let core = unsafe { shared.core() };
            let order = std::mem::replace(&mut core.order, order);
            std::mem::swap(&mut core.actuators, &mut actuators);
            Some((order, actuators))
        });
        // What is no longer needed is dropped here and not on the loop.
        drop(exchanged);
    }

    /// Takes the token for a single cycle.
    pub fn take_token(&self) {
        self.token.take();
    }

    /// Gives it back.
    pub fn give_token_back(&self) {
        self.token.give_back();
    }

    /// Before a run.
    pub fn begin(&self) {
        self.token.take();
        let mut ending = self.ending();
        let runs = ending.runs + 1;
        *ending = Ending { runs, ..Ending::default() };
        self.running.store(runs, Ordering::Release);
    }

    /// The number of the run that goes on.
    pub fn run(&self) -> u64 {
        self.running.load(Ordering::Acquire)
    }

    /// Whether that run goes on.
    pub fn is_in(&self, run: u64) -> bool {
        self.run() == run
    }

    /// Whether a run goes on.
    pub fn is_running(&self) -> bool {
        self.run() != 0
    }

    /// Ends the run, unless it has ended already.
    pub fn finish(&self, end: End) {
        let mut ending = self.ending();
        if self.running.swap(0, Ordering::AcqRel) != 0 {
            ending.end = Some(end);
        }
        self.changed.notify_all();
    }

    /// After the end: says that no thread works on the core any more.
    pub fn put_token_down(&self) {
        self.ending().token_down = true;
        self.token.give_back();
        self.changed.notify_all();
    }

    /// Waits until the run has ended and the core is free.
    pub fn wait(&self) -> End {
        let waited = self.changed.wait_while(self.ending(), |ending| !ending.token_down);
        waited.unwrap_or_else(PoisonError::into_inner).end.take().unwrap_or(End::Stopped)
    }

    /// Sleeps, but not beyond the end of the run.
    pub fn sleep(&self, duration: Duration) {
        if self.is_running() {
            // An error says that a thread panicked while it had the lock, which is no reason to sleep.
            let _ = self.changed.wait_timeout_while(self.ending(), duration, |_| self.is_running());
        } else {
            std::thread::sleep(duration);
        }
    }

    /// Sleeps; true when the run is over before that.
    pub fn is_over_within(&self, duration: Duration) -> bool {
        let waited = self.changed.wait_timeout_while(self.ending(), duration, |ending| !ending.over);
        waited.unwrap_or_else(PoisonError::into_inner).0.over
    }

    /// Says that all threads of the run are gone, or lost. Returns what its observer panicked with.
    pub fn close(&self) -> Option<Box<dyn Any + Send>> {
        let mut ending = self.ending();
        ending.over = true;
        self.changed.notify_all();
        ending.panic.take()
    }
}

/// Drives the loop until the run ends or this thread loses the token.
pub(crate) fn drive(shared: &Shared) {
    let cycles = || {
        while shared.is_running() {
            match cycle(shared) {
                Flow::Next => {}
                Flow::Stop => break,
                Flow::Lost => return false,
            }
        }
        true
    };
    match catch_unwind(AssertUnwindSafe(cycles)) {
        Ok(true) => {}
        Ok(false) => return,
        // The application's observer; modules don't let a panic out.
        Err(panic) => shared.ending().panic = Some(panic),
    }
    shared.finish(End::Stopped);
    shared.put_token_down();
}

/// How a cycle ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Flow {
    Next,
    Stop,
    /// The step that this thread made was given up: another thread has the loop.
    Lost,
}

/// Reading the clock takes longer than a short step, so steps without a deadline are timed in one cycle of so many.
const SAMPLED: u64 = 16;

/// One cycle, or the rest of one that another thread began.
pub(crate) fn cycle(shared: &Shared) -> Flow {
    // SAFETY: this thread holds the token; every reference ends before a step is made, as the step may lose it.
    let (now, sampled) = unsafe {
        let core = shared.core();
        (begin_cycle(shared, core), core.cycle % SAMPLED == 1)
    };
    let mut mark = None;
    loop {
        // SAFETY: as above.
        let (seat, call) = unsafe {
            match next_step(shared.core(), now) {
                Next::Step(seat, call) => (&*seat, call),
                Next::Nothing => continue,
                Next::End => break,
            }
        };
        let start = (sampled || seat.has_deadline).then(|| mark.take().unwrap_or_else(measured));
        seat.begin(false);
        // SAFETY: the runner was prepared, and the seat keeps others out.
        let code = unsafe { call.make() };
        if !seat.end() {
            return Flow::Lost;
        }
        let duration = start.map(|start| {
            let end = measured();
            // The end of a step is the beginning of the next.
            mark = Some(end);
            nanoseconds(start, end)
        });
        // SAFETY: the step was not given up, so this thread still holds the token.
        unsafe {
            let core = shared.core();
            if core.position.helped {
                core.position.helped = false;
                core.workers.commit(now, core.digest.as_mut());
                seat.runner().log.release();
                mark = None;
            }
            let runner = seat.runner();
            runner.time(duration);
            runner.commit(now, code, core.digest.as_mut());
        }
    }
    // SAFETY: as above; no step is left in this cycle.
    let core = unsafe { shared.core() };
    core.position.inside = false;
    for actuator in &core.actuators {
        actuator.expire(now, core.digest.as_mut());
    }
    let control = core.observer.as_mut().map_or(Control::Continue, |observer| {
        observer(&Cycle { now, number: core.cycle, board: &shared.board })
    });
    // In what is left of the period, so that no cycle is late for it.
    if let Some(job) = shared.jobs.next()
        && job(shared) == Flow::Lost
    {
        return Flow::Lost;
    }
    match control {
        Control::Continue => Flow::Next,
        Control::Stop => Flow::Stop,
    }
}

/// Waits for the beginning of a cycle, unless it has begun; returns its time.
fn begin_cycle(shared: &Shared, core: &mut Core) -> u64 {
    if core.position.inside {
        return shared.clock.now();
    }
    let behind = core.pace.wait(shared, core.cycle);
    // In lockstep only the pace suffers, and nothing that a module sees.
    if behind > 0 && !shared.lockstep {
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
    shared.clock.set(core.cycle * shared.period);
    core.cycle += 1;
    core.position = Position { inside: true, ..Position::default() };
    shared.clock.now()
}

/// What the loop does next.
enum Next {
    /// A step that is prepared. The core keeps the seat alive, and seats are never removed while the loop runs.
    Step(*const Seat, StepCall),
    /// The module is not due.
    Nothing,
    /// The cycle is at its end.
    End,
}

fn next_step(core: &mut Core, now: u64) -> Next {
    let position = &mut core.position;
    if position.helped {
        // The thread that gave the steps to the workers was lost.
        position.helped = false;
        core.workers.commit(now, core.digest.as_mut());
    }
    let first = position.seat;
    let Some(&end) = core.order.ends.get(first) else { return Next::End };
    let rest = &core.order.seats[first..end];
    let (count, call) = if core.workers.pay(rest) {
        position.helped = true;
        core.workers.give(rest, now)
    } else {
        (1, workers::ready(&rest[0], now, false))
    };
    position.seat += count;
    match call {
        Some(call) => Next::Step(Arc::as_ptr(&rest[count - 1]), call),
        None => Next::Nothing,
    }
}

/// A moment of the wall clock.
#[allow(clippy::disallowed_methods, reason = "the host measures its modules; nothing they see depends on it")]
fn measured() -> Instant {
    Instant::now()
}

/// From one moment to another.
fn nanoseconds(start: Instant, end: Instant) -> u64 {
    end.saturating_duration_since(start).as_nanos() as u64
}
