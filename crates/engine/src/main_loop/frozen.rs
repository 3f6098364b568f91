//! The main loop between two cycles, for a snapshot.

use std::sync::atomic::Ordering;

use serde::{Deserialize, Serialize};
use slate_blackboard::bytes;

use super::cycle::Position;
use super::{Core, Shared};
use crate::digest::Digest;

/// How far the loop was.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrozenLoop {
    /// Cycles begun.
    pub cycle: u64,
    /// The time of the last cycle.
    pub time: Option<u64>,
    /// Of what modules wrote so far; nothing on the wall clock.
    pub digest: Option<Digest>,
    /// Cycles that were left out, and times of the time source that were refused.
    pub overruns: u64,
    /// Times of the time source that were refused.
    pub refused_times: u64,
    /// What the application's time source needs to go on.
    #[serde(with = "bytes")]
    pub time_source: Vec<u8>,
}

impl Shared {
    /// The loop between two cycles, as who has the token sees it.
    pub fn freeze(&self, core: &Core) -> FrozenLoop {
        let own = core.time_source.as_ref().filter(|guest| guest.seat.is_none());
        FrozenLoop {
            cycle: core.cycle,
            time: core.time,
            digest: core.digest.clone(),
            overruns: self.measures.gauges.overruns.load(Ordering::Relaxed),
            refused_times: self.measures.gauges.refused_times.load(Ordering::Relaxed),
            time_source: own.map_or(Vec::new(), |guest| guest.code.save()),
        }
    }

    /// Whether the application's time source goes on from there; if so, it does.
    pub fn thaw_time_source(&self, core: &mut Core, frozen: &FrozenLoop) -> bool {
        let own = core.time_source.as_mut().filter(|guest| guest.seat.is_none());
        own.is_none_or(|guest| guest.code.restore(&frozen.time_source))
    }

    /// Lets the next cycle follow those of a frozen loop.
    pub fn thaw(&self, core: &mut Core, frozen: FrozenLoop) {
        core.cycle = frozen.cycle;
        core.time = frozen.time;
        core.digest = core.digest.take().and(frozen.digest).map(Digest::resumed);
        core.position = Position::default();
        core.pace.restart();
        self.measures.gauges.cycles.store(frozen.cycle, Ordering::Relaxed);
        self.measures.gauges.overruns.store(frozen.overruns, Ordering::Relaxed);
        self.measures.gauges.refused_times.store(frozen.refused_times, Ordering::Relaxed);
    }
}
