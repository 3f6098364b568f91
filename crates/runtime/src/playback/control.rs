//! Control of a playback by people and tools.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::recording::{History, HistoryRequest, TakeValue};

/// Section of a recording that is played in a loop, ns of the agent's time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoopSection {
    /// Start of the section.
    pub from: u64,
    /// End of the section, included.
    pub to: u64,
}

/// Command to a playback.
/// Times are nanoseconds after the first value of the recording.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Return the state only.
    Status,
    /// Pause.
    Pause,
    /// Continue.
    Resume,
    /// Make a number of cycles, and pause.
    Step(u64),
    /// Jump to that time, with the last value that each property had then.
    Seek(u64),
    /// Play at a multiple of the recorded speed; `None` for as fast as possible.
    Rate(Option<f64>),
    /// Play a section in a loop; `None` plays on to the end.
    Loop(Option<LoopSection>),
}

/// State of a playback.
/// Times are nanoseconds after the first value of the recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaybackStatus {
    /// The recording.
    pub file: PathBuf,
    /// The agent's time of its first value.
    #[serde(default)]
    pub begin: u64,
    /// Present time.
    pub time: u64,
    /// Time of the start.
    pub from: u64,
    /// Time of the end.
    pub to: u64,
    /// True while it is paused.
    pub is_paused: bool,
    /// Multiple of the recorded speed; `None` for as fast as possible.
    pub rate: Option<f64>,
    /// Section that is played in a loop, if any.
    pub section: Option<LoopSection>,
    /// Values that were written.
    pub values: u64,
    /// Modules that run on the recording.
    pub modules: Vec<String>,
}

/// Control of a playback, from any thread.
pub trait PlaybackControl: Send + Sync {
    /// Carries out a command, and returns the new state of the playback.
    ///
    /// # Errors
    /// The reason of the failure, and the remedy.
    fn order(&self, order: Order) -> Result<PlaybackStatus, (String, String)>;

    /// Reads the recorded values of a property, also of later times.
    ///
    /// # Errors
    /// The reason for which the values are not available, and the remedy.
    fn history(
        &self,
        request: &HistoryRequest,
        take: &mut TakeValue<'_>,
    ) -> Result<History, (String, String)>;
}
