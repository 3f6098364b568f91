use std::sync::Arc;
use std::time::Duration;

use slate_module::Level;

use super::notices::{Limit, milliseconds, repeated};
use super::{End, Seat, SharedLoop};
use crate::background::take_precedence;
use crate::clock::monotonic;

/// Number of simultaneously lost threads at which the run stops in order.
const LOST_LIMIT: usize = 4;
/// Interval of the watchdog's checks, ns: lower and upper bound.
const SHORTEST: u64 = 1_000_000;
const LONGEST: u64 = 50_000_000;
/// Maximum delay of a command's expiry by the interval of the checks, ns.
const LATENESS: u64 = 5_000_000;

/// Maximum wait at the end of a run for steps in processes of their own, ns.
const ENDING: u64 = 1_000_000_000;

/// Watchdog of late steps, past which it moves the loop, and of stale commands.
/// It expires commands that are not renewed, independently of the loop.
pub struct Watchdog {
    shared: Arc<SharedLoop>,
    /// Time after which a step hangs, ns.
    hang: u64,
}

/// Watched module.
pub struct WatchedModule {
    /// Seat of the module.
    pub seat: Arc<Seat>,
    /// Stage of the loop; `None` for a module with a thread of its own.
    pub stage: Option<Arc<str>>,
}

/// Watchdog's state of a module.
#[derive(Clone, Copy, Default)]
struct Seen {
    /// Number of the running step, and a monotonic time at which it ran, ns.
    step: u64,
    since: u64,
    /// True while the step is given up and has not returned; and if that was reported.
    late: bool,
    said: bool,
    notices: Limit,
}

impl Watchdog {
    /// Returns a watchdog of that loop; `hang` is the longest time of a step.
    pub fn new(shared: Arc<SharedLoop>, hang: Duration) -> Self {
        Self { shared, hang: hang.as_nanos() as u64 }
    }

    /// Watches until the run is over and no thread is in a step any more.
    pub fn watch(self) {
        // A module that takes all that it gets of the processors must not keep it waiting.
        take_precedence();
        let mut watched = self.shared.watched();
        let mut seen = vec![Seen::default(); watched.len()];
        let mut ended = None;
        loop {
            let now = monotonic();
            if !self.shared.run.is_running() && now >= *ended.get_or_insert(now) + ENDING {
                leave_processes(&watched);
            }
            let next = self.look(&watched, &mut seen, now);
            if self.shared.run.is_over_within(Duration::from_nanos(next.saturating_sub(now))) {
                return;
            }
            let present = self.shared.watched();
            if !Arc::ptr_eq(&present, &watched) {
                seen = carried(&watched, &seen, &present);
                watched = present;
            }
        }
    }

    /// Checks all modules; returns the monotonic time of the next check, ns.
    fn look(&self, watched: &[WatchedModule], seen: &mut [Seen], now: u64) -> u64 {
        let shared = &self.shared;
        // A stage that begins before the next look is not over by then.
        let interval = (self.hang / 4).min(shared.timeouts.shortest());
        let mut next = now + interval.clamp(SHORTEST, LONGEST);
        next = next.min(self.expire(now));
        let deadline = shared.timeouts.deadline();
        if deadline > now {
            next = next.min(deadline);
        }
        for (watch, seen) in watched.iter().zip(seen) {
            let seat = &watch.seat;
            if seat.is_isolated {
                // Its calls end by themselves, as its process is ended.
                continue;
            }
            if seen.late && !seat.is_late() {
                self.report_return(seat, seen);
            }
            let Some(step) = seat.running() else { continue };
            if seen.step != step {
                (seen.step, seen.since) = (step, now);
            }
            let started = seat.started();
            if started != 0 {
                seen.since = started;
            }
            // The deadline is that of the stage of this step, if it still holds after the step was seen to run.
            if let Some(stage) = &watch.stage
                && deadline != 0
                && now >= deadline
                && shared.timeouts.deadline() == deadline
            {
                self.give_up(
                    watch,
                    seen,
                    now,
                    &format!(
                        "tick before the time of stage {stage} was up, after {} ms",
                        milliseconds(now.saturating_sub(seen.since))
                    ),
                );
                continue;
            }
            let limit = seen.since + self.hang;
            if now >= limit {
                self.give_up(watch, seen, now, &format!("last call within {} ms", milliseconds(self.hang)));
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
        let (mut next, mut wrote) = (u64::MAX, false);
        for actuator in shared.actuators().iter() {
            wrote |= actuator.expire_stale();
            // A command that comes before the next look does not end much before the one after it.
            next = next.min(now + actuator.time_to_live() + LATENESS);
            if let Some(expires) = actuator.expires() {
                next = next.min(now + expires.saturating_sub(shared.clock.at(now)).max(SHORTEST));
            }
        }
        if wrote {
            shared.hooks.wrote();
        }
        next
    }

    fn give_up(&self, watch: &WatchedModule, seen: &mut Seen, now: u64, when: &str) {
        let (shared, seat) = (&self.shared, &watch.seat);
        if !seat.give_up(seen.step, shared.clock.now()) {
            return;
        }
        seen.late = true;
        if let Some(unsaid) = seen.notices.pass(now) {
            seen.said = true;
            let text = format!(
                "{} has not returned from its {when}; its outputs are safe values until it does{}",
                seat.name,
                repeated(unsaid)
            );
            shared.logger.log(shared.clock.now(), Level::Error, &text);
        }
        if shared.lockstep {
            shared.run.finish(End::Hung { module: seat.name.to_string() });
        }
        let watched = shared.watched();
        let late = watched.iter().filter(|watch| watch.seat.is_late());
        let modules: Vec<String> = late.map(|watch| watch.seat.name.to_string()).collect();
        if modules.len() >= LOST_LIMIT {
            shared.run.finish(End::TooManyHung { modules });
        }
        // The token is with the late thread, unless a worker made the step for the loop.
        if watch.stage.is_some() && !seat.is_helped() {
            shared.move_token();
        }
    }

    fn report_return(&self, seat: &Seat, seen: &mut Seen) {
        seen.late = false;
        if std::mem::take(&mut seen.said) {
            let took = milliseconds(seat.returned().saturating_sub(seen.since));
            let text = format!("{} returned after {took} ms and runs again", seat.name);
            self.shared.logger.log(self.shared.clock.now(), Level::Warn, &text);
        }
    }
}

/// Lets the processes go in which steps still run.
fn leave_processes(watched: &[WatchedModule]) {
    let busy = watched.iter().filter(|watch| watch.seat.is_isolated && watch.seat.running().is_some());
    busy.for_each(|watch| watch.seat.disconnect());
}

/// Returns the state of the modules that are still present.
fn carried(watched: &[WatchedModule], seen: &[Seen], present: &[WatchedModule]) -> Vec<Seen> {
    let known = |watch: &WatchedModule| {
        let place = watched.iter().position(|other| Arc::ptr_eq(&other.seat, &watch.seat));
        place.map(|place| seen[place]).unwrap_or_default()
    };
    present.iter().map(known).collect()
}
