//! Entries of the operations' answers.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Plugin of an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PluginEntry {
    /// Name.
    pub name: String,
    /// Version; empty when it is not loaded.
    pub version: String,
    /// Library of its code, or the one that loading by name would take.
    /// `None` if it is linked in.
    pub file: Option<PathBuf>,
    /// Load state: true if loaded, false if only known.
    pub loaded: bool,
    /// Kinds of modules that it brings.
    pub kinds: Vec<String>,
    /// Modules that run its code.
    pub modules: Vec<String>,
    /// Library with new code that runs beside it, if any does.
    #[serde(default)]
    pub shadow: Option<PathBuf>,
}

/// Result of loading plugins.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoadedPlugins {
    /// Plugins.
    pub plugins: Vec<LoadedPlugin>,
    /// Modules.
    pub modules: Vec<String>,
}

/// Plugin that was loaded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoadedPlugin {
    /// Name.
    pub name: String,
    /// Library of its code; `None` when it is linked in.
    pub file: Option<PathBuf>,
}

/// Result of switching a module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EnableResult {
    /// Effect: false if the state was the same before.
    pub changed: bool,
    /// Plugin whose reload starts the module.
    /// `None` unless the module was switched on and has failed for good.
    pub needs_reload: Option<String>,
}

/// Plugin that was unloaded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnloadedPlugin {
    /// Name.
    pub name: String,
    /// State of its library's memory.
    pub library: String,
}

/// Plugin whose code was exchanged.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReloadedPlugin {
    /// Name.
    pub plugin: String,
    /// Modules, each with the reason why its state was not carried over, if any.
    pub modules: Vec<(String, Option<String>)>,
    /// Continuity: true if the modules kept their ports, between two ticks.
    pub in_place: bool,
    /// State of the old library's memory.
    pub old_library: String,
}

/// Documentation of a module, its ports and its parameters.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModuleDocumentation {
    /// Name.
    pub name: String,
    /// Documentation of its kind.
    pub doc: String,
    /// Ports, in their order.
    pub ports: Vec<PortDocumentation>,
    /// Parameters, in their order.
    pub parameters: Vec<ParameterDocumentation>,
}

/// Documentation of a port.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PortDocumentation {
    /// Name.
    pub name: String,
    /// Direction, such as `Input`.
    pub direction: String,
    /// Interface, or the service of an aspect.
    pub interface: String,
    /// Role; empty for none.
    pub role: String,
    /// Documentation of its values; that of the interface unless the port has its own.
    pub doc: String,
}

/// Documentation of a parameter.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParameterDocumentation {
    /// Name.
    pub name: String,
    /// Unit, such as `m`; empty for none.
    pub unit: String,
    /// Documentation.
    pub doc: String,
}

/// Module of an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModuleEntry {
    /// Name.
    pub name: String,
    /// Kind of the module.
    pub kind: String,
    /// Plugin that brings the kind.
    pub plugin: String,
    /// Condition, as in its `state`.
    pub condition: String,
    /// Missing dependency while it is `WAITING`:
    /// the required input without a value, or the service.
    #[serde(default)]
    pub waiting_for: Option<String>,
    /// Ticks made.
    pub ticks: u64,
    /// Ticks beyond the deadline.
    pub misses: u64,
    /// Number of caught panics.
    /// For an isolated module also of each other end of its process: a fault, a kill, a step that hung.
    pub panics: u64,
    /// Presence of trial code beside it; its `shadow` has the progress.
    #[serde(default)]
    pub has_shadow: bool,
}

/// Link of an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkEntry {
    /// Destination: an input or an inbox.
    pub to: String,
    /// Source: a property or an outbox.
    pub from: String,
    /// Message link, from an outbox to an inbox.
    #[serde(default)]
    pub sends: bool,
    /// Origin: true if inferred from types and roles.
    #[serde(default)]
    pub inferred: bool,
    /// Other keys and values of its table in the configuration.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub options: Vec<(String, String)>,
    /// Queue input: number of waiting values, and of lost ones.
    /// Values are lost when the reader is too slow.
    pub queue: Option<(u64, u64)>,
    /// Age of an input's value in the last measured step of its reader.
    /// In ns of the agent's time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub age: Option<u64>,
    /// Eviction: a queue input that fell behind and reads no more, as its link says.
    #[serde(default)]
    pub evicted: bool,
    /// Reason why it delivers nothing.
    /// Its source in another agent is missing, or a module is in the way of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trouble: Option<String>,
}

/// Setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SettingEntry {
    /// Path, as `--set` takes it.
    pub path: String,
    /// Value.
    pub value: serde_json::Value,
    /// Value as `--set` takes it.
    pub text: String,
    /// Place in the configuration files.
    pub origin: String,
}

/// Setting that was changed; values as `--set` takes them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SettingChange {
    /// Path.
    pub path: String,
    /// Previous value, if any.
    pub before: Option<String>,
    /// New value, if any.
    pub after: Option<String>,
    /// Default of the module, which applies where no other value is set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub default: Option<String>,
    /// Conversion of a link between two interfaces, field by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub conversion: Option<String>,
    /// Plugin whose reload starts a module that is on and has failed for good.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needs_reload: Option<String>,
}

