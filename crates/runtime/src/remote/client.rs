//! A tool's side of the socket.

use std::io::ErrorKind;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use serde::de::DeserializeOwned;

use super::place;
use super::protocol::{
    Answer, Call, Changed, ControlsEntry, Different, Greeting, HolderEntry, LinkEntry, LoadedPlugins,
    Measured, ModuleEntry, News, PluginEntry, PropertyEntry, Reading, Refusal, Reloaded, RemoteSnapshotEntry,
    Saved, SetProperty, SettingEntry, SnapshotEntry, Switched, TraceEntry, UnloadedPlugin, VERSION, Watched,
};
use super::wire::{LocalWire, Wire};
use crate::configuration::SaveTo;
use crate::playback::{Order, PlaybackStatus};
use crate::recording::{RecordingEntry, RecordingStatus, SavedFlight};
use crate::stop_line;

/// How long an agent may take for its greeting.
const GREETING: Duration = Duration::from_secs(5);

/// How long it may take for an answer: a module may be slow to let itself be exchanged.
const ANSWER: Duration = Duration::from_secs(60);

/// How long an agent may take to confirm a stop over its line; then it is asked as other calls are.
const LINE: Duration = Duration::from_secs(2);

/// Why an agent was not asked, or does not do it.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// There is no such agent.
    #[error("no agent `{name}` runs here")]
    NoAgent {
        /// What was asked for.
        name: String,
        /// The agents that run.
        running: Vec<String>,
    },
    /// The agent refuses.
    #[error("{}", .0.message)]
    Refused(Refusal),
    /// It speaks another version of the protocol.
    #[error("agent `{name}` speaks version {found} of the protocol, this program version {VERSION}")]
    Version {
        /// The agent.
        name: String,
        /// Its version.
        found: u32,
    },
    /// It said what makes no sense.
    #[error("agent `{name}` sent what can't be understood: {problem}")]
    Nonsense {
        /// The agent.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The connection broke, or the agent does not answer.
    #[error("agent `{name}` does not answer: {error}")]
    Lost {
        /// The agent.
        name: String,
        /// What happened.
        error: std::io::Error,
    },
}

/// A connection to an agent.
#[derive(Debug)]
pub struct Client {
    name: String,
    is_local: bool,
    wire: Box<dyn Wire>,
}

impl Client {
    /// Connects to the agent that is reached by that name.
    ///
    /// # Errors
    /// When there is none, or it does not greet as it should.
    pub fn connect(name: &str) -> Result<Self, ClientError> {
        let mut client = Self::to_socket(name)?;
        client.greeting()?;
        Ok(client)
    }

    /// Stops all actuators of the agent that is reached by that name, until `reset` and `arm`. It is said before anything is heard,
    /// so that an agent that hangs finds it when it goes on, also when nobody waits for it any more.
    ///
    /// # Errors
    /// When there is no such agent, or it does not answer.
    pub fn stop_at_once(name: &str, reason: &str) -> Result<(), ClientError> {
        // There also when the agent has no descriptor, thread or place for one more tool.
        if place::socket(name).and_then(|socket| stop_line::stop(&socket, reason, LINE)).is_ok() {
            return Ok(());
        }
        let mut client = Self::to_socket(name)?;
        client.say(&Call::Stop { reason: reason.into() })?;
        client.greeting()?;
        client.hear()
    }

    fn to_socket(name: &str) -> Result<Self, ClientError> {
        let lost = |error| ClientError::Lost { name: name.into(), error };
        let connected = place::socket(name).and_then(UnixStream::connect);
        let stream = connected.map_err(|error| match error.kind() {
            // Refused by a socket that nobody listens at.
            ErrorKind::NotFound | ErrorKind::ConnectionRefused => {
                ClientError::NoAgent { name: name.into(), running: place::agents() }
            }
            _ => lost(error),
        })?;
        let wire = Box::new(LocalWire::new(stream).map_err(lost)?);
        Ok(Self { name: name.into(), is_local: true, wire })
    }

    /// Speaks to an agent over another connection than its socket; `address` says where it is until it has said its name.
    ///
    /// # Errors
    /// When it does not greet as it should.
    pub fn over(address: &str, wire: Box<dyn Wire>) -> Result<Self, ClientError> {
        let mut client = Self { name: address.into(), is_local: false, wire };
        client.name = client.greeting()?.agent;
        Ok(client)
    }

