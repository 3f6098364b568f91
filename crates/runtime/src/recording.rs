//! Interface between an agent and its recorder.
//! The recorder sees every value that is written, and receives every change from outside.

mod history;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_blackboard::{Board, Pattern, Taps};

pub use crate::snapshot::PluginMark;
pub use history::{History, HistoryRequest, Left, TakeValue};
pub use slate_configuration::recorded_configuration as configuration;
use slate_configuration::{RATE, RecordRule, RecordSelection, period};

/// Recorder of an agent.
/// It sees the values of each property that it has a [tap](Taps::tap) for, in the threads that write them.
pub trait Recording: Taps {
    /// Notes changes of the agent that were made at once.
    /// They come from outside, or a module requested them. In lockstep they take place between the cycle of that number and
    /// the next one, in the order of the calls. `time` is the agent's, ns.
    fn changed(&self, cycle: u64, time: u64, changes: &[Change]);

    /// Waits for a short time until noted changes are stored durably.
    /// Stored changes outlive this process. The requester of a change calls it before the change is acknowledged.
    fn settle(&self) {}

    /// Control of recordings while the agent runs; `None` if tools have none.
    fn control(&self) -> Option<&dyn RecordingControl> {
        None
    }
}

/// Agent, as its recorder sees it.
pub trait RecordedAgent {
    /// The agent's board, with all properties.
    fn board(&self) -> &Arc<Board>;

    /// The agent's time, nanoseconds.
    fn now(&self) -> u64;

    /// Cycles begun.
    fn cycles(&self) -> u64;

    /// The plugins that are loaded.
    fn plugin_marks(&self) -> Vec<PluginMark>;

    /// The modules, each with its kind.
    fn kinds(&self) -> Vec<(String, String)>;

    /// The links, each under the path of the port that owns it.
    /// An input with its source, or an outbox with its inbox.
    fn links(&self) -> Vec<(String, String)>;

    /// The inboxes that links lead to, as [`links`](Self::links) names them.
    fn inboxes(&self) -> Vec<String>;

    /// The stages with their modules, in the order in which they run.
    fn order(&self) -> Vec<(String, Vec<String>)>;

    /// The whole present configuration, as TOML.
    fn configuration_text(&self) -> String;
}

/// Control of the recordings of a running agent; no call blocks a module.
pub trait RecordingControl: Send + Sync {
    /// Starts a recording into a file that must not exist yet.
    /// The newest value of each property comes first.
    ///
    /// # Errors
    /// The reason of the failure.
    fn start(
        &self,
        agent: &dyn RecordedAgent,
        file: &Path,
        what: &RecordSelection,
    ) -> Result<(), RecordingRefusal>;

    /// Ends the recording into a file; without a file, the only recording.
    ///
    /// # Errors
    /// The reason of the failure, or of the file being incomplete.
    fn stop(
        &self,
        agent: &dyn RecordedAgent,
        file: Option<&Path>,
    ) -> Result<RecordingEntry, RecordingRefusal>;

    /// State of all recordings.
    fn status(&self) -> RecordingStatus;

    /// Saves the flight recorder's last seconds into a file that must not exist yet.
    /// The last seconds are always in memory.
    ///
    /// # Errors
    /// The reason of the failure.
    fn save(&self, agent: &dyn RecordedAgent, file: &Path) -> Result<SavedFlight, RecordingRefusal>;

    /// Reads the values of a property from the flight recorder's last seconds.
    /// The last seconds are always in memory.
    ///
    /// # Errors
    /// The reason for which the values are not available.
    fn history(
        &self,
        request: &HistoryRequest,
        take: &mut TakeValue<'_>,
    ) -> Result<History, RecordingRefusal>;
}

/// Error of starting or stopping a recording.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct RecordingRefusal {
    /// Problem.
    pub message: String,
    /// Remedy.
    pub help: String,
}

/// State of an agent's recordings.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingStatus {
    /// The recordings, the oldest first, with those that have failed.
    pub recordings: Vec<RecordingEntry>,
    /// The last seconds that are in memory; nothing when none are kept.
    pub flight: Option<FlightEntry>,
    /// Folder of files without a path of their own; `None` without a recorder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
}

