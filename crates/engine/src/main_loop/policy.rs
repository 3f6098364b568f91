//! Who says which stage comes next.

use std::sync::Arc;

/// Where the main loop stands.
#[derive(Clone, Copy, Debug)]
pub struct LoopPosition<'a> {
    /// The stage that has ended; none at the beginning of a cycle.
    pub after: Option<usize>,
    /// The names of the loop's stages, in the order of its [`Schedule`](slate_configuration::Schedule).
    pub stages: &'a [Arc<str>],
    /// The agent's time, nanoseconds.
    pub now: u64,
    /// Counts cycles from 1.
    pub cycle: u64,
}

impl LoopPosition<'_> {
    /// The number of the stage of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.stages.iter().position(|stage| **stage == *name)
    }
}

/// Decides at run time in which order the main loop goes through its stages. It is asked between two stages and never
/// owns the loop's thread.
pub trait LoopPolicy: Send {
    /// The number of the stage that comes next, or none when the cycle is at its end. A stage may be left out, or come
    /// again in the same cycle, but a cycle has no more than [`STAGE_LIMIT`] stages.
    fn next(&mut self, place: &LoopPosition<'_>) -> Option<usize>;
}

/// A cycle of more stages than this is taken for one without an end, and its policy is removed.
pub const STAGE_LIMIT: u32 = 1000;
