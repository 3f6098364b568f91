//! Run of the loop: its end, and the threads that wait for the loop.

use std::any::Any;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::End;

/// More threads than this don't wait for the loop.
const SPARE_THREAD_LIMIT: usize = 2;

/// Present run and its end.
#[derive(Default)]
pub struct LoopRun {
    /// Number of the run; 0 for none.
    running: AtomicU64,
    ending: Mutex<Ending>,
    changed: Condvar,
}

/// Progress of a run's end, and the threads that wait for the loop.
#[derive(Default)]
struct Ending {
    runs: u64,
    end: Option<End>,
    /// True once no thread holds the token.
    is_token_released: bool,
    /// True once all threads of the run are gone, or lost.
    is_over: bool,
    /// Panic of the observer.
    panic: Option<Box<dyn Any + Send>>,
    /// True if the loop was stopped before its first run.
    is_stopped_before_run: bool,
    /// Threads that wait for the token, and tokens that wait for one of them.
    spares: usize,
    tokens: usize,
}

/// Receiver of the loop when a step does not return.
pub(super) enum Successor {
    /// Spare thread, which was notified.
    Spare,
    /// Thread to be started.
    NewThread,
    /// No thread, as the run has ended.
    RunEnded,
}

impl LoopRun {
    fn ending(&self) -> MutexGuard<'_, Ending> {
        self.ending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins the next run; the caller has the token.
    pub(super) fn begin(&self) {
        let mut ending = self.ending();
        let runs = ending.runs + 1;
        let end = ending.is_stopped_before_run.then_some(End::Stopped);
        *ending = Ending { runs, end, spares: ending.spares, ..Ending::default() };
        self.running.store(if ending.end.is_none() { runs } else { 0 }, Ordering::Release);
    }

    /// Returns the number of the present run; 0 for none.
    pub fn number(&self) -> u64 {
        self.running.load(Ordering::Acquire)
    }

    /// Returns true while that run continues.
    pub fn is_in(&self, run: u64) -> bool {
        self.number() == run
    }

    /// Returns true while a run continues.
    pub fn is_running(&self) -> bool {
        self.number() != 0
    }

    /// Ends the run, unless it has ended already.
    pub fn finish(&self, end: End) {
        let mut ending = self.ending();
        if self.running.swap(0, Ordering::AcqRel) != 0 {
            ending.end = Some(end);
        }
        self.changed.notify_all();
    }

    /// Ends the run, or the first one as soon as it begins.
    /// A stop of an agent that has just been made is meant for that one.
    pub fn stop(&self) {
        let mut ending = self.ending();
        ending.is_stopped_before_run = ending.runs == 0;
        drop(ending);
        self.finish(End::Stopped);
    }

    /// Records after the end that no thread holds the token any more.
    pub(super) fn record_token_release(&self) {
        self.ending().is_token_released = true;
        self.changed.notify_all();
    }

    /// Waits until the run has ended and the core is free.
    pub fn wait(&self) -> End {
        let waited = self.changed.wait_while(self.ending(), |ending| !ending.is_token_released);
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
        let waited = self.changed.wait_timeout_while(self.ending(), duration, |ending| !ending.is_over);
        waited.unwrap_or_else(PoisonError::into_inner).0.is_over
    }

    /// Keeps the panic of the application's observer.
    pub(super) fn store_panic(&self, panic: Box<dyn Any + Send>) {
        self.ending().panic = Some(panic);
    }

    /// Ends the run's bookkeeping once all its threads are gone, or lost.
    /// Returns the panic of its observer.
    pub fn close(&self) -> Option<Box<dyn Any + Send>> {
        let mut ending = self.ending();
        ending.is_over = true;
        self.changed.notify_all();
        ending.panic.take()
    }

    /// Passes the token of a late step to a spare thread if one waits.
    pub(super) fn pass_token(&self) -> Successor {
        let mut ending = self.ending();
        if !self.is_running() {
            return Successor::RunEnded;
        }
        if ending.spares <= ending.tokens {
            return Successor::NewThread;
        }
        ending.tokens += 1;
        self.changed.notify_all();
        Successor::Spare
    }

    /// Waits for the loop as a spare thread.
    /// False if the run has ended, or enough others wait.
    pub(super) fn wait_for_token(&self) -> bool {
        let mut ending = self.ending();
        if ending.spares >= SPARE_THREAD_LIMIT || !self.is_running() {
            return false;
        }
        ending.spares += 1;
        let waits = |ending: &mut Ending| ending.tokens == 0 && self.is_running();
        let mut ending = self.changed.wait_while(ending, waits).unwrap_or_else(PoisonError::into_inner);
        ending.spares -= 1;
        // A token that was given must be taken also when the run ends at that moment.
        let has_token = ending.tokens > 0;
        ending.tokens -= usize::from(has_token);
        has_token
    }
}