    /// What an agent says first.
    fn greeting(&mut self) -> Result<Greeting, ClientError> {
        let greeting: serde_json::Value = self.receive(GREETING)?;
        if let Ok(Answer::Error(refusal)) = serde_json::from_value(greeting.clone()) {
            return Err(ClientError::Refused(refusal));
        }
        let greeting: Greeting =
            serde_json::from_value(greeting).map_err(|error| self.nonsense(error.to_string()))?;
        match greeting.slate {
            VERSION => Ok(greeting),
            found => Err(ClientError::Version { name: self.name.clone(), found }),
        }
    }

    /// The name under which the agent is reached, or that it has said.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it is reached by a socket of this computer.
    pub fn is_local(&self) -> bool {
        self.is_local
    }

    /// Asks the agent, and returns what it answers.
    ///
    /// # Errors
    /// When it refuses, or the connection is lost.
    pub fn call<T: DeserializeOwned>(&mut self, call: &Call) -> Result<T, ClientError> {
        self.say(call)?;
        self.hear()
    }

    fn say(&mut self, call: &Call) -> Result<(), ClientError> {
        let text = serde_json::to_string(call).map_err(|error| self.nonsense(error.to_string()))?;
        self.wire.send(&text).map_err(|error| self.lost(error))
    }

    fn hear<T: DeserializeOwned>(&mut self) -> Result<T, ClientError> {
        match self.receive(ANSWER)? {
            Answer::Error(refusal) => Err(ClientError::Refused(refusal)),
            Answer::Result(result) => {
                serde_json::from_value(result).map_err(|error| self.nonsense(error.to_string()))
            }
        }
    }

    fn receive<T: DeserializeOwned>(&mut self, within: Duration) -> Result<T, ClientError> {
        match self.wire.receive(within) {
            Ok(message) => serde_json::from_slice(&message).map_err(|error| self.nonsense(error.to_string())),
            Err(error) if error.kind() == ErrorKind::InvalidData => Err(self.nonsense(error.to_string())),
            Err(error) if error.kind() == ErrorKind::TimedOut => {
                let said =
                    format!("no answer within {} s; it may go on with what it was asked", within.as_secs());
                Err(self.lost(std::io::Error::new(ErrorKind::TimedOut, said)))
            }
            Err(error) => Err(self.lost(error)),
        }
    }

    fn nonsense(&self, problem: String) -> ClientError {
        ClientError::Nonsense { name: self.name.clone(), problem }
    }

    fn lost(&self, error: std::io::Error) -> ClientError {
        ClientError::Lost { name: self.name.clone(), error }
    }
}

