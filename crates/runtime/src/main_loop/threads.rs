use std::io;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use slate_blackboard::wake::Wake;
use slate_module::Trigger;

use super::{Seat, Shared, measured, nanoseconds};
use crate::runner::{Condition, Runner};

/// Modules that run on threads of their own, woken by what they wait for.
#[derive(Default)]
pub(crate) struct ModuleThreads {
    threads: Vec<(Arc<Seat>, Arc<Wake>, JoinHandle<()>)>,
}

impl ModuleThreads {
    /// Starts a thread for each module.
    ///
    /// # Errors
    /// When a thread can't be started; those before it run.
    pub fn start(&mut self, shared: &Arc<Shared>, seats: &[Arc<Seat>]) -> io::Result<()> {
        let run = shared.run();
        for seat in seats {
            let wake = Arc::clone(&seat.wake);
            let (thread_shared, driven, own) = (Arc::clone(shared), Arc::clone(seat), Arc::clone(&wake));
            let thread = std::thread::Builder::new()
                .name(seat.name.to_string())
                .spawn(move || work(&thread_shared, run, &driven, &own))?;
            self.threads.push((Arc::clone(seat), wake, thread));
        }
        Ok(())
    }

    /// Waits for the threads after the run has ended; one that hangs is left behind.
    pub fn join(self) {
        self.threads.iter().for_each(|(_, wake, _)| wake.notify(1));
        for (seat, _, thread) in self.threads {
            while !thread.is_finished() && !seat.is_late() {
                std::thread::sleep(Duration::from_micros(200));
            }
            if thread.is_finished() {
                // A panic in a module does not reach its thread, so there is nothing to learn from the result.
                let _ = thread.join();
            }
        }
    }
}

/// The life of a module's own thread in that run.
fn work(shared: &Shared, run: u64, seat: &Seat, wake: &Wake) {
    while shared.is_in(run) {
        if !seat.is_idle() {
            // A late step has returned, or one of an earlier run has not yet.
            if !seat.readmit() {
                wake.wait_timeout(LOOK);
            }
            continue;
        }
        // SAFETY: this thread drives the seat, which is idle between steps.
        let (due, patience) = unsafe {
            let runner = seat.runner();
            let now = shared.clock.now();
            let due = runner.is_due(now);
            (due, if due { Duration::ZERO } else { patience(runner, now) })
        };
        if due {
            step(shared, seat);
        } else {
            wake.wait_timeout(patience);
        }
    }
}

/// How often a thread looks for what nobody wakes it for: a switch, a value that a tool has set, virtual time.
const LOOK: Duration = Duration::from_millis(5);

/// How long a thread may sleep before its time has come. Virtual time may pass faster, hence the upper bound.
fn patience(runner: &Runner, now: u64) -> Duration {
    if matches!(runner.health.condition(), Condition::Inactive | Condition::Faulted) {
        return LOOK;
    }
    let left = match &runner.trigger {
        Trigger::Every(_) => runner.due.saturating_sub(now),
        Trigger::On { timeout: Some(timeout), .. } => (runner.last_tick + timeout).saturating_sub(now),
        // Modules that write wake their readers, tools don't.
        _ if runner.inputs.iter().any(|input| input.triggers && input.writer.is_none()) => return LOOK,
        _ => return Duration::from_millis(100),
    };
    Duration::from_nanos(left).clamp(Duration::from_micros(50), LOOK)
}

/// A step; nothing comes of it when it was given up.
fn step(shared: &Shared, seat: &Seat) {
    let now = shared.clock.now();
    // SAFETY: this thread drives the seat; the references end before the step.
    let call = unsafe {
        let runner = seat.runner();
        runner.log.set_time(now);
        runner.prepare(now);
        runner.call()
    };
    seat.begin(false);
    let start = measured();
    // SAFETY: the runner was prepared, and the seat keeps others out.
    let code = unsafe { call.make() };
    let duration = nanoseconds(start, measured());
    if !seat.end() {
        return;
    }
    // SAFETY: the step was not given up.
    let runner = unsafe { seat.runner() };
    runner.time(Some(duration));
    runner.commit(shared.clock.now(), code, None);
}
