//! What the two sides of the socket say to each other.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::configuration::SaveTo;
use crate::playback::Order;

/// The version of this protocol; another one is another language.
pub const VERSION: u32 = 1;

/// The longest line, bytes.
pub const LINE_LIMIT: usize = 1 << 20;

/// The first line of an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Greeting {
    /// The version of the protocol.
    pub slate: u32,
    /// The name under which the agent is reached; a second agent of that name has a number behind it.
    pub agent: String,
}

/// What an agent is asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "call", deny_unknown_fields)]
pub enum Call {
    /// All plugins: a list of [`PluginEntry`].
    #[serde(rename = "plugin/list")]
    PluginList {},
    /// Loads a plugin of the configuration by name, or a library: [`LoadedPlugins`].
    #[serde(rename = "plugin/load")]
    PluginLoad {
        /// A plugin or a list of plugins of the configuration.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// A library, by its absolute path.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<PathBuf>,
    },
    /// Unloads a plugin, or those of a list: a list of [`UnloadedPlugin`].
    #[serde(rename = "plugin/unload")]
    PluginUnload {
        /// Its name.
        name: String,
    },
    /// Exchanges the code of a plugin: [`Reloaded`].
    #[serde(rename = "plugin/reload")]
    PluginReload {
        /// Its name.
        name: String,
        /// The library with the new code, by its absolute path; that which it came from unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<PathBuf>,
    },
    /// Runs new code beside that of a plugin, which is compared and thrown away: the modules, each with the path of the
    /// property that tells how it compares.
    #[serde(rename = "plugin/shadow")]
    PluginShadow {
        /// Its name.
        name: String,
        /// The library with the new code, by its absolute path.
        file: PathBuf,
    },
    /// Ends the new code beside a plugin; nothing.
    #[serde(rename = "plugin/end_shadow")]
    PluginEndShadow {
        /// Its name.
        name: String,
    },
    /// Lets the new code beside a plugin take over: [`Reloaded`].
    #[serde(rename = "plugin/promote")]
    PluginPromote {
        /// Its name.
        name: String,
    },
    /// Begins to record what runs when into a file that Perfetto opens; nothing. A connection records one file at a time;
    /// when it is lost before `trace/end`, there is no new file, and an older one stays as it is.
    #[serde(rename = "trace/record")]
    TraceRecord {
        /// The file, by its absolute path.
        file: PathBuf,
    },
    /// What this connection has recorded so far: [`TraceEntry`]; refused when it has failed, such as for a full disk.
    #[serde(rename = "trace/progress")]
    TraceProgress {},
    /// Ends the recording of this connection, whose file is then there: [`TraceEntry`].
    #[serde(rename = "trace/end")]
    TraceEnd {},
    /// All modules: a list of [`ModuleEntry`].
    #[serde(rename = "module/list")]
    ModuleList {},
    /// Switches a module on: [`Switched`].
    #[serde(rename = "module/enable")]
    ModuleEnable {
        /// Its name.
        name: String,
    },
    /// Switches a module off: [`Switched`].
    #[serde(rename = "module/disable")]
    ModuleDisable {
        /// Its name.
        name: String,
    },
    /// Links an input: a list of [`Changed`].
    #[serde(rename = "link")]
    Link {
        /// The input.
        to: String,
        /// What it reads.
        from: String,
        /// What else is said of the link: keys and values of its table, as a configuration has them.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        options: Vec<(String, String)>,
        /// Whether it is only found out if it can be done.
        #[serde(default)]
        dry_run: bool,
    },
    /// Takes the link of an input away: a list of [`Changed`].
    #[serde(rename = "unlink")]
    Unlink {
        /// The input.
        to: String,
        /// Whether it is only found out if it can be done.
        #[serde(default)]
        dry_run: bool,
    },
    /// All links: a list of [`LinkEntry`].
    #[serde(rename = "link/list")]
    LinkList {},
    /// The other agents that are known: a [`PeerList`](super::PeerList).
    #[serde(rename = "peers")]
    Peers {},
    /// The settings at a path and below it: a list of [`SettingEntry`].
    #[serde(rename = "config/get")]
    ConfigGet {
        /// The path; everything unless given.
        #[serde(default)]
        path: String,
    },
    /// Makes changes, all or none: a list of [`Changed`].
    #[serde(rename = "config/set")]
    ConfigSet {
        /// Paths and values, each as `--set` takes them.
        changes: Vec<(String, String)>,
        /// Whether it is only found out if it can be done.
        #[serde(default)]
        dry_run: bool,
    },
    /// Takes back what was changed at run time and not saved, at a path and below it: a list of [`Changed`].
    #[serde(rename = "config/revert")]
    ConfigRevert {
        /// The path; all changes unless given.
        #[serde(default)]
        path: String,
    },
    /// What holds and is not what the files say: a list of [`Different`].
    #[serde(rename = "config/diff")]
    ConfigDiff {},
    /// What is wrong with files that were edited and are refused: a [`Refusal`], or nothing.
    #[serde(rename = "config/refused")]
    ConfigRefused {},
    /// Writes what was changed at run time into the files: [`Saved`].
    #[serde(rename = "config/save")]
    ConfigSave {
        /// Which files.
        #[serde(default)]
        to: SaveTo,
    },
    /// The properties: a list of [`PropertyEntry`].
    #[serde(rename = "property/list")]
    PropertyList {
        /// Which of them, such as `/r2/**/timing`; all unless given. Of another agent that this one knows, such as
        /// `slate://robot/**`, or of what the team knows, `slate://team/**`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pattern: Option<String>,
    },
    /// Takes a snapshot: [`SnapshotEntry`].
    #[serde(rename = "snapshot/save")]
    SnapshotSave {
        /// The file, by its absolute path.
        file: PathBuf,
    },
    /// Goes on from a snapshot: [`SnapshotEntry`].
    #[serde(rename = "snapshot/load")]
    SnapshotLoad {
        /// The file, by its absolute path.
        file: PathBuf,
    },
    /// Writes the newest values of another agent's properties into a file, as JSON: [`RemoteSnapshotEntry`].
    #[serde(rename = "snapshot/remote")]
    SnapshotRemote {
        /// Which of them, such as `slate://robot/**`.
        url: String,
        /// The file, by its absolute path.
        file: PathBuf,
    },
    /// The newest value of a property or a field: [`Reading`], or nothing before the first write.
    #[serde(rename = "read")]
    Read {
        /// Its URL, which may be that of another agent that this one knows, and the time is that agent's then; or of what the
        /// team knows, such as `slate://team/victims`.
        url: String,
    },
    /// All values that a property keeps, or a field of them, the oldest first: a list of [`Reading`].
    #[serde(rename = "read/history")]
    ReadHistory {
        /// Its URL.
        url: String,
    },
    /// Begins to record values into a file that is not there yet; nothing.
    #[serde(rename = "record/start")]
    RecordStart {
        /// The file, by its absolute path.
        file: PathBuf,
        /// Which properties, such as `/r2/**`; all unless given.
        #[serde(default)]
        select: Vec<String>,
        /// Which of them not.
        #[serde(default)]
        exclude: Vec<String>,
        /// At most so many values a second of each.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rate: Option<f64>,
        /// Only values that are other ones than the last that was recorded.
        #[serde(default)]
        on_change: bool,
    },
    /// Ends a recording: [`RecordingEntry`](crate::recording::RecordingEntry).
    #[serde(rename = "record/stop")]
    RecordStop {
        /// Its file, by its absolute path; the only recording unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<PathBuf>,
    },
    /// What is recorded: [`RecordingStatus`](crate::recording::RecordingStatus).
    #[serde(rename = "record/status")]
    RecordStatus {},
    /// Saves the last seconds into a file that is not there yet: [`SavedFlight`](crate::recording::SavedFlight).
    #[serde(rename = "record/snapshot")]
    RecordSnapshot {
        /// The file, by its absolute path.
        file: PathBuf,
    },
    /// The values that came since a tool has looked, of properties or fields: a list of [`News`], of those of which there are
    /// any. It waits for the first one.
    #[serde(rename = "watch")]
    Watch {
        /// Of what.
        of: Vec<Watched>,
        /// How long it waits at most, milliseconds; 50 s is the longest.
        #[serde(default)]
        within: u64,
    },
    /// How often values of properties come: a list of [`Measured`], in the order of the URLs.
    #[serde(rename = "measure")]
    Measure {
        /// The properties.
        urls: Vec<String>,
        /// How long it is looked at them, milliseconds; 50 s is the longest.
        time: u64,
    },
    /// Sets a parameter, an input without a link, or a field of one, as `config/set` does, or whether a module is on:
    /// [`SetProperty`].
    #[serde(rename = "property/set")]
    PropertySet {
        /// Its URL.
        url: String,
        /// What it shall be.
        value: serde_json::Value,
    },
    /// Stops all actuators until `reset` and `arm`; nothing.
    #[serde(rename = "stop")]
    Stop {
        /// Why; it is kept and shown.
        #[serde(default)]
        reason: String,
    },
    /// Takes the controls of an actuator for this connection, until it ends or gives them back, in the place of those that it
    /// has: [`ControlsEntry`]; refused while somebody else has them.
    #[serde(rename = "controls/take")]
    ControlsTake {
        /// The actuator, such as `r2/wheels`.
        actuator: String,
        /// Who takes them, for people: it is in the log, and told to others who want them.
        #[serde(default)]
        who: String,
    },
    /// Commands the actuator whose controls this connection has, for as long as [`ControlsEntry::hold`] says: the state of
    /// its gate.
    #[serde(rename = "controls/command")]
    ControlsCommand {
        /// A value of its interface; fields that are not named are as in the command before.
        command: serde_json::Value,
    },
    /// Lets go at once, and keeps the controls: the state of the gate.
    #[serde(rename = "controls/release")]
    ControlsRelease {},
    /// Gives the controls back; nothing.
    #[serde(rename = "controls/leave")]
    ControlsLeave {},
    /// The actuators and who has the controls of each: a list of [`HolderEntry`].
    #[serde(rename = "controls/list")]
    ControlsList {},
    /// Controls the playback of a recording: a [`PlaybackStatus`](crate::playback::PlaybackStatus).
    #[serde(rename = "replay")]
    Replay {
        /// What it is to do.
        order: Order,
    },
    /// Ends a stop of the actuators: false when none was stopped.
    #[serde(rename = "reset")]
    Reset {},
    /// Lets commands through to the actuators, or to one; refused while one of them is stopped, else nothing.
    #[serde(rename = "arm")]
    Arm {
        /// Its name; all of them unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        actuator: Option<String>,
    },
}

