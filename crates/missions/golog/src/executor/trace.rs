//! What an execution has done most recently.

use std::collections::VecDeque;

use crate::interpreter::GroundAction;

/// The most actions that are remembered.
pub const MOST_TRACED: usize = 32;

/// What has happened to an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum TracedEvent {
    /// It was done at once, as the robot performs nothing for it.
    Done,
    /// The robot has begun it.
    Started,
    /// The robot has reached its goal; what it senses is true.
    Succeeded,
    /// The robot has failed; what it senses is false.
    Failed,
    /// It has occurred: an exogenous action.
    Occurred,
}

/// The newest actions with what has happened to them.
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

    /// The entries, oldest first.
    pub fn entries(&self) -> impl Iterator<Item = (GroundAction, TracedEvent)> {
        self.entries.iter().copied()
    }
}
