use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::Duration;

use slate_module::Trigger;

use super::{RunnerCell, SharedLoop};
use crate::background::thread_name;
use crate::clock::monotonic;
use crate::runner::{ModuleCondition, Runner, StepCall};

/// Modules on threads of their own, woken by their triggers.
#[derive(Default)]
pub struct ModuleThreads {
    threads: Vec<(Arc<RunnerCell>, JoinHandle<()>)>,
}

impl ModuleThreads {
    /// Starts a module's thread.
    ///
    /// # Errors
    /// When it can't be started.
    pub fn start(&mut self, shared: &Arc<SharedLoop>, cell: &Arc<RunnerCell>) -> io::Result<()> {
        let run = shared.run.number();
        let (thread_shared, driven) = (Arc::clone(shared), Arc::clone(cell));
        let thread = std::thread::Builder::new()
            .name(thread_name(&cell.name))
            .spawn(move || run_module(&thread_shared, run, &driven))?;
        self.threads.push((Arc::clone(cell), thread));
        Ok(())
    }

    /// Joins the thread of a module that is no longer watched.
    /// A step that takes longer than `limit` is given up.
    pub fn join_one(&mut self, cell: &Arc<RunnerCell>, limit: Duration, now: u64) {
        let Some(at) = self.threads.iter().position(|(other, _)| Arc::ptr_eq(other, cell)) else { return };
        let (cell, thread) = self.threads.swap_remove(at);
        let mut waited = Duration::ZERO;
        while !thread.is_finished() && waited < limit {
            std::thread::sleep(JOIN_POLL_PERIOD);
            waited += JOIN_POLL_PERIOD;
        }
        if let Some(step) = cell.running() {
            cell.give_up(step, now);
        }
        join(&cell, thread);
    }

    /// Waits for the threads after the run has ended; one that hangs is left behind.
    pub fn join(&mut self) {
        self.threads.iter().for_each(|(cell, _)| cell.wake.notify(1));
        self.threads.drain(..).for_each(|(cell, thread)| join(&cell, thread));
    }
}

/// Interval at which the end of a thread is polled.
const JOIN_POLL_PERIOD: Duration = Duration::from_micros(200);

fn join(cell: &RunnerCell, thread: JoinHandle<()>) {
    while !thread.is_finished() && !cell.is_late() {
        std::thread::sleep(JOIN_POLL_PERIOD);
    }
    if thread.is_finished() {
        // A panic in a module does not reach its thread, so there is nothing to learn from the result.
        let _ = thread.join();
    }
}

/// Runs a module's own thread in that run.
fn run_module(shared: &SharedLoop, run: u64, cell: &RunnerCell) {
    let wake = &cell.wake;
    let mut signaled_turns = cell.signaled_turns().unwrap_or(0);
    while shared.run.is_in(run) && !cell.is_retired() {
        if !cell.claim() {
            // A late step has returned, or one of an earlier run has not yet; or the module's code is exchanged.
            if !cell.reclaim() {
                wake.wait_timeout(POLL_PERIOD);
            }
            continue;
        }
        // SAFETY: this thread drives the cell, which it has claimed.
        let (call, sleep_limit) = unsafe {
            let runner = cell.runner();
            let now = shared.clock.now();
            if has_turn(cell, &mut signaled_turns) && runner.is_due(now) {
                if runner.inputs.ports.iter().any(|input| input.writer.is_none()) {
                    expire(shared);
                }
                runner.prepare(now);
                (Some(runner.call()), Duration::ZERO)
            } else {
                (None, sleep_limit(runner, now))
            }
        };
        match call {
            Some(call) => step(shared, cell, call),
            None => {
                cell.release();
                wake.wait_timeout(sleep_limit);
            }
        }
    }
}

/// Expires stale commands, so that no step reads one, however late the watchdog is.
fn expire(shared: &SharedLoop) {
    for actuator in shared.actuators().iter() {
        actuator.expire_before_read();
    }
}

/// Returns true if a module may check its trigger in this turn.
/// Turns of the loop that it was too late for are left out, and counted.
fn has_turn(cell: &RunnerCell, signaled_turns: &mut u64) -> bool {
    let Some(now) = cell.signaled_turns() else { return true };
    let turns = now - std::mem::replace(signaled_turns, now);
    if turns > 1 {
        let misses = &cell.health.misses;
        misses.store(misses.load(Ordering::Relaxed) + turns - 1, Ordering::Relaxed);
    }
    turns > 0
}

/// Interval at which a thread polls for changes without a wake-up.
/// Such as a switch, a value that a tool has set, or virtual time.
const POLL_PERIOD: Duration = Duration::from_millis(5);

/// Returns the longest sleep of a thread before its next step.
/// Virtual time may pass faster, hence the upper bound.
fn sleep_limit(runner: &Runner, now: u64) -> Duration {
    if matches!(
        runner.condition(),
        ModuleCondition::INACTIVE | ModuleCondition::WAITING | ModuleCondition::FAULTED
    ) {
        return POLL_PERIOD;
    }
    if runner.supervised.is_some() {
        // Its process may end at any time.
        return POLL_PERIOD;
    }
    let left = match runner.schedule.trigger() {
        Trigger::Every(_) => runner.schedule.due().saturating_sub(now),
        Trigger::On { timeout: Some(timeout), .. } => {
            (runner.schedule.last_tick() + timeout).saturating_sub(now)
        }
        // Modules that write wake their readers, tools don't.
        _ if runner.inputs.ports.iter().any(|input| input.triggers && input.writer.is_none()) => {
            return POLL_PERIOD;
        }
        _ => return Duration::from_millis(100),
    };
    Duration::from_nanos(left).clamp(Duration::from_micros(50), POLL_PERIOD)
}

/// Makes a step of a claimed cell; a step that was given up has no effect.
fn step(shared: &SharedLoop, cell: &RunnerCell, call: StepCall) {
    let start = monotonic();
    cell.begin(false, start);
    // SAFETY: the runner was prepared, and the cell keeps others out.
    let code = unsafe { call.make() };
    let duration = monotonic().saturating_sub(start);
    if !cell.end_claimed(code) {
        return;
    }
    if shared.tracing.is_on() {
        cell.record(shared, start, duration, shared.cycles());
    }
    // SAFETY: the step was not given up, and the cell is claimed.
    let runner = unsafe { cell.runner() };
    cell.measure(runner, duration, 1);
    runner.count();
    runner.commit(shared.clock.now(), code, None);
    cell.release();
    shared.hooks.notify_write();
}
