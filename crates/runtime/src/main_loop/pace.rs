use std::time::{Duration, Instant};

use super::Shared;

/// How fast virtual time goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    /// As fast as the machine can.
    Max,
    /// That many seconds of the agent per second of the wall clock.
    Times(f64),
}

impl Rate {
    /// As fast as the wall clock.
    pub const REALTIME: Self = Self::Times(1.0);
}

/// Waits for the beginning of each cycle.
#[derive(Debug)]
pub(crate) struct Pace {
    rate: Rate,
    start: Option<Instant>,
    /// Cycles that were left out because the loop was late.
    skipped: u64,
}

impl Pace {
    pub fn new(rate: Rate) -> Self {
        Self { rate, start: None, skipped: 0 }
    }

    /// Sleeps until cycle number `cycle` (from 0) begins; returns the nanoseconds by which it is late.
    ///
    /// Beginnings lie on a fixed grid, so that periods do not drift; what was missed is left out, not caught up.
    #[allow(clippy::disallowed_methods, reason = "the host's pace is where wall-clock time enters")]
    pub fn wait(&mut self, shared: &Shared, cycle: u64) -> u64 {
        let Rate::Times(factor) = self.rate else { return 0 };
        let period = shared.period as f64 / factor;
        let start = *self.start.get_or_insert_with(Instant::now);
        let begin = start + Duration::from_nanos(((cycle + self.skipped) as f64 * period) as u64);
        let now = Instant::now();
        if let Some(early) = begin.checked_duration_since(now) {
            shared.sleep(early);
            return 0;
        }
        let late = now.duration_since(begin).as_nanos() as u64;
        let missed = (late as f64 / period) as u64;
        self.skipped += missed;
        if missed > 0 { late } else { 0 }
    }
}
