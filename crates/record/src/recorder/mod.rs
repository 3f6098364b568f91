//! Records an agent into an MCAP file.

mod channels;
mod control;
mod disk;
mod file;
mod flight;
mod flight_preface;
mod host;
mod hub;
mod lock;
mod log;
mod messages;
mod recording_file;
mod ring;
mod run;
mod save;
mod selection;
mod state;
mod target;
mod thread;
mod trigger;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use slate_blackboard::channel::Tap;
use slate_blackboard::{Property, Taps};
use slate_module::Level;
use slate_runtime::Agent;
use slate_runtime::configuration::Record;
use slate_runtime::log::LogTarget;
use slate_runtime::recording::{Change, Recording, RecordingControl};

pub use channels::{Channel, repeats};
use hub::ChannelFilter;
pub use hub::{Drain, Hub, Sink};
pub use messages::{CHANGE_TOPIC, DROPPED_TOPIC, TOPICS, read_change};
pub use run::CONFIGURATION;
pub use selection::{UnmatchedPattern, unmatched_patterns};
pub use selection::{selects, thins};
pub use state::RecordState;

use file::{File, Limits};
use host::{AgentContent, Host};
use lock::lock;
use recording_file::RecordingFile;
use save::Saves;
use state::RecordStateOutput;
use target::{ActiveRecording, Progress};
use thread::{Thread, ThreadHandle, ThreadSetup};
use trigger::Triggers;

/// Recorder of an agent.
/// It records every value of the selected properties, the log, changes from outside, and everything needed to repeat
/// the run. Tools begin and end further recordings while it runs, and the last seconds are kept in memory, to be saved
/// after an event.
///
/// An agent is loaded with it ([`Options::recording`](slate_runtime::Options::recording), and
/// [`log_target`](Recorder::log_target) among its log targets), so that nothing is missed; then
/// [`begin`](Recorder::begin) opens the file, and [`end`](Recorder::end) closes it after the run.
///
/// Each writing thread hands values over in a ring of its own, without a lock and without an allocation; a thread of the
/// recorder encodes and writes. In lockstep a writing thread waits while its ring is full, so no value is missing. On the
/// wall clock no thread waits: values that do not fit are dropped, and the drops are counted in the file.
#[derive(Clone)]
pub struct Recorder {
    hub: Arc<Hub>,
    state: Arc<Mutex<RecorderState>>,
    changes: Arc<ReportedChanges>,
}

/// Changes that were reported to the recorder.
#[derive(Default)]
struct ReportedChanges {
    /// Number of the last changes that were made at once, among all.
    next: AtomicU64,
    /// Number of them that were handed over.
    count: AtomicU64,
    /// Number of them in the hands of the system, or given up.
    settled: Mutex<u64>,
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder").finish_non_exhaustive()
    }
}

/// Numbers of recordings: of the configuration, of the last seconds, and of tools.
/// Those of tools count from there on.
const MAIN_RECORDING: u64 = 0;
const FLIGHT_RECORDING: u64 = 1;
const TOOL_RECORDINGS: u64 = 2;

struct RecorderState {
    settings: Record,
    /// Files attached to each recording beside the configuration: names and content.
    files: Vec<(String, Vec<u8>)>,
    /// Content of the agent before any change, until the recording has begun.
    content: Option<Arc<AgentContent>>,
    /// Recorded agent, once the recording has begun.
    host: Option<Arc<Host>>,
    thread: Option<Thread>,
    saves: Option<Arc<Saves>>,
    /// Number of recordings that tools have begun.
    count: u64,
    /// The published state, until the thread has it.
    shown: Option<RecordStateOutput>,
    /// New place of an earlier recording with the name of the first one.
    earlier: Option<PathBuf>,
    /// First recording, while it is active.
    first: Option<Arc<Progress>>,
    /// Result of the first recording, if it is known before the end.
    outcome: Option<Result<Recorded, RecordError>>,
}

/// Error of a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file could not be created, or not be written to its end.
    /// Its content until then is there.
    #[error("the recording {} is incomplete: {reason}", slate_runtime::printable(path))]
    Write {
        /// The file.
        path: PathBuf,
        /// Reason.
        reason: String,
    },
    /// The recording has not begun, or has ended already.
    #[error("a recording that has not begun can't end")]
    ThreadRequest,
}

