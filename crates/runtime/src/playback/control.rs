//! What people and tools ask of a playback.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::recording::{History, HistoryWish, TakeValue};

/// A part of a recording that is played again and again, nanoseconds of the agent's time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoopSection {
    /// Where it begins.
    pub from: u64,
    /// Where it ends; what was written then still belongs to it.
    pub to: u64,
}

/// What a playback is to do. Times are nanoseconds after the first value of the recording.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Say how it stands.
    Status,
    /// Stand still.
    Pause,
    /// Go on.
    Resume,
    /// Make so many cycles, and stand still.
    Step(u64),
    /// Go on from that time, with the last value that each property had then.
    Seek(u64),
    /// Go that many times as fast as it was recorded; as fast as it can without a factor.
    Rate(Option<f64>),
    /// Play a part again and again; no part goes on to the end.
    Loop(Option<LoopSection>),
}

/// How a playback stands. Times are nanoseconds after the first value of the recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaybackStatus {
    /// The recording.
    pub file: PathBuf,
    /// The agent's time of its first value.
    #[serde(default)]
    pub begin: u64,
    /// Where it is.
    pub time: u64,
    /// Where it begins.
    pub from: u64,
    /// Where it ends.
    pub to: u64,
    /// Whether it stands still.
    pub is_paused: bool,
    /// How many times as fast as it was recorded; nothing for as fast as it can.
    pub rate: Option<f64>,
    /// What is played again and again, if anything is.
    pub section: Option<LoopSection>,
    /// Values that were written.
    pub values: u64,
    /// Modules that run on what is played.
    pub modules: Vec<String>,
}

/// What a playback is controlled by, from any thread.
pub trait PlaybackControl: Send + Sync {
    /// Does it, and says how the playback stands then.
    ///
    /// # Errors
    /// Why it can't be done, and what helps.
    fn order(&self, order: Order) -> Result<PlaybackStatus, (String, String)>;

    /// The values of a property that are recorded, also of times that are not played yet.
    ///
    /// # Errors
    /// Why there are none, and what helps.
    fn history(&self, wish: &HistoryWish, take: &mut TakeValue<'_>) -> Result<History, (String, String)>;
}
