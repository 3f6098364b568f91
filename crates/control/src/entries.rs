//! What the answers of the operations are made of.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// A plugin of an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PluginEntry {
    /// Its name.
    pub name: String,
    /// Its version; empty when it is not loaded.
    pub version: String,
    /// The library that its code comes from, or will when it is loaded by name; none when it is linked in.
    pub file: Option<PathBuf>,
    /// Whether it is loaded; else it is only known.
    pub loaded: bool,
    /// The kinds of modules that it brings.
    pub kinds: Vec<String>,
    /// The modules that run its code.
    pub modules: Vec<String>,
    /// The library with new code that runs beside it, if any does.
    #[serde(default)]
    pub shadow: Option<PathBuf>,
}

/// Result of loading plugins.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoadedPlugins {
    /// The plugins.
    pub plugins: Vec<LoadedPlugin>,
    /// The modules.
    pub modules: Vec<String>,
}

/// A plugin that was loaded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoadedPlugin {
    /// Its name.
    pub name: String,
    /// The library that its code comes from; none when it is linked in.
    pub file: Option<PathBuf>,
}

/// Result of switching a module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Switched {
    /// Whether that changed anything; else it was so already.
    pub changed: bool,
    /// The plugin with whose reload the module begins; none unless it was switched on and has failed for good.
    pub needs_reload: Option<String>,
}

/// A plugin that was unloaded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnloadedPlugin {
    /// Its name.
    pub name: String,
    /// State of its library's memory.
    pub library: String,
}

/// A plugin whose code was exchanged.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reloaded {
    /// Its name.
    pub plugin: String,
    /// Its modules, each with why its state was not carried over, or nothing when it was.
    pub modules: Vec<(String, Option<String>)>,
    /// Whether the modules went on with their ports, between two ticks.
    pub in_place: bool,
    /// State of the old library's memory.
    pub old_library: String,
}

/// A module of an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModuleEntry {
    /// Its name.
    pub name: String,
    /// The kind that it is of.
    pub kind: String,
    /// The plugin that brings the kind.
    pub plugin: String,
    /// How it is, as in its `state`.
    pub condition: String,
    /// The required input without a value, or the service, that it waits for while it is `WAITING`.
    #[serde(default)]
    pub waiting_for: Option<String>,
    /// Ticks made.
    pub ticks: u64,
    /// Ticks beyond the deadline.
    pub misses: u64,
    /// Panics caught; of an isolated module also each other end of its process: a fault, a kill, a step that hung.
    pub panics: u64,
    /// Whether new code runs beside it; how that goes is at its `shadow`.
    #[serde(default)]
    pub has_shadow: bool,
}

/// A link of an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkEntry {
    /// The destination: an input or an inbox.
    pub to: String,
    /// The source: a property or an outbox.
    pub from: String,
    /// Whether messages go over it, from an outbox to an inbox.
    #[serde(default)]
    pub sends: bool,
    /// Whether nobody has written it, as types and roles leave no choice.
    #[serde(default)]
    pub inferred: bool,
    /// Other keys and values of its table in the configuration.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub options: Vec<(String, String)>,
    /// For a queue input: how many values wait for it, and how many it has lost because it was too slow.
    pub queue: Option<(u64, u64)>,
    /// For an input of a value: how old that was in the step of its reader that was measured last, ns of the agent's time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub age: Option<u64>,
    /// Whether it is a queue input that fell behind and reads no more, as its link says.
    #[serde(default)]
    pub evicted: bool,
    /// Why it brings nothing: what it leads to of another agent is not there, or a module is in the way of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trouble: Option<String>,
}

/// A setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SettingEntry {
    /// Its path, as `--set` takes it.
    pub path: String,
    /// Its value.
    pub value: serde_json::Value,
    /// The value as `--set` takes it.
    pub text: String,
    /// Where it is written.
    pub origin: String,
}

/// A setting that was changed; values as `--set` takes them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Changed {
    /// Its path.
    pub path: String,
    /// The value until now, if there was one.
    pub before: Option<String>,
    /// The value from now on, if there is one.
    pub after: Option<String>,
    /// The value of the module where nothing says another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub default: Option<String>,
    /// Of a link between two interfaces: which is made of which, field by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub conversion: Option<String>,
    /// Of a module that is switched on and has failed for good: the plugin with whose reload it begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needs_reload: Option<String>,
}

/// A setting that is not what the files say; values as `--set` takes them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Different {
    /// Its path.
    pub path: String,
    /// Value in the files, if any.
    pub file: Option<String>,
    /// Current value.
    pub present: Option<String>,
    /// Where that comes from.
    pub origin: Option<String>,
    /// The value of the module where nothing says another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub default: Option<String>,
}

/// Files that were written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Saved {
    /// Their paths.
    pub files: Vec<PathBuf>,
}

