//! Work between two cycles, by the holder of the loop's token.
//! So nothing changes during a step.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::{Flow, RunnerCell, SharedLoop};

/// Job between two cycles.
/// It must hold no reference to the core when it calls a module's code.
pub(super) type Job = Box<dyn FnOnce(&SharedLoop) -> Flow + Send>;

/// Slot of the waiting job.
#[derive(Default)]
pub(super) struct Jobs {
    waiting: AtomicBool,
    job: Mutex<Option<Job>>,
    /// Lock of the thread that waits for a job.
    waiter_turn: Mutex<()>,
}

impl Jobs {
    fn put(&self, job: Job) {
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

/// Work of a job, which returns `None` if it lost the token.
/// Its result goes into a slot, so that jobs are all of one type.
type Work = Box<dyn FnOnce(&SharedLoop) -> Option<()> + Send>;

/// Module whose code did not return.
#[derive(Debug)]
pub struct NotReturned;

/// Place of the result of a job, shared by the job and its requester.
struct ResultSlot<R>(Arc<Mutex<Option<R>>>);

/// Returns the two ends of an empty slot.
fn result_slot<R>() -> (ResultSlot<R>, ResultSlot<R>) {
    let slot = Arc::new(Mutex::new(None));
    (ResultSlot(Arc::clone(&slot)), ResultSlot(slot))
}

impl<R> ResultSlot<R> {
    fn fill(&self, result: R) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
    }

    fn take(&self) -> Option<R> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Does work in a thread of its own while none of the cells is in a step.
/// Waits for its end.
fn run_in_own_thread(
    cells: Vec<Arc<RunnerCell>>,
    work: Box<dyn FnOnce() -> Option<()> + Send>,
) -> Option<()> {
    let (sender, receiver) = channel();
    let involved = cells.clone();
    let thread = std::thread::Builder::new().name("exchange".into()).spawn(move || {
        let mut claimed = 0;
        while claimed < involved.len() && involved[claimed].claim_when_idle() {
            claimed += 1;
        }
        let result = if claimed == involved.len() { work() } else { None };
        involved[..claimed].iter().for_each(|cell| cell.release());
        // Sending fails if the requester no longer waits.
        let _ = sender.send(result);
    });
    thread.ok()?;
    loop {
        match receiver.recv_timeout(POLL_PERIOD) {
            Ok(result) => return result,
            Err(RecvTimeoutError::Disconnected) => return None,
            Err(RecvTimeoutError::Timeout) if cells.iter().any(|cell| cell.is_late()) => return None,
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

/// Poll interval of a waiting thread, for the end of the loop and late modules.
const POLL_PERIOD: Duration = Duration::from_millis(2);

thread_local! {
    /// Sender of this thread's jobs, while it holds the loop between two cycles.
    static JOB_SENDER: RefCell<Option<Sender<Job>>> = const { RefCell::new(None) };
}

/// Hold of the loop between two cycles; on drop, also by a panic, it continues.
/// Contains the previous hold.
struct LoopHold(Option<Sender<Job>>);

impl LoopHold {
    fn new(sender: Option<Sender<Job>>) -> Self {
        Self(JOB_SENDER.replace(sender))
    }
}

impl Drop for LoopHold {
    fn drop(&mut self) {
        JOB_SENDER.set(self.0.take());
    }
}

impl SharedLoop {
    /// Does `work` between two cycles and waits for its result.
    /// It runs in the loop's thread, or here when no loop runs. `NotReturned` if it lost the token, as a module of
    /// `cells` did not return in time.
    pub fn between_cycles<R: Send + 'static>(
        &self,
        cells: &[Arc<RunnerCell>],
        work: impl FnOnce(&SharedLoop) -> Option<R> + Send + 'static,
    ) -> Result<R, NotReturned> {
        let (result, answer) = result_slot();
        self.run_between_cycles(cells, Box::new(move |shared| work(shared).map(|found| result.fill(found))))?;
        answer.take().ok_or(NotReturned)
    }

    /// As [`between_cycles`](Self::between_cycles), for all kinds of work.
    fn run_between_cycles(&self, cells: &[Arc<RunnerCell>], work: Work) -> Result<(), NotReturned> {
        let (sender, receiver) = channel();
        let job: Job = Box::new(move |shared| match work(shared) {
            Some(()) => {
                // Sending fails if the requester no longer waits.
                let _ = sender.send(());
                Flow::Next
            }
            None => Flow::Lost,
        });
        if let Some(sender) = JOB_SENDER.with_borrow(Clone::clone) {
            return sender.send(job).ok().and_then(|()| receiver.recv().ok()).ok_or(NotReturned);
        }
        let _turn = self.jobs.waiter_turn.lock().unwrap_or_else(PoisonError::into_inner);
        self.jobs.put(job);
        loop {
            if self.core.try_take() {
                let job = self.jobs.take();
                let flow = job.map(|job| job(self));
                if flow != Some(Flow::Lost) {
                    self.core.release();
                }
            }
            match receiver.recv_timeout(POLL_PERIOD) {
                Ok(()) => return Ok(()),
                Err(RecvTimeoutError::Disconnected) => return Err(NotReturned),
                Err(RecvTimeoutError::Timeout) if cells.iter().any(|cell| cell.is_late()) => {
                    // A job that has not begun must not run later, when no thread waits for it.
                    drop(self.jobs.take());
                    return Err(NotReturned);
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Does `work` in this thread between two cycles, with the last cycle's number.
    /// All other work between cycles that it requires is done there too. The number is `None` if no cycle has ended
    /// within `timeout`, as this thread may be one that the loop waits for.
    pub fn hold_between_cycles<R>(
        self: &Arc<Self>,
        timeout: Duration,
        work: impl FnOnce(Option<u64>) -> R,
    ) -> R {
        let (begin, cycles) = channel();
        let (sender, jobs) = channel::<Job>();
        let between = move |shared: &SharedLoop| {
            // Sending fails if the requester no longer waits; the channel closes when its work has ended.
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
        // No thread waits for it: the loop is released when the work ends.
        let helper = helper.spawn(move || drop(shared.between_cycles(&[], between)));
        let cycle = helper.ok().and_then(|_| cycles.recv_timeout(timeout).ok());
        drop(cycles);
        let _hold = LoopHold::new(cycle.map(|_| sender));
        work(cycle)
    }

    /// Does `work` while none of the cells is in a step.
    /// It runs in the loop's thread, or for a module with a thread of its own in one made for it, so that no other thread
    /// waits for that module. `None` if a module has not returned, from its step or from this work.
    pub fn with_cells<R: Send + 'static>(
        &self,
        cells: &[Arc<RunnerCell>],
        own_thread: bool,
        work: impl FnOnce() -> Option<R> + Send + 'static,
    ) -> Option<R> {
        let involved = cells.to_vec();
        if !own_thread {
            let between = move |_: &SharedLoop| {
                let free = involved.iter().all(|cell| cell.is_idle() || cell.reclaim());
                if free { work().map(Some) } else { Some(None) }
            };
            return self.between_cycles(cells, between).ok().flatten();
        }
        let (result, answer) = result_slot();
        run_in_own_thread(involved, Box::new(move || work().map(|found| result.fill(found))))?;
        answer.take()
    }

    /// Applies the changes that modules have requested in the last cycle, in lockstep.
    /// No thread has the token meanwhile. `before` is called before each request.
    pub fn apply_changes(&self, before: &mut dyn FnMut()) {
        if let Some(changes) = self.hooks.pending_changes().filter(|_| self.lockstep) {
            changes.apply(before);
        }
    }

    /// Acts as [`apply_changes`](SharedLoop::apply_changes), with the token held.
    /// It has the token again afterwards.
    pub fn apply_changes_with_token(&self) {
        if self.lockstep && self.hooks.pending_changes().is_some() {
            self.release_token();
            self.apply_changes(&mut || ());
            self.take_token();
        }
    }
}
