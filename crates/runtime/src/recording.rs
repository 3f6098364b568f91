//! The seam to what records an agent: it sees every value that is written, and is told what is changed from outside.

mod history;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_blackboard::{Board, Pattern, Taps};

pub use crate::snapshot::PluginMark;
pub use history::{History, HistoryWish, Left, TakeValue};
pub use slate_configuration::recorded_configuration as configuration;
use slate_configuration::{RATE, RecordRule, RecordSelection, period};

/// Records an agent. It sees the values of each property that it has a [tap](Taps::tap) for, in the threads that write
/// them.
pub trait Recording: Taps {
    /// The agent was changed, by somebody outside of it or for one of its modules: between its cycle of that number and the next
    /// one if it is in lockstep.
    fn changed(&self, cycle: u64, time: u64, change: &Change);

    /// Waits until what it was told of changes is where it outlives this process, but not for long: who has asked for a change
    /// does so before it is said to be made.
    fn settle(&self) {}

    /// What begins and ends recordings while the agent runs; nothing if that is not for tools.
    fn control(&self) -> Option<&dyn RecordingControl> {
        None
    }
}

/// An agent, for what records it.
pub trait RecordedAgent {
    /// Everything that the robot knows.
    fn board(&self) -> &Arc<Board>;

    /// The agent's time, nanoseconds.
    fn now(&self) -> u64;

    /// Cycles begun.
    fn cycles(&self) -> u64;

    /// The plugins that are loaded.
    fn plugin_marks(&self) -> Vec<PluginMark>;

    /// The modules, each with its kind.
    fn kinds(&self) -> Vec<(String, String)>;

    /// The links, each under the port that has it: an input and what it reads, or an outbox and its inbox.
    fn links(&self) -> Vec<(String, String)>;

    /// The inboxes that links lead to, as [`links`](Self::links) names them.
    fn inboxes(&self) -> Vec<String>;

    /// The stages and the modules of each, in the order in which they run.
    fn order(&self) -> Vec<(String, Vec<String>)>;

    /// The whole configuration as it is now, as TOML.
    fn configuration_text(&self) -> String;
}

/// Begins and ends recordings of an agent while it runs. None of this holds up a module.
pub trait RecordingControl: Send + Sync {
    /// Begins to record into a file that is not there yet. The newest value of each property comes first.
    ///
    /// # Errors
    /// Why it can't.
    fn start(
        &self,
        agent: &dyn RecordedAgent,
        file: &Path,
        what: &RecordSelection,
    ) -> Result<(), RecordingRefusal>;

    /// Ends a recording: that into a file, or else the only one.
    ///
    /// # Errors
    /// Why it can't, or why the file has not all.
    fn stop(
        &self,
        agent: &dyn RecordedAgent,
        file: Option<&Path>,
    ) -> Result<RecordingEntry, RecordingRefusal>;

    /// What is recorded, and how that goes.
    fn status(&self) -> RecordingStatus;

    /// Saves the last seconds, which are always in memory, into a file that is not there yet.
    ///
    /// # Errors
    /// Why it can't.
    fn save(&self, agent: &dyn RecordedAgent, file: &Path) -> Result<SavedFlight, RecordingRefusal>;

    /// The values of a property among those of the last seconds, which are always in memory.
    ///
    /// # Errors
    /// Why there are none.
    fn history(&self, wish: &HistoryWish, take: &mut TakeValue<'_>) -> Result<History, RecordingRefusal>;
}

/// Why a recording does not begin or end.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct RecordingRefusal {
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: String,
}

/// What is recorded of an agent.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingStatus {
    /// The recordings, the oldest first, with those that have failed.
    pub recordings: Vec<RecordingEntry>,
    /// The last seconds that are in memory; nothing when none are kept.
    pub flight: Option<FlightEntry>,
    /// Where files are that nobody has named; nothing when nothing can be recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
}

/// A recording.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingEntry {
    /// Its file.
    pub file: PathBuf,
    /// When it began, nanoseconds of the agent's time.
    pub from: u64,
    /// Values in it.
    pub values: u64,
    /// Values that are missing, as nobody waits for a slow disk.
    pub dropped: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Why nothing is written any more, if that is so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// The last seconds of an agent, in memory.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlightEntry {
    /// How far back they go at most, nanoseconds of the agent's time.
    pub keep: u64,
    /// From when they are, and until when.
    pub from: u64,
    /// Until when they are.
    pub to: u64,
    /// Bytes that they take,
    pub bytes: u64,
    /// and may take.
    pub memory: u64,
    /// Files that triggers have saved.
    pub saved: Vec<PathBuf>,
    /// How often a trigger saved nothing, as it had saved a moment ago.
    pub skipped: u64,
}

/// The last seconds of an agent, in a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedFlight {
    /// The file.
    pub file: PathBuf,
    /// From when it is, nanoseconds of the agent's time.
    pub from: u64,
    /// Until when it is.
    pub to: u64,
    /// Values in it.
    pub values: u64,
    /// Its bytes.
    pub bytes: u64,
}

/// What a tool wants to have recorded, in words; `rate` is values a second of each property.
///
/// # Errors
/// Which of it makes no sense.
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
    /// The setting at a path has that value, or is as the files say it if there is none.
    Setting {
        /// As `--set` takes it; or `MODULE/enabled`, for a switch that is not in the configuration.
        path: String,
        /// As TOML.
        value: Option<String>,
    },
    /// A plugin goes on with the code of that library.
    Reload {
        /// The plugin.
        plugin: String,
        /// The library.
        file: PathBuf,
        /// A hash over it.
        hash: u64,
    },
    /// A plugin of the configuration was loaded, or a library.
    Load {
        /// A plugin or a list of plugins of the configuration; empty for a library.
        name: String,
        /// The library, by its absolute path.
        file: Option<PathBuf>,
        /// The sum of the hashes over the libraries of all plugins that came.
        hash: u64,
    },
    /// A plugin, or those of a list, were unloaded.
    Unload {
        /// Its name.
        name: String,
    },
    /// All actuators were stopped.
    Stop {
        /// Why.
        reason: String,
    },
    /// The stop of the actuators was ended.
    Reset,
    /// Commands were let through to the actuators, or to one.
    Arm {
        /// Its name.
        actuator: Option<String>,
    },
    /// A module had a setting changed. A rerun has it from the module.
    Own {
        /// The module.
        module: String,
        /// As of a setting.
        path: String,
        /// As of a setting.
        value: Option<String>,
    },
    /// What came of a request of a module, whose changes are told before it.
    Asked {
        /// The module.
        module: String,
        /// The changes that it asked for, a line each.
        lines: String,
        /// What it was answered: what has changed, or why nothing has.
        answer: Result<String, String>,
    },
    /// The modules of the main loop have another order from now on.
    Order {
        /// Those of each stage, in the order in which they run.
        stages: Vec<(String, Vec<String>)>,
    },
    /// Something that can't be made again from a recording.
    Other {
        /// What, in words.
        what: String,
    },
}
