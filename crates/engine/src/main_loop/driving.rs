//! The threads that have the loop: one at a time, and spare ones for when a step does not return.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, MutexGuard, PoisonError};
use std::time::Duration;

use super::{End, Flow, Shared, cycle};
use std::sync::atomic::Ordering;

/// How far the end of a run is, and which threads wait for the loop.
#[derive(Default)]
pub(super) struct Ending {
    runs: u64,
    end: Option<End>,
    /// Whether no thread holds the token any more.
    token_down: bool,
    /// Whether all threads of the run are gone, or lost.
    over: bool,
    /// What the observer panicked with.
    panic: Option<Box<dyn Any + Send>>,
    /// Whether it was stopped before the first run.
    stopped_before: bool,
    /// Threads that wait for the token, and tokens that wait for one of them.
    spares: usize,
    tokens: usize,
}

/// More threads than this don't wait for the loop.
const SPARES: usize = 2;

/// Drives the loop until the run ends. When a step that this thread made was given up, another thread has the loop, and
/// this one waits for it to be lost in turn.
pub fn drive(shared: &Shared) {
    let cycles = || {
        while shared.is_running() {
            match cycle(shared) {
                Flow::Next => shared.change_here(),
                Flow::Stop => break,
                Flow::Lost => return false,
            }
        }
        true
    };
    loop {
        match catch_unwind(AssertUnwindSafe(cycles)) {
            Ok(true) => break,
            Ok(false) if shared.wait_for_token() => {}
            Ok(false) => return,
            // The application's observer; modules don't let a panic out.
            Err(panic) => {
                shared.ending().panic = Some(panic);
                break;
            }
        }
    }
    shared.finish(End::Stopped);
    shared.put_token_down();
}

impl Shared {
    fn ending(&self) -> MutexGuard<'_, Ending> {
        self.run.ending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Before a run.
    pub fn begin(&self) {
        self.token.take();
        // SAFETY: the token was taken.
        unsafe { self.core() }.pace.restart();
        let mut ending = self.ending();
        let runs = ending.runs + 1;
        let end = ending.stopped_before.then_some(End::Stopped);
        *ending = Ending { runs, end, spares: ending.spares, ..Ending::default() };
        self.run.running.store(if ending.end.is_none() { runs } else { 0 }, Ordering::Release);
    }

    /// The number of the run that goes on.
    pub fn run(&self) -> u64 {
        self.run.running.load(Ordering::Acquire)
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
        if self.run.running.swap(0, Ordering::AcqRel) != 0 {
            ending.end = Some(end);
        }
        self.run.changed.notify_all();
    }

    /// Ends the run, or the first one when it begins: whoever stops an agent that has just been made means that one.
    pub fn stop(&self) {
        let mut ending = self.ending();
        ending.stopped_before = ending.runs == 0;
        drop(ending);
        self.finish(End::Stopped);
    }

    /// After the end: says that no thread works on the core any more.
    pub fn put_token_down(&self) {
        self.ending().token_down = true;
        self.token.give_back();
        self.run.changed.notify_all();
    }

    /// Waits until the run has ended and the core is free.
    pub fn wait(&self) -> End {
        let waited = self.run.changed.wait_while(self.ending(), |ending| !ending.token_down);
        waited.unwrap_or_else(PoisonError::into_inner).end.take().unwrap_or(End::Stopped)
    }

    /// Sleeps, but not beyond the end of the run.
    pub fn sleep(&self, duration: Duration) {
        if self.is_running() {
            // An error says that a thread panicked while it had the lock, which is no reason to sleep.
            let _ = self.run.changed.wait_timeout_while(self.ending(), duration, |_| self.is_running());
        } else {
            std::thread::sleep(duration);
        }
    }

    /// Sleeps; true when the run is over before that.
    pub fn is_over_within(&self, duration: Duration) -> bool {
        let waited = self.run.changed.wait_timeout_while(self.ending(), duration, |ending| !ending.over);
        waited.unwrap_or_else(PoisonError::into_inner).0.over
    }

    /// Says that all threads of the run are gone, or lost. Returns what its observer panicked with.
    pub fn close(&self) -> Option<Box<dyn Any + Send>> {
        let mut ending = self.ending();
        ending.over = true;
        self.run.changed.notify_all();
        ending.panic.take()
    }

    /// Gives the loop, which is with a step that does not return, to a spare thread or a new one.
    pub fn move_token(self: &Arc<Self>) {
        let mut ending = self.ending();
        if self.is_running() {
            if ending.spares > ending.tokens {
                ending.tokens += 1;
                self.run.changed.notify_all();
                return;
            }
            drop(ending);
            let shared = Arc::clone(self);
            let next = std::thread::Builder::new().name("main loop".into());
            if next.spawn(move || drive(&shared)).is_ok() {
                return;
            }
            self.finish(End::Stopped);
        } else {
            drop(ending);
        }
        self.put_token_down();
    }

    /// Waits for the loop as a spare thread; false when the run has ended, or enough others wait.
    fn wait_for_token(&self) -> bool {
        let mut ending = self.ending();
        if ending.spares >= SPARES || !self.is_running() {
            return false;
        }
        ending.spares += 1;
        let waits = |ending: &mut Ending| ending.tokens == 0 && self.is_running();
        let mut ending = self.run.changed.wait_while(ending, waits).unwrap_or_else(PoisonError::into_inner);
        ending.spares -= 1;
        // A token that was given must be taken also when the run ends at that moment.
        let has_token = ending.tokens > 0;
        ending.tokens -= usize::from(has_token);
        has_token
    }
}
