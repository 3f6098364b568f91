//! Replay of a recording in the loop, with the modules that do not run.

use std::sync::Arc;

use slate_blackboard::channel::Latest;

use crate::Playback;
use crate::runner::{Health, ModuleCondition, ModuleState};

/// Replay of a recording in the loop.
pub struct LoopReplay {
    /// Player that sets the time and writes the values.
    pub playback: Box<dyn Playback>,
    /// Conditions of the replayed modules.
    pub conditions: Vec<ReplayedCondition>,
}

/// Recorded condition of a module.
pub struct ReplayedCondition {
    /// Recorded state.
    pub state: Latest,
    /// Condition that others see.
    pub health: Arc<Health>,
}

impl LoopReplay {
    /// Acts as [`Playback::write`], and shows the conditions of the modules.
    pub fn write(&mut self, now: u64, before: Option<&str>) {
        self.playback.write(now, before);
        for ReplayedCondition { state, health } in &mut self.conditions {
            if state.has_news() && state.refresh() {
                let place = std::mem::offset_of!(ModuleState, condition);
                let number = state.value().and_then(|loan| loan.bytes().get(place).copied());
                number.into_iter().for_each(|number| health.set(ModuleCondition(number)));
            }
        }
    }
}
