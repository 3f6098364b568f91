//! What the two sides of the socket say to each other.

mod entries;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

pub use entries::*;

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
    /// Links an input or inbox: a list of [`Changed`].
    #[serde(rename = "link")]
    Link {
        /// The destination: an input or an inbox.
        to: String,
        /// The source: a property or an outbox.
        from: String,
        /// What else is said of the link: keys and values of its table, as a configuration has them.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        options: Vec<(String, String)>,
        /// Whether it is only found out if it can be done.
        #[serde(default)]
        dry_run: bool,
    },
    /// Takes the links of an input or inbox away, or one of them: a list of [`Changed`].
    #[serde(rename = "unlink")]
    Unlink {
        /// The destination.
        to: String,
        /// The source; all links of the destination unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        from: Option<String>,
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
        /// Only finds out which files that would be.
        #[serde(default)]
        dry_run: bool,
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
    /// Sends a message to a property that takes them: `done`, or `accepted` when it is not answered within a second.
    #[serde(rename = "message/send")]
    MessageSend {
        /// Its URL.
        url: String,
        /// The message, with all its fields.
        value: serde_json::Value,
        /// Whether it is only found out if it would be taken: `fits`.
        #[serde(default)]
        dry_run: bool,
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
