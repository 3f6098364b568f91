//! Policies that select the next stage of the loop.

use std::sync::Arc;

/// Position of the main loop between two stages.
#[derive(Clone, Copy, Debug)]
pub struct LoopPosition<'a> {
    /// Stage that has ended; `None` at the beginning of a cycle.
    pub after: Option<usize>,
    /// Names of the loop's stages, in the order of the schedule.
    /// As of its [`Schedule`](slate_configuration::Schedule).
    pub stages: &'a [Arc<str>],
    /// Agent's time, ns.
    pub now: u64,
    /// Counts cycles from 1.
    pub cycle: u64,
}

impl LoopPosition<'_> {
    /// Returns the index of the stage of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.stages.iter().position(|stage| **stage == *name)
    }
}

/// Order of the stages of the main loop, decided at run time.
/// It is called between two stages and never owns the loop's thread.
pub trait LoopPolicy: Send {
    /// Returns the index of the next stage; `None` at the end of the cycle.
    /// A stage may be left out, or come again in the same cycle, but a cycle has no more than [`STAGE_LIMIT`] stages.
    fn next(&mut self, place: &LoopPosition<'_>) -> Option<usize>;
}

/// Maximum number of stages in a cycle.
/// A cycle with more counts as endless, and its policy is removed.
pub const STAGE_LIMIT: u32 = 1000;
