use std::cell::UnsafeCell;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use slate_blackboard::wake::Wake;

use super::{RunnerCell, SharedLoop};
use crate::clock::monotonic;
use crate::digest::Digest;
use crate::runner::StepCall;

/// Least work of a level that is given to workers, ns: the cost of a wake-up.
const WAKEUP_COST: u64 = 25_000;

/// Threads that run modules of one level in parallel.
/// The loop pins inputs before and commits outputs after, in order, so that the result does not depend on the threads.
pub struct Workers {
    workers: Vec<Arc<Worker>>,
    is_forced: bool,
}

const FREE: u32 = 0;
const ASSIGNED: u32 = 1;
const DONE: u32 = 2;

/// Return code, beginning (monotonic, ns) and duration (wall-clock ns) of a step.
type StepResult = (i32, u64, u64);

struct Worker {
    wake: Wake,
    /// Wakes the loop; one for all workers, as a thread's first sleep on it allocates.
    done: Arc<Wake>,
    stop: AtomicBool,
    /// [`FREE`], [`ASSIGNED`] or [`DONE`].
    state: AtomicU32,
    /// Cell of a step that was not committed yet.
    uncommitted: UnsafeCell<Option<Arc<RunnerCell>>>,
    job: UnsafeCell<Option<(StepCall, Arc<RunnerCell>)>>,
    result: UnsafeCell<Option<StepResult>>,
}

// SAFETY: `state` says whose turn it is to use the job and the result; `uncommitted` is the loop's.
unsafe impl Sync for Worker {}
// SAFETY: as above; what it holds may be used from any thread.
unsafe impl Send for Worker {}

impl Workers {
    /// Starts `count` threads; `is_forced` uses them also for small work, for tests.
    ///
    /// # Errors
    /// When a thread can't be started.
    pub fn start(count: usize, is_forced: bool) -> io::Result<Self> {
        let done = Arc::new(Wake::new());
        let workers: Vec<_> = (0..count)
            .map(|_| {
                Arc::new(Worker {
                    wake: Wake::new(),
                    done: Arc::clone(&done),
                    stop: AtomicBool::new(false),
                    state: AtomicU32::new(FREE),
                    uncommitted: UnsafeCell::new(None),
                    job: UnsafeCell::new(None),
                    result: UnsafeCell::new(None),
                })
            })
            .collect();
        for (number, worker) in (1..).zip(&workers) {
            let worker = Arc::clone(worker);
            let thread = std::thread::Builder::new().name(format!("worker {number}"));
            thread.spawn(move || worker.serve())?;
        }
        Ok(Self { workers, is_forced })
    }

    /// Returns true if there are worker threads.
    #[inline]
    pub fn has_threads(&self) -> bool {
        !self.workers.is_empty()
    }

    /// Returns true if running these modules in parallel is worth a wake-up.
    pub fn is_worthwhile(&self, modules: &[Arc<RunnerCell>]) -> bool {
        if modules.len() < 2 || modules.iter().any(|cell| cell.is_exclusive) {
            return false;
        }
        let work: u64 = modules.iter().map(|cell| cell.duration()).sum();
        self.is_forced || work > 2 * WAKEUP_COST
    }

    /// Prepares the first of the modules, and gives one to each free worker.
    /// One more is for the loop. Returns the number of modules; the last of them is the loop's, with its call if it is
    /// due.
    pub fn dispatch(&self, modules: &[Arc<RunnerCell>], now: u64, nominal: u64) -> (usize, Option<StepCall>) {
        let mut count = 0;
        for worker in &self.workers {
            if count + 1 < modules.len() && worker.is_free() {
                let cell = &modules[count];
                if let Some(call) = prepare_due_beside(cell, now, nominal) {
                    cell.begin(true, monotonic());
                    worker.dispatch(call, Arc::clone(cell));
                }
                count += 1;
            }
        }
        (count + 1, prepare_due_beside(&modules[count], now, nominal))
    }

    /// Waits for the workers and commits their steps, in the order of dispatch.
    /// Their steps are recorded if the number of the `traced` cycle is given.
    pub fn commit(
        &self,
        shared: &SharedLoop,
        now: u64,
        traced: Option<u64>,
        mut digest: Option<&mut Digest>,
    ) {
        for worker in &self.workers {
            // SAFETY: only the holder of the loop's token uses it.
            let Some(cell) = (unsafe { (*worker.uncommitted.get()).take() }) else { continue };
            if let Some((code, start, duration)) = worker.finish(&cell) {
                if let Some(cycle) = traced {
                    cell.record(shared, start, duration, cycle);
                }
                // SAFETY: the step has ended and was not given up.
                let runner = unsafe { cell.runner() };
                runner.log.release();
                cell.measure(runner, duration, 1);
                runner.count();
                runner.commit(now, code, digest.as_deref_mut());
            }
        }
    }
}

