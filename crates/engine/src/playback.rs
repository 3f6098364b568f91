use std::sync::Arc;

use slate_blackboard::{Board, Property};
use slate_composition::Played;

/// Replay of a recording in an agent, in lockstep with it.
/// An application passes it to the agent that it loads. Modules are linked to the replayed properties as to the outputs
/// of others.
///
/// It is called on the loop's thread and, like an observer, not watched. It sets the time.
pub trait Playback: Send {
    /// Returns the replayed properties.
    fn properties(&self) -> Vec<Played>;

    /// Starts the replay; called once, before anything is replayed.
    /// `properties` are those that are no mailboxes, in the order of [`properties`](Playback::properties); the
    /// mailboxes, and those of modules, are on the board.
    ///
    /// # Errors
    /// Why it can't be played.
    fn begin(&mut self, properties: &[Arc<Property>], board: &Board) -> Result<(), String>;

    /// Returns the time of the next cycle, ns.
    /// Arguments as of [`TimeSource::next`](crate::clock::TimeSource::next).
    fn next(&mut self, last: Option<u64>, planned: u64) -> u64;

    /// Writes and sends the recorded values of a cycle up to a module's turn.
    /// `now` is the cycle's time, and `before` the module whose turn is next; `None` for all that remain until the end
    /// of the cycle. So a module finds the recorded inputs, as replayed modules have their slots among those that run.
    fn write(&mut self, now: u64, before: Option<&str>);

    /// Returns the recorded answer to a module's request to change the configuration.
    /// The request is one between the last cycle and the next; `None` if it was not recorded, and the host has to apply
    /// the changes. The replay itself applies those that were recorded.
    fn answer(&mut self, module: &str, lines: &str) -> Option<Result<String, String>>;
}
