//! Plan and result of a playback.

use std::path::PathBuf;

use slate_runtime::configuration::Report;
use slate_sorted::SortedSet;

use super::choice::Choice;
use slate_bag::Error;

/// Plan of a playback. Times are nanoseconds after the first value.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// The played topics, and their paths.
    pub choice: Choice,
    /// Beginning; the first value by default.
    pub start: Option<u64>,
    /// End; the last value by default.
    pub end: Option<u64>,
    /// Set to repeat the playback.
    pub repeats: bool,
    /// Set to begin paused.
    pub is_paused: bool,
    /// Set to pause at the end, until it is stopped.
    pub stays: bool,
    /// Factor of real time; `None` for as fast as possible.
    pub rate: Option<f64>,
    /// The modules that run on the recording; their recorded outputs are not played.
    pub modules: SortedSet<String>,
    /// Set to run modules with incomplete inputs, too.
    /// [`misses`](super::Player::misses) names those.
    pub is_partial: bool,
    /// Settings that overlay those of the recording.
    pub sets: Vec<String>,
}

/// Error of a playback.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// The file can't be read, or not be played as planned.
    #[error(transparent)]
    Bag(#[from] Error),
    /// The configuration or a setting is invalid.
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
    /// Duration from the recording's first value to the end, nanoseconds.
    pub time: u64,
    /// Set if the playback reached its end.
    pub is_whole: bool,
}