/// What an agent answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// What was asked for.
    Result(serde_json::Value),
    /// It can't be done; nothing was changed.
    Error(Refusal),
}

/// Why an agent does not do what it was asked.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// What is wrong, in a line or one for each mistake.
    pub message: String,
    /// What to do about it.
    pub help: String,
    /// The code of its kind, such as `S004`, if it has one; see [`Mistake`](crate::Mistake).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub code: Option<String>,
    /// For mistakes in a configuration: file, line and caret of each, as a terminal shows them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub report: Option<String>,
}

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

/// What a load has brought.
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

/// What came of switching a module.
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
    /// What became of its library's memory.
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
    /// What became of the old library's memory.
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
    /// The input.
    pub to: String,
    /// What it reads.
    pub from: String,
    /// What else the configuration says of it: keys and values of its table.
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
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
}

/// A setting that is not what the files say; values as `--set` takes them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Different {
    /// Its path.
    pub path: String,
    /// What the files say, if they do.
    pub file: Option<String>,
    /// What holds.
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
    pub untold: usize,
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

/// What is recorded of a module or the main loop.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrackEntry {
    /// Its name.
    pub name: String,
    /// The spans in the file.
    pub spans: u64,
    /// Those that came faster than they could be written.
    pub missing: u64,
}

impl TraceEntry {
    /// The spans in the file.
    pub fn spans(&self) -> u64 {
        self.tracks.iter().map(|track| track.spans).sum()
    }

    /// Those that came faster than they could be written.
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
    /// What its values are.
    pub interface: String,
    /// What it is for.
    pub doc: String,
    /// Who writes it: `output` for its module, `setting` for the configuration and tools, `messages` for all who are linked to
    /// it; empty when it is another agent's.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub access: String,
}

/// What came of setting a property.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum SetProperty {
    /// A setting of the configuration: what changes.
    Setting(Vec<Changed>),
    /// Whether a module is on.
    Switch(Switched),
}

/// What a tool watches.
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
    /// What its commands are.
    pub interface: String,
    /// For how long a command holds that is not renewed, milliseconds.
    pub hold: u64,
}

/// An actuator, and who has its controls.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HolderEntry {
    /// The actuator.
    pub actuator: String,
    /// Who has them, for people; nothing when nobody has.
    pub holder: Option<String>,
    /// Since when, nanoseconds of the agent's time.
    pub since: Option<u64>,
}

/// How often values of a property come. Times are those of the agent's clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The property, as it was asked for.
    pub url: String,
    /// What its values are.
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