/// A snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SnapshotEntry {
    /// The agent that it is of.
    pub agent: String,
    /// When it was taken, nanoseconds of the agent's time.
    pub time: u64,
    /// Cycles of the main loop until then.
    pub cycle: u64,
}

/// A file with values of another agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RemoteSnapshotEntry {
    /// The other agent.
    pub agent: String,
    /// How many of its properties are in the file.
    pub properties: usize,
    /// How many of those have a value; mailboxes and what was never written have none.
    pub values: usize,
    /// How many have one that is not in the file: too large to be sent, or not to be read by this agent.
    #[serde(default)]
    pub unavailable: usize,
}

/// A trace that is or was recorded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TraceEntry {
    /// Its file.
    pub file: PathBuf,
    /// Whether the file is there, by `trace/end` or as the agent ends.
    pub ended: bool,
    /// When it began, nanoseconds.
    pub from: u64,
    /// When it ended, or until when it goes so far, nanoseconds.
    pub to: u64,
    /// Its tracks: the main loop and the modules that have done something.
    pub tracks: Vec<TrackEntry>,
}

/// Recorded spans of a module or the main loop.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrackEntry {
    /// Its name.
    pub name: String,
    /// The spans in the file.
    pub spans: u64,
    /// Number of spans that came faster than they could be written.
    pub missing: u64,
}

impl TraceEntry {
    /// The spans in the file.
    pub fn spans(&self) -> u64 {
        self.tracks.iter().map(|track| track.spans).sum()
    }

    /// Returns the number of spans that came faster than they could be written.
    pub fn missing(&self) -> u64 {
        self.tracks.iter().map(|track| track.missing).sum()
    }
}

/// The newest value of a property.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// The value.
    pub value: serde_json::Value,
    /// How many values were written until this one.
    pub sequence: u64,
    /// When it was written, nanoseconds of the agent's time.
    pub time: u64,
}

/// A property.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PropertyEntry {
    /// Its path, such as `r2/planner/timing`.
    pub path: String,
    /// Interface of its values.
    pub interface: String,
    /// Description.
    pub doc: String,
    /// Writer: `output` for its module, `setting` for the configuration and tools, `queue` for what it is linked to,
    /// `messages` for all who are linked to it; empty when it is another agent's.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub access: String,
}

/// Answer to a watch.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Watched {
    /// The URL of a property or a field.
    pub url: String,
    /// The sequence number of the last value that was seen; without one, the newest value counts as new.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<u64>,
}

/// New values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct News {
    /// Of the how manieth that is watched, from 0.
    pub of: usize,
    /// How many came before these and are kept no more.
    pub missed: u64,
    /// The values, the oldest first.
    pub readings: Vec<Reading>,
}

/// Controls that a tool has.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControlsEntry {
    /// The actuator.
    pub actuator: String,
    /// Interface of its commands.
    pub interface: String,
    /// For how long a command holds that is not renewed, milliseconds.
    pub hold: u64,
}

/// An actuator, and who has its controls.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HolderEntry {
    /// The actuator.
    pub actuator: String,
    /// Holder, for people; empty when the controls are free.
    pub holder: Option<String>,
    /// Since when, nanoseconds of the agent's time.
    pub since: Option<u64>,
}

/// How often values of a property come. Times are those of the agent's clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The property, as it was asked for.
    pub url: String,
    /// Interface of its values.
    pub interface: String,
    /// How many values came after the first that was seen.
    pub count: u64,
    /// How many came in a second; nothing before there are two.
    pub rate: Option<f64>,
    /// From a value to the next, nanoseconds, of those of which both were seen.
    pub interval: Option<Spread>,
    /// How many were replaced before they were looked at; they count in the rate, and not in the intervals.
    pub unseen: u64,
    /// How large they are on average, bytes.
    pub size: Option<f64>,
    /// Bytes in a second.
    pub bandwidth: Option<f64>,
    /// How old the newest one is, nanoseconds.
    pub age: Option<u64>,
    /// How many modules and other agents read it.
    pub readers: usize,
    /// Whether its writer is there.
    pub has_writer: bool,
    /// How many values readers with a queue have lost meanwhile.
    pub lost: u64,
}

/// How durations are spread, nanoseconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The shortest.
    pub min: u64,
    /// On average.
    pub mean: f64,
    /// The standard deviation.
    pub deviation: f64,
    /// Half of them are at most so long.
    pub p50: u64,
    /// 95 of 100 are.
    pub p95: u64,
    /// 99 of 100 are.
    pub p99: u64,
    /// The longest.
    pub max: u64,
}

/// Why an agent does not do what it was asked.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// Message, a line for each mistake.
    pub message: String,
    /// Advice on the mistake.
    pub help: String,
    /// The code of its kind, such as `S004`, if it has one; see [`Mistake`](slate_runtime::Mistake).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub code: Option<String>,
    /// For mistakes in a configuration: file, line and caret of each, as a terminal shows them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub report: Option<String>,
}
