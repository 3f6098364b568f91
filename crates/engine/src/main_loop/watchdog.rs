use std::sync::Arc;
use std::time::Duration;

use slate_module::Level;

use super::notices::{NoticeLimit, milliseconds, suppression_note};
use super::{End, RunnerCell, SharedLoop};
use crate::background::raise_priority;
use crate::clock::monotonic;

/// Number of simultaneously lost threads at which the run stops in order.
const LOST_THREAD_LIMIT: usize = 4;
/// Interval of the watchdog's checks, ns: lower and upper bound.
const SHORTEST_CHECK_PERIOD: u64 = 1_000_000;
const LONGEST_CHECK_PERIOD: u64 = 50_000_000;
/// Maximum delay of a command's expiry by the interval of the checks, ns.
const EXPIRY_DELAY_LIMIT: u64 = 5_000_000;

/// Maximum wait at the end of a run for steps in processes of their own, ns.
const EXIT_TIMEOUT: u64 = 1_000_000_000;

/// Watchdog of late steps, past which it moves the loop, and of stale commands.
/// It expires commands that are not renewed, independently of the loop.
pub struct Watchdog {
    shared: Arc<SharedLoop>,
    /// Time after which a step hangs, ns.
    hang: u64,
}

/// Watched module.
pub struct WatchedModule {
    /// Cell of the module.
    pub cell: Arc<RunnerCell>,
    /// Stage of the loop; `None` for a module with a thread of its own.
    pub stage: Option<Arc<str>>,
}

/// Watchdog's state of a module.
#[derive(Clone, Copy, Default)]
struct WatchState {
    /// Number of the running step, and a monotonic time at which it ran, ns.
    step: u64,
    since: u64,
    /// True while the step is given up and has not returned; and if that was reported.
    late: bool,
    is_reported: bool,
    notices: NoticeLimit,
}

impl Watchdog {
    /// Returns a watchdog of that loop; `hang` is the longest time of a step.
    pub fn new(shared: Arc<SharedLoop>, hang: Duration) -> Self {
        Self { shared, hang: hang.as_nanos() as u64 }
    }

    /// Watches until the run is over and no thread is in a step any more.
    pub fn watch(self) {
        // A module that takes all that it gets of the processors must not keep it waiting.
        raise_priority();
        let mut watched = self.shared.watched();
        let mut states = vec![WatchState::default(); watched.len()];
        let mut ended = None;
        loop {
            let now = monotonic();
            if !self.shared.run.is_running() && now >= *ended.get_or_insert(now) + EXIT_TIMEOUT {
                disconnect_processes(&watched);
            }
            let next = self.check(&watched, &mut states, now);
            if self.shared.run.is_over_within(Duration::from_nanos(next.saturating_sub(now))) {
                return;
            }
            let present = self.shared.watched();
            if !Arc::ptr_eq(&present, &watched) {
                states = carry_over(&watched, &states, &present);
                watched = present;
            }
        }
    }

    /// Checks all modules; returns the monotonic time of the next check, ns.
    fn check(&self, watched: &[WatchedModule], states: &mut [WatchState], now: u64) -> u64 {
        let shared = &self.shared;
        // A stage that begins before the next look is not over by then.
        let interval = (self.hang / 4).min(shared.timeouts.shortest());
        let mut next = now + interval.clamp(SHORTEST_CHECK_PERIOD, LONGEST_CHECK_PERIOD);
        next = next.min(self.expire(now));
        let deadline = shared.timeouts.deadline();
        if deadline > now {
            next = next.min(deadline);
        }
        for (watch, state) in watched.iter().zip(states) {
            let cell = &watch.cell;
            if cell.is_isolated {
                // Its calls end by themselves, as its process is ended.
                continue;
            }
            if state.late && !cell.is_late() {
                self.report_return(cell, state);
            }
            let Some(step) = cell.running() else { continue };
            if state.step != step {
                (state.step, state.since) = (step, now);
            }
            let started = cell.started();
            if started != 0 {
                state.since = started;
            }
            // The deadline is that of the stage of this step, if it still holds after the step was seen to run.
            if let Some(stage) = &watch.stage
                && deadline != 0
                && now >= deadline
                && shared.timeouts.deadline() == deadline
            {
                self.give_up(
                    watch,
                    state,
                    now,
                    &format!(
                        "tick before the time of stage {stage} was up, after {} ms",
                        milliseconds(now.saturating_sub(state.since))
                    ),
                );
                continue;
            }
            let limit = state.since + self.hang;
            if now >= limit {
                self.give_up(watch, state, now, &format!("last call within {} ms", milliseconds(self.hang)));
            } else {
                next = next.min(limit);
            }
        }
        next
    }