/// Result of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// The file.
    pub file: PathBuf,
    /// Number of values in it.
    pub values: u64,
    /// Number of values missing, as the agent does not wait for a slow disk.
    pub dropped: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// New place of an earlier recording with the file's name.
    pub earlier: Option<PathBuf>,
}

/// Returns the values of the last seconds in memory.
fn flight_filter(settings: &Record) -> ChannelFilter {
    let (selection, triggers) = (settings.selection.clone(), settings.flight.triggers.clone());
    let largest = usize::try_from(settings.flight.largest).unwrap_or(usize::MAX);
    Box::new(move |channel| {
        let is_kept = channel.largest <= largest && selection::selects(&selection, &channel.path);
        is_kept || Triggers::uses_channel(&triggers, channel)
    })
}

impl Recorder {
    /// Creates a recorder with the settings of a configuration.
    /// It records from the load of an agent on.
    pub fn new(settings: &Record) -> Self {
        let recorder = Self::on_demand(settings);
        recorder.enable_main_recording();
        recorder
    }

    /// Creates a recorder as [`new`](Recorder::new), by default without a recording.
    /// It has one only if the settings say so; for [`attach`](Recorder::attach).
    pub fn on_demand(settings: &Record) -> Self {
        let hub = Hub::new(settings.buffer);
        if settings.flight.enabled {
            hub.add_light_recording(FLIGHT_RECORDING, flight_filter(settings));
        }
        let state = RecorderState {
            settings: settings.clone(),
            files: Vec::new(),
            content: None,
            host: None,
            thread: None,
            saves: None,
            count: 0,
            shown: None,
            earlier: None,
            first: None,
            outcome: None,
        };
        let recorder = Self { hub, state: Arc::new(Mutex::new(state)), changes: Arc::default() };
        if settings.enabled {
            recorder.enable_main_recording();
        }
        recorder
    }

    fn enable_main_recording(&self) {
        let selection = self.state().settings.selection.clone();
        self.hub.add_recording(
            MAIN_RECORDING,
            Box::new(move |channel| selection::selects(&selection, &channel.path)),
        );
    }

    /// Returns the log target that writes the log into the recording.
    pub fn log_target(&self) -> Box<dyn LogTarget> {
        Box::new(log::Lines::new(&self.hub))
    }

    /// Attaches files to each recording, besides the configuration that names them.
    /// Called before the recording begins.
    pub fn attach_files(&self, files: Vec<(String, Vec<u8>)>) {
        self.state().files = files;
    }

    /// Notes what the agent is made of, before tools reach it and change it.
    /// The recording then begins with that, and has those changes as well. Without it, it begins with what the agent is
    /// made of when it [begins](Self::begin).
    pub fn note_content(&self, agent: &Agent) {
        self.state().content = Some(Arc::new(AgentContent::of(&agent.composer())));
    }

    /// Returns what the agent is made of at the beginning.
    fn first_content(&self, agent: &Agent) -> Arc<AgentContent> {
        let noted = self.state().content.clone();
        noted.unwrap_or_else(|| Arc::new(AgentContent::of(&agent.composer())))
    }

    /// Returns the agent in the form that recordings use.
    fn host(&self, agent: &Agent) -> Host {
        Host::of(agent, self.state().files.clone())
    }

    /// Records an agent as its configuration says, and as tools request.
    /// The agent was loaded with this recorder. Recordings without a file of their own go into that folder.
    pub fn attach(&self, agent: &Agent, folder: &Path) {
        let settings = self.state().settings.clone();
        if settings.enabled {
            let file = settings.file.map_or_else(|| folder.join("run.mcap"), |file| file.value);
            self.begin_in(agent, &file, folder);
        } else {
            self.launch(agent, self.host(agent), folder, Vec::new());
        }
    }

    /// Opens the file for an agent that was loaded with this recorder.
    /// Values written until now go into it, too. An existing recording of that name gets a number, such as
    /// `run-1.mcap`; while another run still writes it, this one gets the number.
    ///
    /// An agent runs even if it can't be recorded: its log says so, and [`end`](Recorder::end).
    pub fn begin(&self, agent: &Agent, path: &Path) {
        self.begin_in(agent, path, path.parent().unwrap_or(Path::new("")));
    }

