//! Operations as calls of a client.

use std::path::Path;
use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_runtime::configuration::SaveTo;
use slate_runtime::playback::{Order, PlaybackStatus};
use slate_runtime::recording::{RecordingEntry, RecordingStatus, SavedFlight};

use super::{Client, ClientError, percent_encoded};
use crate::agent::{PeerList, RecordingRequest};
use crate::entries::{
    ControlsEntry, EnableResult, HolderEntry, LinkEntry, LoadedPlugins, ModuleDocumentation, ModuleEntry,
    PluginEntry, PropertyEntry, RateMeasurement, Reading, Refusal, ReloadedPlugin, RemoteSnapshotEntry,
    SavedSettings, SettingChange, SettingDifference, SettingEntry, SnapshotEntry, TraceEntry, UnloadedPlugin,
    ValueUpdate, Watched,
};
use crate::graph::DrawnGraph;

/// Result of a call.
type Done<T> = Result<T, ClientError>;

fn millis(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

fn file_part(file: &Path) -> String {
    percent_encoded(&file.to_string_lossy())
}

fn dry_run_query(dry_run: bool) -> &'static str {
    if dry_run { "?dry_run=true" } else { "" }
}

/// Returns the agent and the path of a URL, as in paths of the API.
fn url_path(own: &str, url: &str) -> String {
    let (agent, path) = match url.strip_prefix("slate://") {
        Some(rest) => rest.split_once('/').unwrap_or((rest, "")),
        None => (own, url.trim_start_matches('/')),
    };
    format!("{}/{}", percent_encoded(agent), percent_encoded(path))
}

/// Their errors are those of [`call`](Client::call).
#[allow(clippy::missing_errors_doc, reason = "shown above for all of them")]
impl Client {
    /// Returns the plugins.
    pub fn plugins(&mut self) -> Done<Vec<PluginEntry>> {
        self.call("GET", "/plugins", None)
    }

    /// Loads a plugin of the configuration.
    pub fn load(&mut self, name: &str) -> Done<LoadedPlugins> {
        self.call("PUT", &format!("/plugins/{}", percent_encoded(name)), None)
    }

    /// Loads a library, by its absolute path.
    pub fn load_library(&mut self, file: &Path) -> Done<LoadedPlugins> {
        self.call("POST", "/plugins", Some(&json!({ "file": file })))
    }

    /// Unloads a plugin, or those of a list.
    pub fn unload(&mut self, name: &str) -> Done<Vec<UnloadedPlugin>> {
        self.call("DELETE", &format!("/plugins/{}", percent_encoded(name)), None)
    }

    /// Exchanges the code of a plugin.
    /// The library is the one that it came from, or the one at an absolute path.
    pub fn reload(&mut self, name: &str, file: Option<&Path>) -> Done<ReloadedPlugin> {
        let body = file.map(|file| json!({ "file": file }));
        self.call("POST", &format!("/plugins/{}/reload", percent_encoded(name)), body.as_ref())
    }

    /// Runs the library at an absolute path as trial code beside a plugin.
    /// Returns the modules, each with the path of the property that compares them.
    pub fn shadow(&mut self, name: &str, file: &Path) -> Done<Vec<(String, String)>> {
        self.call(
            "PUT",
            &format!("/plugins/{}/shadow", percent_encoded(name)),
            Some(&json!({ "file": file })),
        )
    }

    /// Discards the trial code of a plugin.
    pub fn end_shadow(&mut self, name: &str) -> Done<()> {
        self.call::<Json>("DELETE", &format!("/plugins/{}/shadow", percent_encoded(name)), None).map(drop)
    }

    /// Lets the new code beside a plugin take over.
    pub fn promote(&mut self, name: &str) -> Done<ReloadedPlugin> {
        self.call("POST", &format!("/plugins/{}/promote", percent_encoded(name)), None)
    }

    /// Begins to record a trace into a file at an absolute path.
    /// The file exists after [`end_trace`](Client::end_trace).
    pub fn record_trace(&mut self, file: &Path) -> Done<()> {
        self.call::<Json>("POST", "/trace", Some(&json!({ "file": file }))).map(drop)
    }

    /// Returns the progress of this client's trace.
    pub fn trace_progress(&mut self) -> Done<TraceEntry> {
        self.call("GET", "/trace", None)
    }

