use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::Duration;

use slate_blackboard::wake::Wake;
use slate_module::Trigger;

use super::{Seat, Shared, measured};

/// Modules that run on threads of their own, woken by what they wait for.
pub(crate) struct ModuleThreads {
    wakes: Vec<Arc<Wake>>,
    threads: Vec<(Arc<Seat>, JoinHandle<()>)>,
}

impl ModuleThreads {
    /// Starts a thread for each module.
    ///
    /// # Errors
    /// When a thread can't be started.
    pub fn start(shared: &Arc<Shared>, seats: &[Arc<Seat>]) -> io::Result<Self> {
        let mut wakes = Vec::new();
        let mut threads = Vec::new();
        for seat in seats {
            // SAFETY: no thread drives this seat yet.
            let wake = Arc::clone(&unsafe { seat.runner() }.wake);
            wakes.push(Arc::clone(&wake));
            let (shared, driven) = (Arc::clone(shared), Arc::clone(seat));
            let thread = std::thread::Builder::new()
                .name(seat.name.to_string())
                .spawn(move || work(&shared, &driven, &wake))?;
            threads.push((Arc::clone(seat), thread));
        }
        Ok(Self { wakes, threads })
    }

    /// Ends the threads; one that hangs is left behind.
    pub fn stop(self) {
        self.wakes.iter().for_each(|wake| wake.notify(1));
        for (seat, thread) in self.threads {
            if seat.running().is_none() && seat.is_idle() {
                // A panic in a module does not reach its thread, so there is nothing to learn from the result.
                let _ = thread.join();
            }
        }
    }
}

/// The life of a module's own thread.
fn work(shared: &Shared, seat: &Seat, wake: &Wake) {
    while !shared.stop.load(Ordering::Acquire) {
        // SAFETY: this thread drives the seat, which is idle between steps.
        let (due, patience) = unsafe {
            let runner = seat.runner();
            let now = shared.clock.now();
            (runner.is_due(now), patience(&runner.trigger, now, runner.due, runner.last_tick))
        };
        if due {
            step(shared, seat);
        } else {
            wake.wait_timeout(patience);
        }
    }
}

/// How long a thread may sleep before its time has come. Virtual time may pass faster, hence the upper bound.
fn patience(trigger: &Trigger, now: u64, due: u64, last: u64) -> Duration {
    let longest = 5_000_000;
    let left = match trigger {
        Trigger::Every(_) => due.saturating_sub(now),
        Trigger::On { timeout: Some(timeout), .. } => (last + timeout).saturating_sub(now),
        Trigger::On { timeout: None, .. } | Trigger::Stage => 100_000_000,
    };
    let bound = if matches!(trigger, Trigger::On { timeout: None, .. }) { 100_000_000 } else { longest };
    Duration::from_nanos(left.clamp(50_000, bound))
}

fn step(shared: &Shared, seat: &Seat) {
    let now = shared.clock.now();
    // SAFETY: this thread drives the seat; the references end before the step.
    let call = unsafe {
        let runner = seat.runner();
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
        seat.readmit();
        return;
    }
    // SAFETY: the step was not given up.
    let runner = unsafe { seat.runner() };
    runner.time(duration);
    runner.commit(shared.clock.now(), code, None);
}
