//! Makes a recorded run again.
//!
//! A recording of a run in lockstep has all that is needed for it: the configuration, the seed, the changes that were made
//! from outside, and every value that was written. [`Comparison`] makes the same run once more and compares each value.

mod compare;
mod difference;
mod expected;
mod file;
mod run;

pub use compare::{Comparison, Verdict};
pub use difference::Difference;
pub use file::ReadError;
pub use run::Run;