/// A recording.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingEntry {
    /// File.
    pub file: PathBuf,
    /// Time of the start, ns of the agent's time.
    pub from: u64,
    /// Values in it.
    pub values: u64,
    /// Missing values, dropped as no module waits for a slow disk.
    pub dropped: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Reason for which writing has ceased; `None` while it works.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// The last seconds of an agent, in memory.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlightEntry {
    /// Longest time span in memory, ns of the agent's time.
    pub keep: u64,
    /// Time of the oldest value, ns of the agent's time.
    pub from: u64,
    /// Time of the newest value, ns of the agent's time.
    pub to: u64,
    /// Memory in use, bytes.
    pub bytes: u64,
    /// Memory limit, bytes.
    pub memory: u64,
    /// Files that triggers have saved.
    pub saved: Vec<PathBuf>,
    /// Number of triggers ignored because one had saved a moment before.
    pub skipped: u64,
}

/// The last seconds of an agent, in a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedFlight {
    /// The file.
    pub file: PathBuf,
    /// Time of the oldest value, ns of the agent's time.
    pub from: u64,
    /// Time of the newest value, ns of the agent's time.
    pub to: u64,
    /// Values in it.
    pub values: u64,
    /// Size of the file, bytes.
    pub bytes: u64,
}

/// Parses a tool's selection of properties to record.
/// `rate` is the number of values per second of each property.
///
/// # Errors
/// The invalid part.
pub fn selection(
    select: &[String],
    exclude: &[String],
    rate: Option<f64>,
    on_change: bool,
) -> Result<RecordSelection, RecordingRefusal> {
    let patterns =
        |texts: &[String]| texts.iter().map(|text| Pattern::parse(text)).collect::<Result<Vec<_>, _>>();
    let wrong = |error: slate_blackboard::PatternError| RecordingRefusal {
        message: error.to_string(),
        help: "name properties as `slate list` does, such as '/r2/**' or '/**/scan'".into(),
    };
    let mut selection = RecordSelection { exclude: patterns(exclude).map_err(wrong)?, ..Default::default() };
    if !select.is_empty() {
        selection.select = patterns(select).map_err(wrong)?;
    }
    let period = rate.map(|rate| {
        let help = "give values a second, such as --rate 5";
        period(rate).ok_or(RecordingRefusal { message: RATE.into(), help: help.into() })
    });
    let period = period.transpose()?.unwrap_or(0);
    if period > 0 || on_change {
        selection.rules = vec![RecordRule { select: RecordSelection::default().select, period, on_change }];
    }
    Ok(selection)
}

/// A change of an agent that runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// A setting's value; `None` returns it to that of the files.
    Setting {
        /// Path as of `--set`, or `MODULE/enabled`.
        /// The latter is for a switch that is not in the configuration.
        path: String,
        /// Value, TOML.
        value: Option<String>,
    },
    /// Exchange of a plugin's code with that of a library.
    Reload {
        /// The plugin.
        plugin: String,
        /// The library.
        file: PathBuf,
        /// A hash over it.
        hash: u64,
    },
    /// Load of a plugin of the configuration, or of a library.
    Load {
        /// A plugin or a list of plugins of the configuration; empty for a library.
        name: String,
        /// The library, by its absolute path.
        file: Option<PathBuf>,
        /// Hash: the sum of those of the libraries of all new plugins.
        hash: u64,
    },
    /// Unload of a plugin, or of the plugins of a list.
    Unload {
        /// Name.
        name: String,
    },
    /// Stop of all actuators.
    Stop {
        /// Reason.
        reason: String,
    },
    /// End of the stop of the actuators.
    Reset,
    /// Arming of all actuators, or of one.
    Arm {
        /// Name of the actuator; `None` for all.
        actuator: Option<String>,
    },
    /// Change of a module's own setting; a rerun gets it from the module.
    Own {
        /// The module.
        module: String,
        /// Path, as in [`Setting`](Self::Setting).
        path: String,
        /// Value, as in [`Setting`](Self::Setting).
        value: Option<String>,
    },
    /// Answer to a module's request; its changes are recorded before it.
    Asked {
        /// The module.
        module: String,
        /// The requested changes, a line each.
        lines: String,
        /// The changes made, or the reason for which nothing has changed.
        answer: Result<String, String>,
    },
    /// New order of the modules on the main loop.
    Order {
        /// Modules of each stage, in the order in which they run.
        stages: Vec<(String, Vec<String>)>,
    },
    /// Change that can't be reproduced from a recording.
    Other {
        /// Description of the change.
        what: String,
    },
}
