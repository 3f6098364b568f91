use std::sync::Arc;

use slate_blackboard::{Board, Property};
use slate_composition::Played;

/// Plays a recording in an agent, which is in lockstep with it: an application gives it to the agent that it
/// loads. Modules are linked to what it plays as to the outputs of others.
///
/// It is asked on the loop's thread and, like an observer, not watched. The time goes as it says.
pub trait Playback: Send {
    /// What it plays.
    fn properties(&self) -> Vec<Played>;

    /// These are the properties that are no mailboxes, in the same order; those are on the board, as are the mailboxes of modules. Once, before anything is played.
    ///
    /// # Errors
    /// Why it can't be played.
    fn begin(&mut self, properties: &[Arc<Property>], board: &Board) -> Result<(), String>;

    /// The time of the next cycle, as a [`TimeSource`](crate::clock::TimeSource) says it.
    fn next(&mut self, last: Option<u64>, planned: u64) -> u64;

    /// Writes and sends what was written and taken before that module had its turn in the cycle of that time, which it has next;
    /// without a module, all that was until the end of the cycle. So a module finds what it found, as those that are played have
    /// their places among those that run.
    fn write(&mut self, now: u64, before: Option<&str>);

    /// What a module was answered when it asked for these changes of the configuration, between the last cycle and the next; nothing
    /// when it did not, and the host has to make them. Those that were made then are made by who plays.
    fn answer(&mut self, module: &str, lines: &str) -> Option<Result<String, String>>;
}
