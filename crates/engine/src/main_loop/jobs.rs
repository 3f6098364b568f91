//! Work between two cycles, by the holder of the loop's token.
//! So nothing changes during a step.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::{Flow, Seat, SharedLoop};

/// Job between two cycles.
/// It must hold no reference to the core when it calls a module's code.
pub(super) type Job = Box<dyn FnOnce(&SharedLoop) -> Flow + Send>;

/// Slot of the waiting job.
#[derive(Default)]
pub(super) struct Jobs {
    waiting: AtomicBool,
    job: Mutex<Option<Job>>,
    /// Lock of the thread that waits for a job.
    turn: Mutex<()>,
}

impl Jobs {
    fn give(&self, job: Job) {
        *self.job.lock().unwrap_or_else(PoisonError::into_inner) = Some(job);
        self.waiting.store(true, Ordering::Release);
    }

    fn take(&self) -> Option<Job> {
        self.waiting.store(false, Ordering::Relaxed);
        self.job.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Returns the waiting job, if any; the check costs a load.
    pub fn next(&self) -> Option<Job> {
        if self.waiting.load(Ordering::Acquire) { self.take() } else { None }
    }
}

/// Module whose code did not return.
#[derive(Debug)]
pub struct NotReturned;

/// Poll interval of a waiting thread, for the end of the loop and late modules.
const LOOK: Duration = Duration::from_millis(2);

thread_local! {
    /// Sender of this thread's jobs, while it holds the loop between two cycles.
    static HELD: RefCell<Option<Sender<Job>>> = const { RefCell::new(None) };
}

/// Hold of the loop between two cycles; on drop, also by a panic, the loop goes on.
/// Contains the previous hold.
struct LoopHold(Option<Sender<Job>>);

impl LoopHold {
    fn new(held: Option<Sender<Job>>) -> Self {
        Self(HELD.replace(held))
    }
}

impl Drop for LoopHold {
    fn drop(&mut self) {
        HELD.set(self.0.take());
    }
}

impl SharedLoop {
    /// Does `work` between two cycles and waits for its result.
    /// It runs in the loop's thread, or here when no loop runs. `NotReturned` if it lost the token, as a module of
    /// `seats` did not return in time.
    pub fn between_cycles<R: Send + 'static>(
        &self,
        seats: &[Arc<Seat>],
        work: impl FnOnce(&SharedLoop) -> Option<R> + Send + 'static,
    ) -> Result<R, NotReturned> {
        let (sender, receiver) = channel();
        let job: Job = Box::new(move |shared| match work(shared) {
            Some(result) => {
                // Who asked has given up waiting, if it can't be sent.
                let _ = sender.send(result);
                Flow::Next
            }
            None => Flow::Lost,
        });
        if let Some(held) = HELD.with_borrow(Clone::clone) {
            return held.send(job).ok().and_then(|()| receiver.recv().ok()).ok_or(NotReturned);
        }
        let _turn = self.jobs.turn.lock().unwrap_or_else(PoisonError::into_inner);
        self.jobs.give(job);
        loop {
            if self.core.try_take() {
                let job = self.jobs.take();
                let flow = job.map(|job| job(self));
                if flow != Some(Flow::Lost) {
                    self.core.give_back();
                }
            }
            match receiver.recv_timeout(LOOK) {
                Ok(result) => return Ok(result),
                Err(RecvTimeoutError::Disconnected) => return Err(NotReturned),
                Err(RecvTimeoutError::Timeout) if seats.iter().any(|seat| seat.is_late()) => {
                    // What has not begun must not be done later, when nobody waits for it.
                    drop(self.jobs.take());
                    return Err(NotReturned);
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Does `work` in this thread between two cycles; returns the last cycle's number.
    /// All other work between cycles that it requires is done there too. The number is `None` if no cycle has ended
    /// within `patience`, as this thread may be one that the loop waits for.
    pub fn between_two<R>(self: &Arc<Self>, timeout: Duration, work: impl FnOnce() -> R) -> (Option<u64>, R) {
        let (begin, begun) = channel();
        let (held, jobs) = channel::<Job>();
        let between = move |shared: &SharedLoop| {
            // Who asked does not wait any more when it can't be sent, and has ended its work when nothing more comes.
            if begin.send(shared.cycles()).is_ok() {
                while let Ok(job) = jobs.recv() {
                    if job(shared) == Flow::Lost {
                        return None;
                    }
                }
            }
            Some(())
        };
        let shared = Arc::clone(self);
        let helper = std::thread::Builder::new().name("change".into());
        // Nobody waits for it: what it holds ends with the work.
        let helper = helper.spawn(move || drop(shared.between_cycles(&[], between)));
        let cycle = helper.ok().and_then(|_| begun.recv_timeout(timeout).ok());
        drop(begun);
        let _hold = LoopHold::new(cycle.map(|_| held));
        (cycle, work())
    }

    /// Does `work` while none of the seats is in a step.
    /// It runs in the loop's thread, or for a module with a thread of its own in one made for it, so that nobody else
    /// waits for that module. `None` if a module has not returned, from its step or from this work.
    pub fn with_seats<R: Send + 'static>(
        &self,
        seats: &[Arc<Seat>],
        own_thread: bool,
        work: impl FnOnce() -> Option<R> + Send + 'static,
    ) -> Option<R> {
        let involved = seats.to_vec();
        if !own_thread {
            let between = move |_: &SharedLoop| {
                let free = involved.iter().all(|seat| seat.is_idle() || seat.readmit());
                if free { work().map(Some) } else { Some(None) }
            };
            return self.between_cycles(seats, between).ok().flatten();
        }
        let (sender, receiver) = channel();
        let thread = std::thread::Builder::new().name("exchange".into()).spawn(move || {
            let mut held = 0;
            while held < involved.len() && involved[held].claim_patiently() {
                held += 1;
            }
            let result = if held == involved.len() { work() } else { None };
            involved[..held].iter().for_each(|seat| seat.unclaim());
            // Who asked has given up waiting, if it can't be sent.
            let _ = sender.send(result);
        });
        thread.ok()?;
        loop {
            match receiver.recv_timeout(LOOK) {
                Ok(result) => return result,
                Err(RecvTimeoutError::Disconnected) => return None,
                Err(RecvTimeoutError::Timeout) if seats.iter().any(|seat| seat.is_late()) => return None,
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Applies the changes that modules have requested in the last cycle, in lockstep.
    /// Nobody has the token meanwhile.
    pub fn change(&self) {
        if let Some(changes) = self.hooks.asked().filter(|_| self.lockstep) {
            changes.carry_out();
        }
    }

    /// Acts as [`change`](SharedLoop::change) for the holder of the token.
    /// It has the token again afterwards.
    pub fn change_here(&self) {
        if self.lockstep && self.hooks.asked().is_some() {
            self.give_token_back();
            self.change();
            self.take_token();
        }
    }
}
