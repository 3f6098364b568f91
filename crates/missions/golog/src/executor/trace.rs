//! Trace of the most recent events of an execution.

use std::collections::VecDeque;

use crate::interpreter::GroundAction;

/// Maximum number of actions that are remembered.
pub const MOST_TRACED: usize = 32;

/// Event of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum TracedEvent {
    /// Done at once, as the robot performs no action for it.
    Done,
    /// Started by the robot.
    Started,
    /// The robot has reached its goal; the sensed fluent is true.
    Succeeded,
    /// The robot has failed; the sensed fluent is false.
    Failed,
    /// Occurrence of an exogenous action.
    Occurred,
}

/// Newest actions with their events.
#[derive(Clone, Debug, Default)]
pub(super) struct ActionTrace {
    entries: VecDeque<(GroundAction, TracedEvent)>,
    /// Number of all so far.
    pub count: u64,
}

impl ActionTrace {
    pub fn add(&mut self, action: GroundAction, event: TracedEvent) {
        if self.entries.len() == MOST_TRACED {
            self.entries.pop_front();
        }
        self.entries.push_back((action, event));
        self.count += 1;
    }

    /// Returns the entries, oldest first.
    pub fn entries(&self) -> impl Iterator<Item = (GroundAction, TracedEvent)> {
        self.entries.iter().copied()
    }
}
