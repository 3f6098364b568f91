//! Snapshot of the main loop between two cycles.

use std::sync::atomic::Ordering;

use serde::{Deserialize, Serialize};
use slate_blackboard::bytes;

use super::cycle::Position;
use super::{Core, SharedLoop};
use crate::digest::Digest;

/// State of the loop in a snapshot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LoopSnapshot {
    /// Cycles begun.
    pub cycle: u64,
    /// Time of the last cycle.
    pub time: Option<u64>,
    /// Digest of all written values; `None` on the wall clock.
    pub digest: Option<Digest>,
    /// Cycles that were left out, and times of the time source that were refused.
    pub overruns: u64,
    /// Times of the time source that were refused.
    pub refused_times: u64,
    /// State of the application's time source.
    #[serde(with = "bytes")]
    pub time_source: Vec<u8>,
}

impl LoopSnapshot {
    /// Returns the state of the loop between two cycles; the caller has the token.
    pub fn of(shared: &SharedLoop, core: &Core) -> Self {
        let own = core.time_source.as_ref().filter(|callback| callback.cell.is_none());
        let gauges = &shared.measures.gauges;
        Self {
            cycle: core.cycle,
            time: core.time,
            digest: core.digest.clone(),
            overruns: gauges.overruns.load(Ordering::Relaxed),
            refused_times: gauges.refused_times.load(Ordering::Relaxed),
            time_source: own.map_or(Vec::new(), |callback| callback.code.save()),
        }
    }

    /// Restores the application's time source; false if the state does not fit.
    pub fn restore_time_source(&self, core: &mut Core) -> bool {
        let own = core.time_source.as_mut().filter(|callback| callback.cell.is_none());
        own.is_none_or(|callback| callback.code.restore(&self.time_source))
    }

    /// Lets the next cycle follow those of this loop.
    pub fn restore(self, shared: &SharedLoop, core: &mut Core) {
        core.cycle = self.cycle;
        core.time = self.time;
        core.digest = core.digest.take().and(self.digest).map(Digest::resumed);
        core.position = Position::default();
        core.pace.restart();
        let gauges = &shared.measures.gauges;
        gauges.cycles.store(self.cycle, Ordering::Relaxed);
        gauges.overruns.store(self.overruns, Ordering::Relaxed);
        gauges.refused_times.store(self.refused_times, Ordering::Relaxed);
    }
}