/// Returns whether a module is due.
/// Periods are counted in the `nominal` time of the cycle, so that a module is not a cycle late because its thread woke
/// up a little later the cycle before.
#[inline(always)] // Part of every step.
fn is_due(cell: &RunnerCell, nominal: u64) -> bool {
    if cell.signal_turn() || !cell.is_idle() && !cell.reclaim() {
        return false;
    }
    // SAFETY: the caller holds the token and the cell is idle; the reference ends here.
    unsafe { cell.runner() }.is_due(nominal)
}

/// Prepares a module that is due, for a step alone.
#[inline(always)] // Part of every step.
pub(super) fn prepare_due(cell: &RunnerCell, now: u64, nominal: u64) -> Option<StepCall> {
    if !is_due(cell, nominal) {
        return None;
    }
    // SAFETY: the caller holds the token and the cell is idle; the references end before the step.
    let runner = unsafe { cell.runner() };
    if cell.is_isolated {
        runner.prepare(now);
    } else {
        // SAFETY: the loop makes this step and no other one at that time, so the modules that write in turn, which are its
        // own, wait for it; or for the watchdog, which gives it up.
        unsafe { runner.prepare_in_turn(now) };
    }
    Some(runner.call())
}

/// Prepares a module that is due, for a step beside others.
fn prepare_due_beside(cell: &RunnerCell, now: u64, nominal: u64) -> Option<StepCall> {
    if !is_due(cell, nominal) {
        return None;
    }
    // SAFETY: the caller holds the token and the cell is idle; the references end before the step.
    let runner = unsafe { cell.runner() };
    runner.log.hold();
    runner.prepare(now);
    Some(runner.call())
}

impl Drop for Workers {
    fn drop(&mut self) {
        for worker in &self.workers {
            worker.stop.store(true, Ordering::Release);
            worker.wake.notify(1);
        }
    }
}

impl Worker {
    /// Returns true if it can take a job.
    /// A worker that was lost to a late step is free again when that returns.
    fn is_free(&self) -> bool {
        self.state.compare_exchange(DONE, FREE, Ordering::AcqRel, Ordering::Relaxed).is_ok()
            || self.state.load(Ordering::Acquire) == FREE
    }

    fn dispatch(&self, call: StepCall, cell: Arc<RunnerCell>) {
        // SAFETY: the worker is free, so it does not look at the job; the loop alone uses `uncommitted`.
        unsafe {
            *self.uncommitted.get() = Some(Arc::clone(&cell));
            *self.job.get() = Some((call, cell));
        }
        self.state.store(ASSIGNED, Ordering::Release);
        self.wake.notify(1);
    }

    /// Waits for the step of that cell; `None` if it was given up.
    fn finish(&self, cell: &RunnerCell) -> Option<StepResult> {
        loop {
            match self.state.load(Ordering::Acquire) {
                DONE => break,
                _ if cell.is_given_up() => return None,
                _ => self.done.wait_timeout(Duration::from_millis(10)),
            };
        }
        // SAFETY: the worker is done with the result.
        let ended = unsafe { (*self.result.get()).take() };
        self.state.store(FREE, Ordering::Relaxed);
        ended
    }

    fn serve(&self) {
        while !self.stop.load(Ordering::Acquire) {
            if self.state.load(Ordering::Acquire) != ASSIGNED {
                self.wake.wait_timeout(Duration::from_millis(100));
                continue;
            }
            // SAFETY: the state is GIVEN, so the job belongs to this thread.
            let Some((call, cell)) = (unsafe { (*self.job.get()).take() }) else { continue };
            let start = monotonic();
            // SAFETY: the loop prepared the runner, and the cell keeps others out.
            let code = unsafe { call.make() };
            let ended = cell.end(code).then(|| (code, start, monotonic().saturating_sub(start)));
            // SAFETY: the loop looks at the result only when the state is DONE.
            unsafe { *self.result.get() = ended };
            self.state.store(DONE, Ordering::Release);
            self.done.notify(1);
        }
    }
}