    fn begin_in(&self, agent: &Agent, path: &Path, folder: &Path) {
        let own = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let place = own.map_or(Ok(()), std::fs::create_dir_all).and_then(|()| RecordingFile::open(path));
        match place {
            Ok(place) => {
                if place.path != path {
                    let [path, own] = [path, &place.path].map(slate_runtime::printable);
                    let text = format!("another run records into {path}, so this one does into {own}");
                    agent.logger().log(agent.now(), Level::Warn, &text);
                }
                self.state().earlier = place.earlier;
                self.begin_into(agent, &place.path, folder, Box::new(place.file));
            }
            Err(error) => self.fail(agent, path, folder, error.to_string()),
        }
    }

    /// Begins as [`begin`](Recorder::begin), into a writer.
    /// `path` is its name in messages.
    pub fn begin_with(&self, agent: &Agent, path: &Path, writer: Box<dyn Write + Send>) {
        self.begin_into(agent, path, path.parent().unwrap_or(Path::new("")), writer);
    }

    fn begin_into(&self, agent: &Agent, path: &Path, folder: &Path, writer: Box<dyn Write + Send>) {
        let settings = self.state().settings.clone();
        let is_whole = selection::is_whole(&settings.selection);
        let host = self.host(agent);
        let recording_header =
            host.recording_header(&self.first_content(agent), agent.board(), is_whole, true);
        let limits = Limits { chunk: settings.chunk, buffer: settings.buffer };
        match File::create(writer, recording_header, limits) {
            Ok(file) => {
                let progress = Progress::new(MAIN_RECORDING, path, agent.now());
                self.state().first = Some(Arc::clone(&progress));
                let waits = host.is_lockstep;
                let target = ActiveRecording::new(file, settings.selection, settings.within, waits, progress);
                self.publish_state(agent.board());
                self.launch(agent, host, folder, vec![target]);
            }
            Err(reason) => {
                // A file without a beginning can't be repaired.
                if path.is_file() {
                    let _ = std::fs::remove_file(path);
                }
                self.fail(agent, path, folder, reason);
            }
        }
    }

    /// Starts the thread of the recorder.
    fn launch(&self, agent: &Agent, mut host: Host, folder: &Path, targets: Vec<ActiveRecording>) {
        let mut state = self.state();
        if state.thread.is_some() {
            return;
        }
        if state.settings.flight.enabled || !targets.is_empty() {
            for own in unmatched_patterns(&state.settings.selection, &**agent.board()) {
                agent.logger().log(agent.now(), Level::Warn, &format!("{own}: {}", own.help));
            }
        }
        let content = state.content.take();
        if state.settings.flight.enabled {
            let content = content.unwrap_or_else(|| Arc::new(AgentContent::of(&agent.composer())));
            host.began = Some((agent.now(), host.recording_header(&content, agent.board(), false, false)));
        }
        let host = Arc::new(host);
        let limits = Limits { chunk: state.settings.chunk, buffer: state.settings.buffer };
        let saves = Saves::new(&host, folder, limits);
        let shared = Arc::<ThreadHandle>::default();
        *lock(&shared.recordings) = targets.iter().map(|target| Arc::clone(&target.progress)).collect();
        *lock(&shared.shown) = state.shown.take();
        let flight = state.settings.flight.clone();
        let (hub, own) = (Arc::clone(&self.hub), Arc::clone(&saves));
        let wants = flight_filter(&state.settings);
        let setup = ThreadSetup { hub, host: Arc::clone(&host), shared, targets, flight, wants, saves: own };
        match Thread::start(setup) {
            Ok(thread) => {
                if let Some(reader) = thread.handle() {
                    self.hub.begin(agent.is_lockstep(), reader);
                }
                (state.host, state.saves, state.thread) = (Some(host), Some(saves), Some(thread));
            }
            Err(error) => {
                self.hub.stop();
                let text = format!("nothing is recorded, as a thread can't be started: {error}");
                agent.logger().log(agent.now(), Level::Error, &text);
                if let Some(first) = state.first.take() {
                    let error = RecordError::Write { path: first.path.clone(), reason: error.to_string() };
                    state.outcome = Some(Err(error));
                }
            }
        }
    }