/// Setting that differs from the files; values as `--set` takes them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SettingDifference {
    /// Path.
    pub path: String,
    /// Value in the files, if any.
    pub file: Option<String>,
    /// Current value.
    pub present: Option<String>,
    /// Source of the value.
    pub origin: Option<String>,
    /// Default of the module, which applies where no other value is set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub default: Option<String>,
}

/// Files that were written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedSettings {
    /// Their paths.
    pub files: Vec<PathBuf>,
}

/// Snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SnapshotEntry {
    /// Agent of the snapshot.
    pub agent: String,
    /// Time of the snapshot, ns of the agent's time.
    pub time: u64,
    /// Cycles of the main loop until then.
    pub cycle: u64,
}

/// File with values of another agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RemoteSnapshotEntry {
    /// Other agent.
    pub agent: String,
    /// Number of its properties in the file.
    pub properties: usize,
    /// Number of those with a value.
    /// Mailboxes and properties that were never written have none.
    pub values: usize,
    /// Number of those whose value is not in the file.
    /// It was too large to be sent, or is not readable by this agent.
    #[serde(default)]
    pub unavailable: usize,
}

/// Trace that is or was recorded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TraceEntry {
    /// File.
    pub file: PathBuf,
    /// Completion: the file exists, by `trace/end` or because the agent ends.
    pub ended: bool,
    /// Start time, ns.
    pub from: u64,
    /// End time, or the time reached so far, ns.
    pub to: u64,
    /// Tracks: the main loop and the modules that have done something.
    pub tracks: Vec<TrackEntry>,
}

/// Recorded spans of a module or the main loop.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrackEntry {
    /// Name.
    pub name: String,
    /// Spans in the file.
    pub spans: u64,
    /// Number of spans that came faster than they could be written.
    pub missing: u64,
}

impl TraceEntry {
    /// Returns the spans in the file.
    pub fn spans(&self) -> u64 {
        self.tracks.iter().map(|track| track.spans).sum()
    }

    /// Returns the number of spans that came faster than they could be written.
    pub fn missing(&self) -> u64 {
        self.tracks.iter().map(|track| track.missing).sum()
    }
}

/// Newest value of a property.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Value.
    pub value: serde_json::Value,
    /// Number of values written up to this one.
    pub sequence: u64,
    /// Time of the write, ns of the agent's time.
    pub time: u64,
}

/// Property.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PropertyEntry {
    /// Path, such as `r2/planner/timing`.
    pub path: String,
    /// Interface of its values.
    pub interface: String,
    /// Description.
    pub doc: String,
    /// Kind of its writer; empty if the property is another agent's.
    /// `output`: its module; `setting`: the configuration and tools; `queue`: the property that it is linked to;
    /// `messages`: every outbox that is linked to it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub access: String,
}

/// Answer to a watch.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Watched {
    /// URL of a property or a field.
    pub url: String,
    /// Sequence number of the last value seen.
    /// Without one, the newest value counts as new.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<u64>,
}

/// New values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ValueUpdate {
    /// Index of the watched property, from 0.
    pub of: usize,
    /// Number of earlier values that are no longer kept.
    pub missed: u64,
    /// Values, the oldest first.
    pub readings: Vec<Reading>,
}

/// Controls that a tool has.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControlsEntry {
    /// Actuator.
    pub actuator: String,
    /// Interface of its commands.
    pub interface: String,
    /// Time that a command holds unless renewed, ms.
    pub hold: u64,
}

/// Actuator and the holder of its control lease.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HolderEntry {
    /// Actuator.
    pub actuator: String,
    /// Holder, for people; empty when the controls are free.
    pub holder: Option<String>,
    /// Start of the control, ns of the agent's time.
    pub since: Option<u64>,
}

/// Measured rate, size and age of a property's values.
/// Times are those of the agent's clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateMeasurement {
    /// URL of the property, as requested.
    pub url: String,
    /// Interface of its values.
    pub interface: String,
    /// Number of values after the first one seen.
    pub count: u64,
    /// Rate of the values, Hz; `None` before there are two.
    pub rate: Option<f64>,
    /// Interval between consecutive values that were both seen, ns.
    pub interval: Option<Spread>,
    /// Number of values that were replaced before they were seen.
    /// They count in the rate, but not in the intervals.
    pub unseen: u64,
    /// Mean size of the values, bytes.
    pub size: Option<f64>,
    /// Bytes in a second.
    pub bandwidth: Option<f64>,
    /// Age of the newest value, ns.
    pub age: Option<u64>,
    /// Number of modules and other agents that read it.
    pub readers: usize,
    /// Presence of its writer.
    pub has_writer: bool,
    /// Number of values that queue readers have lost during the measurement.
    pub lost: u64,
}

/// Distribution of durations, ns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Minimum.
    pub min: u64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Half of them are at most so long.
    pub p50: u64,
    /// 95 of 100 are.
    pub p95: u64,
    /// 99 of 100 are.
    pub p99: u64,
    /// Maximum.
    pub max: u64,
}

/// Reason why an agent refuses a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// Message, a line for each error.
    pub message: String,
    /// Help on the error.
    pub help: String,
    /// Code of its kind, such as `S004`, if any.
    /// See [`ErrorCode`](slate_runtime::ErrorCode).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub code: Option<String>,
    /// Report of errors in a configuration.
    /// File, line and caret of each, as a terminal shows them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub report: Option<String>,
}
