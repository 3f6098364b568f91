//! What a recording is played by, and the modules of it that do not run.

use std::sync::Arc;

use slate_blackboard::channel::Latest;

use crate::Playback;
use crate::runner::{Health, ModuleCondition, ModuleState};

/// What plays a recording in the loop.
pub struct Playing {
    /// What says the time and writes.
    pub playback: Box<dyn Playback>,
    /// How the modules are that are played.
    pub conditions: Vec<PlayedCondition>,
}

/// How a module was when it was recorded.
pub struct PlayedCondition {
    /// Its state, which is played.
    pub state: Latest,
    /// What others see of it.
    pub health: Arc<Health>,
}

impl Playing {
    /// As [`Playback::write`].
    pub fn write(&mut self, now: u64, before: Option<&str>) {
        self.playback.write(now, before);
        for PlayedCondition { state, health } in &mut self.conditions {
            if state.has_news() && state.refresh() {
                let place = std::mem::offset_of!(ModuleState, condition);
                let number = state.value().and_then(|loan| loan.bytes().get(place).copied());
                number.into_iter().for_each(|number| health.set(ModuleCondition(number)));
            }
        }
    }
}
