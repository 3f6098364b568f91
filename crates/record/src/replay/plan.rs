//! How a recording is played, and what comes of it.

use std::collections::BTreeSet;
use std::path::PathBuf;

use slate_runtime::configuration::Report;

use super::choice::Choice;
use crate::storage::Error;

/// How a recording is played. Times are nanoseconds after its first value.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Which part of it, and where.
    pub choice: Choice,
    /// Where it begins; at the first value unless said.
    pub start: Option<u64>,
    /// Where it ends; at the last value unless said.
    pub end: Option<u64>,
    /// Whether it begins again at its end.
    pub repeats: bool,
    /// Whether it stands still until somebody lets it go on.
    pub is_paused: bool,
    /// Whether it stands still at its end, until it is stopped.
    pub stays: bool,
    /// How many times as fast as it was recorded; nothing for as fast as it can.
    pub rate: Option<f64>,
    /// The modules that run on what is played; what is recorded of them is not.
    pub modules: BTreeSet<String>,
    /// Whether they run also when not all is recorded that they read then; [`misses`](super::Player::misses) says what.
    pub is_partial: bool,
    /// Settings that go over those of the recording.
    pub sets: Vec<String>,
}

/// Error of a playback.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// The file can't be read, or not be played as is wanted.
    #[error(transparent)]
    Bag(#[from] Error),
    /// The configuration is none any more, or a setting is wrong.
    #[error(transparent)]
    Configuration(#[from] Report),
    /// The plan does not fit the recording.
    #[error("`{}`: {what}", slate_runtime::printable(path))]
    Unfit {
        /// The recording.
        path: PathBuf,
        /// Reason, and what to do.
        what: String,
    },
    /// A module does not return from its tick.
    #[error("a module does not return from its tick")]
    Hung,
}

/// Result of a playback.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlayedRun {
    /// Number of values.
    pub values: u64,
    /// Number of cycles.
    pub cycles: u64,
    /// From the first value of the recording to where it ended, nanoseconds.
    pub time: u64,
    /// Whether it went to its end.
    pub is_whole: bool,
}
