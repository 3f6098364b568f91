//! Runs of an agent, and the time and measurements of its main loop.

use std::sync::mpsc::channel;
use std::sync::{Arc, Weak};
use std::time::{Duration, SystemTime};

use super::{Agent, StartError};
use slate_engine::main_loop::{AgentTrace, End, Flow, Observer, Rate, SharedLoop, Watchdog, cycle, drive};
use slate_engine::synchronization::Synchronization;

/// Longest wait for the log's last lines at the end of a run.
pub(super) const LAST_LINES: Duration = Duration::from_secs(1);

impl Agent {
    /// Handle that ends a run from another thread.
    pub fn stopper(&self) -> Stopper {
        Stopper { shared: Arc::downgrade(&self.handle.shared) }
    }

    /// Runs one cycle of the main loop, in the caller's thread and without a watchdog.
    ///
    /// Only in lockstep: on the wall clock modules have threads of their own. False there, and if a step did not return.
    pub fn step(&mut self) -> bool {
        self.step_with(|_| ())
    }

    /// Runs one cycle as [`step`](Agent::step), and calls `between` at its end.
    /// Modules may request changes of the settings in the cycle. `between` is called before each request is carried out,
    /// and after the last one, so that a rerun makes other changes in the same order as the recorded run.
    pub fn step_with(&mut self, mut between: impl FnMut(&Agent)) -> bool {
        if !self.handle.shared.lockstep {
            return false;
        }
        self.handle.shared.take_token();
        let flow = cycle(&self.handle.shared);
        self.handle.shared.release_token();
        if flow == Flow::Lost {
            return false;
        }
        let agent = &*self;
        agent.handle.shared.apply_changes(&mut || between(agent));
        between(agent);
        true
    }

    /// Runs until the observer, a [`Stopper`] or a fault ends it.
    ///
    /// # Errors
    /// When a thread can't be started.
    ///
    /// # Panics
    /// When the observer does.
    pub fn run(&mut self, observer: Observer) -> Result<End, StartError> {
        let shared = &self.handle.shared;
        let watchdog = Watchdog::new(Arc::clone(shared), self.hang);
        // Before the token is taken: a thread that changes the agent at this moment waits for it.
        let composition = self.handle.composition();
        shared.begin();
        // SAFETY: `begin` took the token.
        unsafe { shared.core() }.observer = Some(observer);
        let watchdog = std::thread::Builder::new().name("watchdog".into()).spawn(move || watchdog.watch());
        let measured = Arc::clone(shared);
        let timing = std::thread::Builder::new().name("timing".into());
        let timing = timing.spawn(move || measured.publish_until_over());
        let driver = Arc::clone(shared);
        let main_loop = std::thread::Builder::new().name("main loop".into());
        let (changing, free) = channel::<()>();
        let started = match (&watchdog, &timing) {
            (Ok(_), Ok(_)) => {
                let threads = composition.assembly.start_threads(shared);
                // It begins when the agent can be changed again: a cycle may have to look at what it is made of.
                let begin = move || {
                    // Nothing is ever sent.
                    let _ = free.recv();
                    drive(&driver);
                };
                threads.and_then(|()| main_loop.spawn(begin).map(drop))
            }
            (Err(error), _) | (_, Err(error)) => Err(error.kind().into()),
        };
        if started.is_err() {
            shared.run.finish(End::Stopped);
            shared.release_token_at_end();
        }
        drop(composition);
        drop(changing);
        let end = shared.run.wait();
        shared.threads().join();
        let panic = shared.run.close();
        for thread in [watchdog, timing].into_iter().flatten() {
            // They have nothing that panics.
            let _ = thread.join();
        }
        shared.take_token();
        // SAFETY: the token was taken.
        unsafe { shared.core() }.observer = None;
        shared.release_token();
        if end == End::Stopped && started.is_ok() {
            // Requests of modules in the last cycle, as after each step.
            shared.apply_changes(&mut || ());
        }
        let automatic = self.handle.composition().snapshots.automatic.clone();
        if let Some(automatic) = automatic {
            automatic.wait();
        }
        shared.logger.flush(LAST_LINES);
        if let Some(panic) = panic {
            std::panic::resume_unwind(panic);
        }
        started?;
        Ok(end)
    }

    /// Continues at another time, possibly an earlier one.
    /// It takes effect with the next [step](Agent::step). It is for an agent that plays a recording and runs no module,
    /// as time never goes back for modules. False, without a change, on the system's clock and if modules run.
    pub fn jump(&mut self, time: u64) -> bool {
        let is_empty = self.handle.composition().assembly.modules.is_empty();
        if !self.handle.shared.lockstep || !is_empty {
            return false;
        }
        self.handle.shared.take_token();
        // SAFETY: the token was taken.
        unsafe { self.handle.shared.core() }.jump(time);
        self.handle.shared.clock.set(time);
        self.handle.shared.release_token();
        true
    }

    /// Sets the rate of time from the next cycle on.
    /// The time since the last cycle does not count as lateness.
    pub fn set_rate(&mut self, rate: Rate) {
        self.handle.shared.take_token();
        // SAFETY: the token was taken.
        unsafe { self.handle.shared.core() }.set_rate(rate);
        self.handle.shared.release_token();
    }

    /// Synchronization points of the main loop for other threads.
    /// They are `/cycle/start` and `/cycle/end`, and for each stage such as `Act`, `/stage/Act/start` and
    /// `/stage/Act/end`. The loop emits a point once a thread has requested it.
    pub fn synchronization(&self) -> &Arc<Synchronization> {
        &self.handle.shared.synchronization
    }

    /// Returns the trace of the modules' steps over time.
    pub fn trace(&self) -> AgentTrace {
        AgentTrace::new(Arc::clone(&self.handle.shared))
    }

    /// Publishes the present measurements of the timing.
    /// The properties are `/loop/state`, `/loop/histogram`, `/loop/STAGE/histogram` and `/MODULE/histogram`. A run
    /// publishes them ten times a second; this call is for programs that make single steps.
    pub fn publish_timing(&self) {
        self.handle.shared.publish_timing();
    }

    /// Converts the agent's time into a date (UTC), for display.
    /// It may jump when the machine's clock is set, and nothing in an agent depends on it.
    pub fn date_of(&self, time: u64) -> SystemTime {
        self.handle.shared.clock.date_of(time)
    }
}

/// Handle that ends a run from another thread.
/// It keeps no part of its agent alive, as a signal handler holds it until the process ends.
#[derive(Clone)]
pub struct Stopper {
    shared: Weak<SharedLoop>,
}

impl Stopper {
    /// Ends the run after the present cycle, if the agent still exists.
    /// Called before the first run, it ends that run before its first cycle.
    pub fn stop(&self) {
        if let Some(shared) = self.shared.upgrade() {
            shared.run.stop();
        }
    }
}
