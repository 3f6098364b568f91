//! Playback and repetition of recorded runs.
//!
//! A [`Player`] plays a recording in an agent: it writes the recorded values at their times, and tools see the robot as
//! in the run. Modules of the recorded agent, or new ones of theirs, may run on the recording.
//!
//! A recording of a run in lockstep has all that is needed to make it again: the configuration, the seed, the changes that
//! were made from outside, and every value that was written. [`Comparison`] makes the same run once more and compares
//! each value.

mod changes;
mod choice;
mod compare;
mod comparer;
mod coverage;
mod difference;
mod expected;
mod external;
mod form;
mod gap_check;
mod opening;
mod orders;
mod output_comparer;
mod plan;
mod play;
mod playback_reader;
mod player;
mod recomputed;
mod requests;
mod run;
mod timeline;
mod track;
mod treatment;
mod verdict;

pub use choice::Choice;
pub use compare::Comparison;
pub use difference::Difference;
pub use plan::{Plan, PlayError, PlayedRun};
pub use player::{Player, recorded_modules};
pub use recomputed::{Recomputation, Recomputed};
pub use run::Run;
pub use verdict::Verdict;
