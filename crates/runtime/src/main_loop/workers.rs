use std::cell::UnsafeCell;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use slate_blackboard::wake::Wake;

use super::{Level, Seat};
use crate::digest::Digest;
use crate::runner::StepCall;

/// A wake-up costs that much, so less work than this is done in line.
const WORTH_WAKING: u64 = 25_000;

/// Threads that help with the modules of one level. Inputs are pinned before and outputs committed after, in order,
/// by the loop, so that the result does not depend on who does what.
pub(crate) struct Workers {
    workers: Vec<Arc<Worker>>,
    always: bool,
}

const FREE: u32 = 0;
const GIVEN: u32 = 1;
const DONE: u32 = 2;

/// What a step returned, and how many wall-clock nanoseconds it took.
type Ended = (i32, u64);

struct Worker {
    wake: Wake,
    done: Wake,
    stop: AtomicBool,
    /// [`FREE`], [`GIVEN`] or [`DONE`].
    state: AtomicU32,
    job: UnsafeCell<Option<(StepCall, Arc<Seat>)>>,
    result: UnsafeCell<Option<Ended>>,
}

// SAFETY: `state` says whose turn it is to use the job and the result.
unsafe impl Sync for Worker {}
// SAFETY: as above; what it holds may be used from any thread.
unsafe impl Send for Worker {}

impl Workers {
    /// That many threads; `always` uses them also for work that is not worth it, for tests.
    ///
    /// # Errors
    /// When a thread can't be started.
    pub fn start(count: usize, always: bool) -> io::Result<Self> {
        let workers: Vec<_> = (0..count)
            .map(|_| {
                Arc::new(Worker {
                    wake: Wake::new(),
                    done: Wake::new(),
                    stop: AtomicBool::new(false),
                    state: AtomicU32::new(FREE),
                    job: UnsafeCell::new(None),
                    result: UnsafeCell::new(None),
                })
            })
            .collect();
        for worker in &workers {
            let worker = Arc::clone(worker);
            std::thread::Builder::new().name("worker".into()).spawn(move || worker.serve())?;
        }
        Ok(Self { workers, always })
    }

    /// Whether helping with these modules is worth a wake-up.
    pub fn pays(&self, level: &Level) -> bool {
        if self.workers.is_empty() || level.len() < 2 {
            return false;
        }
        let work: u64 = level.iter().map(|seat| seat.health.duration.load(Ordering::Relaxed)).sum();
        self.always || work > 2 * WORTH_WAKING
    }

    /// One step of each module that is due; false when the step that this thread made was given up.
    pub fn run(&self, level: &Level, now: u64, mut digest: Option<&mut Digest>) -> bool {
        // One round: a step for each worker that is free, and one in line.
        for round in level.chunks(self.workers.len() + 1) {
            let (own, helped) = (&round[round.len() - 1], &round[..round.len() - 1]);
            for (worker, seat) in self.workers.iter().zip(helped) {
                if worker.is_free() && ready(seat, now) {
                    // SAFETY: the seat is idle and this thread holds the token.
                    let call = unsafe { seat.runner() }.call();
                    seat.begin();
                    worker.give(call, Arc::clone(seat));
                }
            }
            if ready(own, now) {
                // SAFETY: as above.
                let call = unsafe { own.runner() }.call();
                own.begin();
                // SAFETY: the runner was prepared, and the seat keeps others out.
                let code = unsafe { call.make() };
                if !own.end() {
                    return false;
                }
                self.commit_round(helped, now, digest.as_deref_mut());
                // SAFETY: the step was not given up.
                unsafe { own.runner() }.commit(now, code, digest.as_deref_mut());
            } else {
                self.commit_round(helped, now, digest.as_deref_mut());
            }
        }
        true
    }

    fn commit_round(&self, helped: &[Arc<Seat>], now: u64, mut digest: Option<&mut Digest>) {
        for (worker, seat) in self.workers.iter().zip(helped) {
            if let Some((code, duration)) = worker.finish(seat) {
                // SAFETY: the step has ended and was not given up.
                let runner = unsafe { seat.runner() };
                runner.time(duration);
                runner.commit(now, code, digest.as_deref_mut());
            }
        }
    }
}

/// Prepares a module that is due.
fn ready(seat: &Seat, now: u64) -> bool {
    if !seat.is_idle() && !seat.readmit() {
        return false;
    }
    // SAFETY: the caller holds the token and the seat is idle.
    let runner = unsafe { seat.runner() };
    let due = runner.is_due(now);
    if due {
        runner.log.set_time(now);
        runner.prepare(now);
    }
    due
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
    /// Whether it can take a job; one that was lost to a late step comes back when that returns.
    fn is_free(&self) -> bool {
        self.state.compare_exchange(DONE, FREE, Ordering::AcqRel, Ordering::Relaxed).is_ok()
            || self.state.load(Ordering::Acquire) == FREE
    }

    fn give(&self, call: StepCall, seat: Arc<Seat>) {
        // SAFETY: the worker is free, so it does not look at the job.
        unsafe { *self.job.get() = Some((call, seat)) };
        self.state.store(GIVEN, Ordering::Release);
        self.wake.notify(1);
    }

    /// Waits for the step of that seat; nothing when none was given, or when it was given up.
    fn finish(&self, seat: &Seat) -> Option<Ended> {
        loop {
            match self.state.load(Ordering::Acquire) {
                FREE => return None,
                DONE => break,
                _ if seat.is_given_up() => return None,
                _ => self.done.wait_timeout(Duration::from_millis(10)),
            };
        }
        // SAFETY: the worker is done with the result.
        let ended = unsafe { (*self.result.get()).take() };
        self.state.store(FREE, Ordering::Relaxed);
        ended
    }

    #[allow(
        clippy::disallowed_methods,
        reason = "the host measures its modules; nothing they see depends on it"
    )]
    fn serve(&self) {
        while !self.stop.load(Ordering::Acquire) {
            if self.state.load(Ordering::Acquire) != GIVEN {
                self.wake.wait_timeout(Duration::from_millis(100));
                continue;
            }
            // SAFETY: the state is GIVEN, so the job belongs to this thread.
            let Some((call, seat)) = (unsafe { (*self.job.get()).take() }) else { continue };
            let start = std::time::Instant::now();
            // SAFETY: the loop prepared the runner, and the seat keeps others out.
            let code = unsafe { call.make() };
            let ended = seat.end().then(|| (code, start.elapsed().as_nanos() as u64));
            // SAFETY: the loop looks at the result only when the state is DONE.
            unsafe { *self.result.get() = ended };
            self.state.store(DONE, Ordering::Release);
            self.done.notify(1);
        }
    }
}