    /// Ends the trace.
    pub fn end_trace(&mut self) -> Done<TraceEntry> {
        self.call("DELETE", "/trace", None)
    }

    /// Returns how the agent's run ended; none while it runs.
    pub fn run_end(&mut self) -> Done<Option<String>> {
        #[derive(Deserialize)]
        struct AgentState {
            #[serde(default)]
            over: Option<String>,
        }
        self.call("GET", "/agent", None).map(|agent: AgentState| agent.over)
    }

    /// Sends a message, or checks whether it would be taken; returns the outcome.
    pub fn send(&mut self, url: &str, value: Json, dry_run: bool) -> Done<String> {
        #[derive(Deserialize)]
        struct SendAnswer {
            status: String,
        }
        let path = format!("/slate/{}{}", url_path(&self.agent, url), dry_run_query(dry_run));
        self.call("POST", &path, Some(&value)).map(|sent: SendAnswer| sent.status)
    }

    /// Stops all actuators until `reset` and `arm`.
    pub fn stop(&mut self, reason: &str) -> Done<()> {
        // In the head of the request, so that nothing more has to come.
        self.call::<Json>("POST", &format!("/stop?reason={}", percent_encoded(reason)), None).map(drop)
    }

    /// Controls the playback of a recording, and returns its status.
    pub fn replay(&mut self, order: Order) -> Done<PlaybackStatus> {
        let (method, what, body) = match order {
            Order::Status => ("GET", "", None),
            Order::Pause => ("POST", "/pause", None),
            Order::Resume => ("POST", "/resume", None),
            Order::Step(cycles) => ("POST", "/step", Some(json!({ "cycles": cycles }))),
            Order::Seek(time) => ("POST", "/seek", Some(json!({ "time": time }))),
            Order::Rate(factor) => ("POST", "/rate", Some(json!({ "factor": factor }))),
            Order::Loop(section) => ("POST", "/loop", Some(json!({ "section": section }))),
        };
        let status: Option<PlaybackStatus> = self.call(method, &format!("/playback{what}"), body.as_ref())?;
        status.ok_or_else(|| ClientError::Refused(crate::agent::no_playback()))
    }

    /// Takes the controls of an actuator, until this is dropped or gives them back.
    pub fn take_controls(&mut self, actuator: &str, who: &str) -> Done<ControlsEntry> {
        #[derive(Deserialize)]
        struct Lease {
            lease: String,
            actuator: String,
            hold_ms: u64,
            interface: Interface,
        }
        #[derive(Deserialize)]
        struct Interface {
            title: String,
        }
        if self.lease.is_some() {
            self.leave_controls()?;
        }
        let body = json!({ "actuator": actuator, "who": who, "bound": true });
        let lease: Lease = self.call("POST", "/leases", Some(&body))?;
        self.lease = Some(lease.lease);
        Ok(ControlsEntry { actuator: lease.actuator, interface: lease.interface.title, hold: lease.hold_ms })
    }

    /// Commands the held actuators for a short while; returns the state of the gate.
    pub fn command(&mut self, command: Json) -> Done<Json> {
        self.drive(&json!({ "command": command }))
    }

    /// Lets go at once, and keeps the controls; the state of the gate.
    pub fn release(&mut self) -> Done<Json> {
        self.drive(&json!({ "release": true }))
    }

    fn drive(&mut self, body: &Json) -> Done<Json> {
        #[derive(Deserialize)]
        struct DriveAnswer {
            gate: Json,
        }
        let lease = percent_encoded(self.lease.as_deref().unwrap_or("none"));
        self.call("PUT", &format!("/leases/{lease}"), Some(body)).map(|driven: DriveAnswer| driven.gate)
    }