    /// Applies the safe commands of actuators whose commands have expired.
    /// Returns the monotonic time of the next check, ns. In lockstep time stands still while a step does not return.
    fn expire(&self, now: u64) -> u64 {
        let shared = &self.shared;
        if shared.clock.is_driven() {
            return u64::MAX;
        }
        let (mut next, mut has_written) = (u64::MAX, false);
        for actuator in shared.actuators().iter() {
            has_written |= actuator.expire_stale();
            // A command that comes before the next look does not end much before the one after it.
            next = next.min(now + actuator.time_to_live() + EXPIRY_DELAY_LIMIT);
            if let Some(expires) = actuator.expires() {
                next =
                    next.min(now + expires.saturating_sub(shared.clock.at(now)).max(SHORTEST_CHECK_PERIOD));
            }
        }
        if has_written {
            shared.hooks.notify_write();
        }
        next
    }

    fn give_up(&self, watch: &WatchedModule, state: &mut WatchState, now: u64, when: &str) {
        let (shared, cell) = (&self.shared, &watch.cell);
        if !cell.give_up(state.step, shared.clock.now()) {
            return;
        }
        state.late = true;
        if let Some(suppressed) = state.notices.pass(now) {
            state.is_reported = true;
            let text = format!(
                "{} has not returned from its {when}; its outputs are safe values until it does{}",
                cell.name,
                suppression_note(suppressed)
            );
            shared.logger.log(shared.clock.now(), Level::Error, &text);
        }
        if shared.lockstep {
            shared.run.finish(End::Hung { module: cell.name.to_string() });
        }
        let watched = shared.watched();
        let late = watched.iter().filter(|watch| watch.cell.is_late());
        let modules: Vec<String> = late.map(|watch| watch.cell.name.to_string()).collect();
        if modules.len() >= LOST_THREAD_LIMIT {
            shared.run.finish(End::TooManyHung { modules });
        }
        // The token is with the late thread, unless a worker made the step for the loop.
        if watch.stage.is_some() && !cell.is_by_worker() {
            shared.move_token();
        }
    }

    fn report_return(&self, cell: &RunnerCell, state: &mut WatchState) {
        state.late = false;
        if std::mem::take(&mut state.is_reported) {
            let took = milliseconds(cell.returned().saturating_sub(state.since));
            let text = format!("{} returned after {took} ms and runs again", cell.name);
            self.shared.logger.log(self.shared.clock.now(), Level::Warn, &text);
        }
    }
}

/// Lets the processes go in which steps still run, and those that open their code.
fn disconnect_processes(watched: &[WatchedModule]) {
    watched.iter().filter(|watch| watch.cell.is_isolated).for_each(|watch| watch.cell.disconnect_launched());
    let busy = watched.iter().filter(|watch| watch.cell.is_isolated && watch.cell.running().is_some());
    busy.for_each(|watch| watch.cell.disconnect());
}

/// Returns the state of the modules that are still present.
fn carry_over(
    watched: &[WatchedModule],
    states: &[WatchState],
    present: &[WatchedModule],
) -> Vec<WatchState> {
    let known = |watch: &WatchedModule| {
        let index = watched.iter().position(|other| Arc::ptr_eq(&other.cell, &watch.cell));
        index.map(|index| states[index]).unwrap_or_default()
    };
    present.iter().map(known).collect()
}