    /// Publishes the state from now on.
    fn publish_state(&self, board: &Arc<slate_blackboard::Board>) {
        let mut state = self.state();
        match &state.thread {
            None if state.shown.is_none() => state.shown = RecordStateOutput::new(board),
            Some(thread) if lock(&thread.shared.shown).is_none() => {
                *lock(&thread.shared.shown) = RecordStateOutput::new(board);
            }
            _ => {}
        }
    }

    fn fail(&self, agent: &Agent, path: &Path, folder: &Path, reason: String) {
        self.hub.remove_recording(MAIN_RECORDING);
        let error = RecordError::Write { path: path.to_owned(), reason };
        agent.logger().log(agent.now(), Level::Error, &error.to_string());
        self.publish_state(agent.board());
        {
            let mut state = self.state();
            if let Some(shown) = &mut state.shown {
                shown.write(false, &[], agent.now());
            }
            state.outcome = Some(Err(error));
        }
        self.launch(agent, self.host(agent), folder, Vec::new());
    }

    /// Closes the file after a run of the agent, and those of tools.
    ///
    /// # Errors
    /// When it could not be written completely, or was not begun.
    pub fn end(&self, agent: &mut Agent) -> Result<Recorded, RecordError> {
        self.finish(agent).unwrap_or(Err(RecordError::ThreadRequest))
    }

    /// Ends as [`end`](Recorder::end).
    /// `None` without a recording besides those of tools.
    pub fn finish(&self, agent: &mut Agent) -> Option<Result<Recorded, RecordError>> {
        let (thread, saves, first) = {
            let mut state = self.state();
            (state.thread.take(), state.saves.take(), state.first.take())
        };
        let channels = |hub: &Hub| hub.channels().clone();
        let mut outcome = None;
        if let Some(mut thread) = thread {
            let time = agent.now();
            let digest = agent.digest().map_or_else(|| "none".into(), |digest| format!("{digest:016x}"));
            let cycles = agent.composer().cycles().to_string();
            for mut target in thread.end() {
                let end = vec![("digest", digest.clone()), ("cycles", cycles.clone())];
                let ended = target.end(&channels(&self.hub), agent.board(), time, end);
                let path = target.progress.path.clone();
                let ended = ended.map_err(|reason| RecordError::Write { path, reason });
                match ended {
                    ended if target.number == MAIN_RECORDING => outcome = Some(ended),
                    Ok(recorded) => agent.logger().log(time, Level::Info, &control::summary_line(&recorded)),
                    Err(error) => agent.logger().log(time, Level::Error, &error.to_string()),
                }
            }
        }
        if let Some(saves) = saves {
            saves.wait();
        }
        let path = |first: &Progress| first.path.clone();
        let lost = |first: Arc<Progress>| {
            let reason = first.failure().unwrap_or_else(|| "it has ended before the run".into());
            Err(RecordError::Write { path: path(&first), reason })
        };
        let mut outcome = outcome.or_else(|| self.state().outcome.take()).or_else(|| first.map(lost));
        if let Some(Ok(recorded)) = &mut outcome {
            recorded.earlier = self.state().earlier.take();
        }
        outcome
    }

    fn state(&self) -> MutexGuard<'_, RecorderState> {
        lock(&self.state)
    }
}

impl Taps for Recorder {
    fn tap(&self, property: &Property) -> Option<Arc<dyn Tap>> {
        self.hub.tap(property)
    }
}

impl Recording for Recorder {
    fn changed(&self, cycle: u64, time: u64, changes: &[Change]) {
        // Several threads make changes, and only this number tells their order in the file.
        let sequence = self.changes.next.fetch_add(1, Ordering::Relaxed) + 1;
        for change in changes {
            let bytes = messages::change(cycle, change);
            self.hub.push_whole(messages::CHANGE_TOPIC.id, sequence, time, &bytes);
        }
        self.hub.request_write();
        self.changes.count.fetch_add(1, Ordering::Release);
    }

    fn settle(&self) {
        self.settle_changes();
    }

    fn control(&self) -> Option<&dyn RecordingControl> {
        Some(self)
    }
}
