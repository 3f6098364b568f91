use std::time::Duration;

use super::SharedLoop;
use crate::clock::monotonic;

/// Rate of virtual time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    /// Maximum rate that the machine reaches.
    Max,
    /// Seconds of the agent's time per second of the wall clock.
    Times(f64),
}

impl Rate {
    /// Rate of the wall clock.
    pub const REALTIME: Self = Self::Times(1.0);
}

/// Waits for the beginning of each cycle.
#[derive(Debug)]
pub struct Pace {
    rate: Rate,
    /// Minimum interval of the beginnings, wall-clock ns; 0 for none.
    minimum: u64,
    /// Monotonic and virtual time of the same moment, ns.
    /// It moves on by the cycles that are left out.
    origin: Option<(u64, u64)>,
    /// Monotonic time of the last cycle's begin, ns.
    begun: u64,
}

/// Beginning of a cycle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beginning {
    /// Nominal begin, monotonic, ns.
    pub nominal: u64,
    /// Lateness if cycles had to be left out for it, wall-clock ns; else 0.
    pub late: u64,
}

impl Pace {
    /// Returns a pace with a minimum time of a cycle, wall-clock ns.
    pub fn new(rate: Rate, minimum: u64) -> Self {
        Self { rate, minimum, origin: None, begun: 0 }
    }

    /// Restarts: the time since the last cycle is no lateness.
    pub fn restart(&mut self) {
        self.origin = None;
    }

    /// Goes at another rate, from the next cycle on.
    pub fn set_rate(&mut self, rate: Rate) {
        self.rate = rate;
        self.restart();
    }

    /// Sleeps until the cycle of that virtual time begins.
    ///
    /// Beginnings lie on a fixed grid, so that periods do not drift; missed cycles are left out, not caught up.
    pub(super) fn wait(&mut self, shared: &SharedLoop, time: u64) -> Beginning {
        // Reading the clock takes as long as a short module, so it is skipped where nothing depends on it.
        if self.rate == Rate::Max && self.minimum == 0 && shared.clock.is_driven() {
            return Beginning { nominal: 0, late: 0 };
        }
        let now = monotonic();
        let beginning = match self.rate {
            Rate::Max => Beginning { nominal: now, late: 0 },
            Rate::Times(factor) => {
                let (real, virtual_time) = *self.origin.get_or_insert((now, time));
                let nominal = real + ((time - virtual_time) as f64 / factor) as u64;
                let late = now.saturating_sub(nominal);
                let period = shared.period as f64 / factor;
                let missed = (late as f64 / period) as u64;
                if missed == 0 {
                    Beginning { nominal, late: 0 }
                } else {
                    let left_out = (missed as f64 * period) as u64;
                    self.origin = Some((real + left_out, virtual_time));
                    Beginning { nominal: nominal + left_out, late }
                }
            }
        };
        let begin = beginning.nominal.max(self.begun + self.minimum);
        self.begun = now;
        if begin > now {
            shared.run.sleep(Duration::from_nanos(begin - now));
            self.begun = monotonic();
        }
        beginning
    }
}
