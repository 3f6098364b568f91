//! Records an agent into an MCAP file.

mod channels;
mod file;
mod line;
mod lines;
mod log;
mod messages;
mod run;
mod state;
mod thread;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_blackboard::channel::Tap;
use slate_blackboard::{Property, Taps};
use slate_module::Level;
use slate_runtime::Agent;
use slate_runtime::configuration::Record;
use slate_runtime::log::LogTarget;
use slate_runtime::recording::{Change, Recording};

pub(crate) use channels::Channel;
pub(crate) use lines::{Drain, Hub, Sink};
pub(crate) use messages::{CHANGE, DROPPED, read_change};
pub(crate) use run::CONFIGURATION;
pub use state::RecordState;

use file::File;
use state::Shown;
use thread::Thread;

/// Records an agent: every value that is written to the properties that are selected, the log, what is changed from
/// outside, and what is needed to make the same run again.
///
/// An agent is loaded with it ([`Options::recording`](slate_runtime::Options::recording), and
/// [`log_target`](Recorder::log_target) among its log targets), so that nothing is missed; then
/// [`begin`](Recorder::begin) opens the file, and [`end`](Recorder::end) closes it after the run.
///
/// Values are handed over in memory that each writing thread has for this, without a lock and without an allocation; a
/// thread of the recorder encodes and writes. In lockstep whoever writes waits while that memory is full, so nothing is
/// missing. On the wall clock nobody waits: what does not fit is dropped, and the drops are counted in the file.
#[derive(Clone)]
pub struct Recorder {
    hub: Arc<Hub>,
    state: Arc<Mutex<State>>,
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder").finish_non_exhaustive()
    }
}

struct State {
    settings: Record,
    thread: Option<Thread>,
    /// Why it has not begun.
    failure: Option<RecordError>,
}

/// Why nothing is recorded.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file could not be made, or not be written to its end; what it had until then is there.
    #[error("the recording {} has not all of the run: {reason}", slate_runtime::printable(path))]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// It has not begun, or has ended already.
    #[error("a recording that has not begun can't end")]
    Order,
}

/// What a recording has.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// The file.
    pub file: PathBuf,
    /// How many values are in it.
    pub values: u64,
    /// How many are not, as nobody may wait for a slow disk.
    pub dropped: u64,
    /// Bytes of the file.
    pub bytes: u64,
}

impl Recorder {
    /// A recorder with the settings of a configuration; it records nothing before an agent is loaded with it.
    pub fn new(settings: &Record) -> Self {
        let state = State { settings: settings.clone(), thread: None, failure: None };
        Self { hub: Hub::new(settings), state: Arc::new(Mutex::new(state)) }
    }

    /// What an agent gets among its log targets, so that the log is in the file.
    pub fn log_target(&self) -> Box<dyn LogTarget> {
        Box::new(log::Lines::new(&self.hub))
    }

    /// Opens the file for an agent that was loaded with this recorder. What it wrote until now goes into it too.
    ///
    /// An agent does not stand still because it can't be recorded: its log says so, and [`end`](Recorder::end).
    pub fn begin(&self, agent: &Agent, path: &Path) {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let file = folder.map_or(Ok(()), std::fs::create_dir_all).and_then(|()| std::fs::File::create(path));
        match file {
            Ok(file) => self.begin_with(agent, path, Box::new(file)),
            Err(error) => self.fail(agent, path, error.to_string()),
        }
    }

    /// As [`begin`](Recorder::begin), into something else than a file; `path` is what messages call it.
    pub fn begin_with(&self, agent: &Agent, path: &Path, writer: Box<dyn Write + Send>) {
        let mut state = self.state();
        if state.thread.is_some() {
            return;
        }
        let begun = File::create(writer, &state.settings, agent).and_then(|file| {
            Thread::start(&self.hub, file, agent, path, state.settings.within)
                .map_err(|error| error.to_string())
        });
        match begun {
            Ok(thread) => {
                if let Some(reader) = thread.handle() {
                    self.hub.begin(agent.is_lockstep(), reader);
                }
                state.thread = Some(thread);
            }
            Err(reason) => {
                drop(state);
                self.fail(agent, path, reason);
            }
        }
    }

    fn fail(&self, agent: &Agent, path: &Path, reason: String) {
        self.hub.stop();
        let error = RecordError::Write { path: path.to_owned(), reason };
        agent.logger().log(agent.now(), Level::Error, &error.to_string());
        if let Some(mut shown) = Shown::new(agent.board()) {
            shown.write(false, 0, 0, 0, agent.now());
        }
        self.state().failure = Some(error);
    }

    /// Closes the file after a run of the agent.
    ///
    /// # Errors
    /// When something of it could not be written.
    pub fn end(&self, agent: &mut Agent) -> Result<Recorded, RecordError> {
        self.hub.stop();
        let mut state = self.state();
        if let Some(failure) = state.failure.take() {
            return Err(failure);
        }
        let thread = state.thread.take().ok_or(RecordError::Order)?;
        thread.end(agent)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Taps for Recorder {
    fn tap(&self, property: &Property) -> Option<Arc<dyn Tap>> {
        self.hub.tap(property)
    }
}

impl Recording for Recorder {
    fn changed(&self, cycle: u64, time: u64, change: &Change) {
        self.hub.push_whole(messages::CHANGE.id, time, &messages::change(cycle, change));
        self.hub.hurry();
    }
}