    /// Releases a control lease.
    pub fn leave_controls(&mut self) -> Done<()> {
        let Some(lease) = self.lease.take() else { return Ok(()) };
        match self.call::<Json>("DELETE", &format!("/leases/{}", percent_encoded(&lease)), None) {
            // It has ended by itself.
            Ok(_) | Err(ClientError::Refused(_)) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Returns the actuators, and the holder of each control lease.
    pub fn controls(&mut self) -> Done<Vec<HolderEntry>> {
        self.call("GET", "/leases", None)
    }

    /// Ends a stop of the actuators; false when none was stopped.
    pub fn reset(&mut self) -> Done<bool> {
        #[derive(Deserialize)]
        struct Reset {
            was_stopped: bool,
        }
        self.call("POST", "/reset", None).map(|reset: Reset| reset.was_stopped)
    }

    /// Arms all actuators, or one.
    pub fn arm(&mut self, actuator: Option<&str>) -> Done<()> {
        self.call::<Json>("POST", "/arm", Some(&json!({ "actuator": actuator }))).map(drop)
    }

    /// Returns the modules.
    pub fn modules(&mut self) -> Done<Vec<ModuleEntry>> {
        self.call("GET", "/modules", None)
    }

    /// Returns the documentation of a module, its ports and its parameters.
    pub fn describe(&mut self, name: &str) -> Done<ModuleDocumentation> {
        self.call("GET", &format!("/modules/{}", percent_encoded(name)), None)
    }

    /// Enables or disables a module.
    pub fn enable(&mut self, name: &str, on: bool) -> Done<EnableResult> {
        self.call("PUT", &format!("/modules/{}", percent_encoded(name)), Some(&json!({ "enabled": on })))
    }

    /// Returns the links.
    pub fn links(&mut self) -> Done<Vec<LinkEntry>> {
        self.call("GET", "/links", None)
    }

    /// Modules, gates and links, as they are drawn.
    pub fn graph(&mut self) -> Done<DrawnGraph> {
        self.call("GET", "/graph", None)
    }

    /// Returns the other agents that are known.
    pub fn peers(&mut self) -> Done<PeerList> {
        self.call("GET", "/peers", None)
    }

    /// Links an input, or checks whether that is possible.
    /// Options are keys and values of the link's table.
    pub fn link(
        &mut self,
        to: &str,
        from: &str,
        options: &[(String, String)],
        dry_run: bool,
    ) -> Done<Vec<SettingChange>> {
        let path = format!("/links/{}{}", percent_encoded(to), dry_run_query(dry_run));
        self.call("PUT", &path, Some(&json!({ "from": from, "options": options })))
    }

    /// Removes the links of an input or inbox, or checks whether that is possible.
    pub fn unlink(&mut self, to: &str, dry_run: bool) -> Done<Vec<SettingChange>> {
        self.unlink_from(to, None, dry_run)
    }

    /// Removes the link between a destination and a source, or all of the destination.
    pub fn unlink_from(&mut self, to: &str, from: Option<&str>, dry_run: bool) -> Done<Vec<SettingChange>> {
        let from = from.map_or_else(String::new, |from| format!("&from={}", percent_encoded(from)));
        self.call("DELETE", &format!("/links/{}?dry_run={dry_run}{from}", percent_encoded(to)), None)
    }

    /// Returns the settings at a path and below it; an empty path is everything.
    pub fn settings(&mut self, path: &str) -> Done<Vec<SettingEntry>> {
        self.call("GET", &format!("/settings?path={}", percent_encoded(path)), None)
    }

    /// Makes changes, all or none; each a path and a value as `--set` takes them.
    pub fn set(&mut self, changes: &[(String, String)]) -> Done<Vec<SettingChange>> {
        self.call("PATCH", "/settings", Some(&json!(changes)))
    }

    /// Reverts unsaved run-time changes at a path and below it.
    /// An empty path stands for all of them.
    pub fn revert(&mut self, path: &str) -> Done<Vec<SettingChange>> {
        self.call("DELETE", &format!("/settings?path={}", percent_encoded(path)), None)
    }

    /// Returns the settings that differ from those of the files.
    pub fn differences(&mut self) -> Done<Vec<SettingDifference>> {
        self.call("GET", "/settings/differences", None)
    }

    /// Returns the errors in files that were edited and are refused.
    pub fn refused_edit(&mut self) -> Done<Option<Refusal>> {
        self.call("GET", "/settings/refused", None)
    }

    /// Writes the changes made at run time into the files.
    pub fn save(&mut self, to: SaveTo) -> Done<SavedSettings> {
        self.call("POST", "/settings/save", Some(&json!({ "to": to })))
    }

    /// Returns the properties that match a pattern such as `/**/timing`.
    /// All of them without a pattern.
    pub fn properties(&mut self, pattern: Option<&str>) -> Done<Vec<PropertyEntry>> {
        let query =
            pattern.map_or_else(String::new, |pattern| format!("?pattern={}", percent_encoded(pattern)));
        self.call("GET", &format!("/properties{query}"), None)
    }

    /// Takes a snapshot, into a file at an absolute path.
    pub fn save_snapshot(&mut self, file: &Path) -> Done<SnapshotEntry> {
        self.call("POST", &format!("/snapshots/{}", file_part(file)), None)
    }

    /// Lets the agent continue from the snapshot at an absolute path.
    pub fn load_snapshot(&mut self, file: &Path) -> Done<SnapshotEntry> {
        self.call("POST", &format!("/snapshots/{}/load", file_part(file)), None)
    }

    /// Writes the newest values of another agent's properties into a file.
    /// The properties are given such as `slate://robot/**`, the file by an absolute path.
    pub fn save_remote(&mut self, url: &str, file: &Path) -> Done<RemoteSnapshotEntry> {
        let path = format!("/snapshots/{}/values", file_part(file));
        self.call("POST", &path, Some(&json!({ "url": url })))
    }

    /// Begins to record into a file at an absolute path, which must not exist yet.
    /// Properties are given such as `/r2/**`, all without any; of each at most so many values per second, or only
    /// changed ones.
    pub fn start_recording(
        &mut self,
        file: &Path,
        (select, exclude): (&[String], &[String]),
        rate: Option<f64>,
        on_change: bool,
    ) -> Done<()> {
        let request =
            RecordingRequest { select: select.to_vec(), exclude: exclude.to_vec(), rate, on_change };
        self.call::<Json>("POST", &format!("/recordings/{}", file_part(file)), Some(&json!(request)))
            .map(drop)
    }

    /// Ends the recording into the file at an absolute path, or the only one.
    pub fn stop_recording(&mut self, file: Option<&Path>) -> Done<RecordingEntry> {
        match file {
            Some(file) => self.call("POST", &format!("/recordings/{}/stop", file_part(file)), None),
            None => self.call("DELETE", "/recordings", None),
        }
    }

    /// Returns the state of the recordings.
    pub fn recordings(&mut self) -> Done<RecordingStatus> {
        #[derive(Deserialize)]
        struct Recordings {
            can_record: bool,
            #[serde(flatten)]
            status: RecordingStatus,
        }
        let recordings: Recordings = self.call("GET", "/recordings", None)?;
        match recordings.can_record {
            true => Ok(recordings.status),
            false => Err(ClientError::Refused(crate::agent::no_recorder())),
        }
    }

    /// Saves the last seconds into a file at an absolute path.
    /// The file must not exist yet.
    pub fn save_flight(&mut self, file: &Path) -> Done<SavedFlight> {
        self.call("POST", &format!("/recordings/{}/snapshot", file_part(file)), None)
    }

    /// Returns the newest value of a property or field; `None` before the first write.
    pub fn read(&mut self, url: &str) -> Done<Option<Reading>> {
        let reading: Reading = self.call("GET", &format!("/slate/{}", url_path(&self.agent, url)), None)?;
        Ok(Some(reading).filter(|reading| reading.sequence > 0))
    }

    /// Returns the values that came since the last call.
    /// It waits for the first one, 50 s at most.
    pub fn watch(&mut self, of: &[Watched], within: Duration) -> Done<Vec<ValueUpdate>> {
        self.call("POST", "/watch", Some(&json!({ "of": of, "within": millis(within) })))
    }

    /// Measures the rate of properties' values over a time of 50 s at most.
    pub fn measure(&mut self, urls: &[String], time: Duration) -> Done<Vec<RateMeasurement>> {
        self.call("POST", "/measure", Some(&json!({ "urls": urls, "time": millis(time) })))
    }

    /// Sets a parameter, an unlinked input, a field, or a module's enabled state.
    /// Fields that an object does not name keep their values.
    pub fn set_property(&mut self, url: &str, value: &Json) -> Done<Vec<SettingChange>> {
        let method = if value.is_object() { "PATCH" } else { "PUT" };
        self.call(method, &format!("/slate/{}", url_path(&self.agent, url)), Some(value))
    }

    /// Returns all values that a property or a field keeps, the oldest first.
    /// Of a queue, the last ones.
    pub fn history(&mut self, url: &str) -> Done<Vec<Reading>> {
        #[derive(Deserialize)]
        struct QueueValues {
            values: Vec<Reading>,
        }
        let path = format!("/queues/{}?limit=100000", url_path(&self.agent, url));
        self.call("GET", &path, None).map(|kept: QueueValues| kept.values)
    }
}