fn millis(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

/// The calls, each as its [`Call`] says; their errors are those of [`call`](Client::call).
#[allow(clippy::missing_errors_doc, reason = "said above for all of them")]
impl Client {
    /// The plugins.
    pub fn plugins(&mut self) -> Result<Vec<PluginEntry>, ClientError> {
        self.call(&Call::PluginList {})
    }

    /// Loads a plugin of the configuration.
    pub fn load(&mut self, name: &str) -> Result<LoadedPlugins, ClientError> {
        self.call(&Call::PluginLoad { name: Some(name.into()), file: None })
    }

    /// Loads a library, by its absolute path.
    pub fn load_library(&mut self, file: &Path) -> Result<LoadedPlugins, ClientError> {
        self.call(&Call::PluginLoad { name: None, file: Some(file.into()) })
    }

    /// Unloads a plugin, or those of a list.
    pub fn unload(&mut self, name: &str) -> Result<Vec<UnloadedPlugin>, ClientError> {
        self.call(&Call::PluginUnload { name: name.into() })
    }

    /// Exchanges the code of a plugin, by the library that it came from or that at an absolute path.
    pub fn reload(&mut self, name: &str, file: Option<&Path>) -> Result<Reloaded, ClientError> {
        self.call(&Call::PluginReload { name: name.into(), file: file.map(Into::into) })
    }

    /// Runs the code of the library at an absolute path beside that of a plugin; the modules, each with the path of the
    /// property that tells how it compares.
    pub fn shadow(&mut self, name: &str, file: &Path) -> Result<Vec<(String, String)>, ClientError> {
        self.call(&Call::PluginShadow { name: name.into(), file: file.into() })
    }

    /// Ends the new code beside a plugin.
    pub fn end_shadow(&mut self, name: &str) -> Result<(), ClientError> {
        self.call(&Call::PluginEndShadow { name: name.into() })
    }

    /// Lets the new code beside a plugin take over.
    pub fn promote(&mut self, name: &str) -> Result<Reloaded, ClientError> {
        self.call(&Call::PluginPromote { name: name.into() })
    }

    /// Begins to record what runs when, into a file at an absolute path. It is there after [`end_trace`](Client::end_trace).
    pub fn record_trace(&mut self, file: &Path) -> Result<(), ClientError> {
        self.call(&Call::TraceRecord { file: file.into() })
    }

    /// What this client has recorded so far.
    pub fn trace_progress(&mut self) -> Result<TraceEntry, ClientError> {
        self.call(&Call::TraceProgress {})
    }

    /// Ends the recording.
    pub fn end_trace(&mut self) -> Result<TraceEntry, ClientError> {
        self.call(&Call::TraceEnd {})
    }

    /// Sends a message, or only finds out whether it would be taken; what becomes of it.
    pub fn send(
        &mut self,
        url: &str,
        value: serde_json::Value,
        dry_run: bool,
    ) -> Result<String, ClientError> {
        self.call(&Call::MessageSend { url: url.into(), value, dry_run })
    }

    /// Stops all actuators until `reset` and `arm`.
    pub fn stop(&mut self, reason: &str) -> Result<(), ClientError> {
        self.call(&Call::Stop { reason: reason.into() })
    }

    /// Controls the playback of a recording, and says how it stands then.
    pub fn replay(&mut self, order: Order) -> Result<PlaybackStatus, ClientError> {
        self.call(&Call::Replay { order })
    }

    /// Takes the controls of an actuator, until this is dropped or gives them back.
    pub fn take_controls(&mut self, actuator: &str, who: &str) -> Result<ControlsEntry, ClientError> {
        self.call(&Call::ControlsTake { actuator: actuator.into(), who: who.into() })
    }

    /// Commands what it has the controls of, for a short while; the state of the gate.
    pub fn command(&mut self, command: serde_json::Value) -> Result<serde_json::Value, ClientError> {
        self.call(&Call::ControlsCommand { command })
    }

    /// Lets go at once, and keeps the controls; the state of the gate.
    pub fn release(&mut self) -> Result<serde_json::Value, ClientError> {
        self.call(&Call::ControlsRelease {})
    }

    /// Gives the controls back.
    pub fn leave_controls(&mut self) -> Result<(), ClientError> {
        self.call(&Call::ControlsLeave {})
    }

    /// The actuators, and who has the controls of each.
    pub fn controls(&mut self) -> Result<Vec<HolderEntry>, ClientError> {
        self.call(&Call::ControlsList {})
    }

    /// Ends a stop of the actuators; false when none was stopped.
    pub fn reset(&mut self) -> Result<bool, ClientError> {
        self.call(&Call::Reset {})
    }

    /// Lets commands through to the actuators, or to one.
    pub fn arm(&mut self, actuator: Option<&str>) -> Result<(), ClientError> {
        self.call(&Call::Arm { actuator: actuator.map(Into::into) })
    }

    /// The modules.
    pub fn modules(&mut self) -> Result<Vec<ModuleEntry>, ClientError> {
        self.call(&Call::ModuleList {})
    }

    /// Switches a module on or off.
    pub fn enable(&mut self, name: &str, on: bool) -> Result<Switched, ClientError> {
        let name = name.into();
        self.call(&if on { Call::ModuleEnable { name } } else { Call::ModuleDisable { name } })
    }

    /// The links.
    pub fn links(&mut self) -> Result<Vec<LinkEntry>, ClientError> {
        self.call(&Call::LinkList {})
    }

    /// The other agents that are known.
    pub fn peers(&mut self) -> Result<super::PeerList, ClientError> {
        self.call(&Call::Peers {})
    }

    /// Links an input, or only finds out whether that can be done; options are keys and values of the link's table.
    pub fn link(
        &mut self,
        to: &str,
        from: &str,
        options: &[(String, String)],
        dry_run: bool,
    ) -> Result<Vec<Changed>, ClientError> {
        self.call(&Call::Link { to: to.into(), from: from.into(), options: options.to_vec(), dry_run })
    }

    /// Takes the links of an input or inbox away, or only finds out whether that can be done.
    pub fn unlink(&mut self, to: &str, dry_run: bool) -> Result<Vec<Changed>, ClientError> {
        self.unlink_from(to, None, dry_run)
    }

    /// Takes the link between a destination and a source away, or all of the destination.
    pub fn unlink_from(
        &mut self,
        to: &str,
        from: Option<&str>,
        dry_run: bool,
    ) -> Result<Vec<Changed>, ClientError> {
        self.call(&Call::Unlink { to: to.into(), from: from.map(Into::into), dry_run })
    }

    /// The settings at a path and below it; an empty path is everything.
    pub fn settings(&mut self, path: &str) -> Result<Vec<SettingEntry>, ClientError> {
        self.call(&Call::ConfigGet { path: path.into() })
    }

    /// Makes changes, all or none; each a path and a value as `--set` takes them.
    pub fn set(&mut self, changes: &[(String, String)]) -> Result<Vec<Changed>, ClientError> {
        self.call(&Call::ConfigSet { changes: changes.to_vec(), dry_run: false })
    }

    /// Takes back what was changed at run time and not saved, at a path and below it; an empty path is all of it.
    pub fn revert(&mut self, path: &str) -> Result<Vec<Changed>, ClientError> {
        self.call(&Call::ConfigRevert { path: path.into() })
    }

    /// What holds and is not what the files say.
    pub fn differences(&mut self) -> Result<Vec<Different>, ClientError> {
        self.call(&Call::ConfigDiff {})
    }

    /// What is wrong with files that were edited and are refused.
    pub fn refused_edit(&mut self) -> Result<Option<Refusal>, ClientError> {
        self.call(&Call::ConfigRefused {})
    }

    /// Writes what was changed at run time into the files.
    pub fn save(&mut self, to: SaveTo) -> Result<Saved, ClientError> {
        self.call(&Call::ConfigSave { to, dry_run: false })
    }

    /// The properties that a pattern such as `/**/timing` is of; all without one.
    pub fn properties(&mut self, pattern: Option<&str>) -> Result<Vec<PropertyEntry>, ClientError> {
        self.call(&Call::PropertyList { pattern: pattern.map(Into::into) })
    }

    /// Takes a snapshot, into a file at an absolute path.
    pub fn save_snapshot(&mut self, file: &Path) -> Result<SnapshotEntry, ClientError> {
        self.call(&Call::SnapshotSave { file: file.into() })
    }

    /// Lets the agent go on from the snapshot at an absolute path.
    pub fn load_snapshot(&mut self, file: &Path) -> Result<SnapshotEntry, ClientError> {
        self.call(&Call::SnapshotLoad { file: file.into() })
    }

    /// Writes the newest values of another agent's properties, such as `slate://robot/**`, into a file at an absolute path.
    pub fn save_remote(&mut self, url: &str, file: &Path) -> Result<RemoteSnapshotEntry, ClientError> {
        self.call(&Call::SnapshotRemote { url: url.into(), file: file.into() })
    }

    /// Begins to record into a file at an absolute path, which is not there yet: properties such as `/r2/**`, all without
    /// any, at most so many values a second of each, or only those that change.
    pub fn start_recording(
        &mut self,
        file: &Path,
        (select, exclude): (&[String], &[String]),
        rate: Option<f64>,
        on_change: bool,
    ) -> Result<(), ClientError> {
        let (select, exclude) = (select.to_vec(), exclude.to_vec());
        self.call(&Call::RecordStart { file: file.into(), select, exclude, rate, on_change })
    }

    /// Ends the recording into the file at an absolute path, or the only one.
    pub fn stop_recording(&mut self, file: Option<&Path>) -> Result<RecordingEntry, ClientError> {
        self.call(&Call::RecordStop { file: file.map(Into::into) })
    }

    /// What is recorded.
    pub fn recordings(&mut self) -> Result<RecordingStatus, ClientError> {
        self.call(&Call::RecordStatus {})
    }

    /// Saves the last seconds into a file at an absolute path, which is not there yet.
    pub fn save_flight(&mut self, file: &Path) -> Result<SavedFlight, ClientError> {
        self.call(&Call::RecordSnapshot { file: file.into() })
    }

    /// The newest value of a property or a field; nothing before the first write.
    pub fn read(&mut self, url: &str) -> Result<Option<Reading>, ClientError> {
        self.call(&Call::Read { url: url.into() })
    }

    /// The values that came since they were looked at last; the first one is waited for, 50 s at most.
    pub fn watch(&mut self, of: &[Watched], within: Duration) -> Result<Vec<News>, ClientError> {
        self.call(&Call::Watch { of: of.to_vec(), within: millis(within) })
    }

    /// How often values of properties come in that time, 50 s at most.
    pub fn measure(&mut self, urls: &[String], time: Duration) -> Result<Vec<Measured>, ClientError> {
        self.call(&Call::Measure { urls: urls.to_vec(), time: millis(time) })
    }

    /// Sets a parameter, an input without a link, or a field of one, or whether a module is on.
    pub fn set_property(&mut self, url: &str, value: serde_json::Value) -> Result<SetProperty, ClientError> {
        self.call(&Call::PropertySet { url: url.into(), value })
    }

    /// All values that a property keeps, or a field of them, the oldest first: of a queue the last ones.
    pub fn history(&mut self, url: &str) -> Result<Vec<Reading>, ClientError> {
        self.call(&Call::ReadHistory { url: url.into() })
    }
}
