use std::time::Duration;

use super::SharedLoop;
use crate::clock::monotonic;

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
pub struct Pace {
    rate: Rate,
    /// From one beginning to the next at least, wall-clock nanoseconds; 0 for nothing.
    minimum: u64,
    /// A monotonic and a virtual time that are the same moment. It moves on by the cycles that are left out.
    origin: Option<(u64, u64)>,
    /// When the last cycle began, monotonic.
    begun: u64,
}

/// When a cycle begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beginning {
    /// When it was meant to, monotonic.
    pub nominal: u64,
    /// By how much it is late, wall-clock nanoseconds, when others had to be left out for that; else 0.
    pub late: u64,
}

impl Pace {
    /// `minimum` is the least time of a cycle, wall-clock nanoseconds.
    pub fn new(rate: Rate, minimum: u64) -> Self {
        Self { rate, minimum, origin: None, begun: 0 }
    }

    /// Begins afresh: what passed since the last cycle was no lateness.
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
    /// Beginnings lie on a fixed grid, so that periods do not drift; what was missed is left out, not caught up.
    pub(super) fn wait(&mut self, shared: &SharedLoop, time: u64) -> Beginning {
        // Where nothing depends on the wall clock nobody asks for it: that takes as long as a short module.
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
