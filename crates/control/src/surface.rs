//! State of an agent that all requests share.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use serde_json::Value as Json;
use slate_blackboard::{Board, Pattern};
use slate_module::Level;
use slate_ros_messages::Followed;
use slate_runtime::log::Logger;
use slate_runtime::{Agent, ExternalPorts};

use crate::agent::AgentControl;
use crate::changes::ChangeTurns;
use crate::lease::{Leases, random_name};
use crate::repeats::RepeatFilter;

/// File that a browser gets without a token, such as a page and its resources.
#[derive(Clone, Debug)]
pub struct Page {
    /// URL path, such as `/` or `/panels/map.js`.
    pub path: String,
    /// Media type, such as `text/javascript; charset=utf-8`.
    pub kind: String,
    /// Content.
    pub content: Vec<u8>,
}

/// Document of the program beyond the blackboard, such as a simulator's world.
#[derive(Clone)]
pub struct Document {
    /// Name, at `/api/v1/documents/NAME`.
    pub name: String,
    /// Returns the current content. It is called in a thread of the console.
    pub read: Arc<dyn Fn() -> Json + Send + Sync>,
}

impl std::fmt::Debug for Document {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Document").field("name", &self.name).finish_non_exhaustive()
    }
}

/// Control surface of an agent: all that tools can read and change.
///
/// Socket and console share it, so that one change is made at a time, and a lease is the same on both.
pub struct ControlSurface {
    /// Agent.
    pub agent: AgentControl,
    /// Log.
    pub logger: Arc<Logger>,
    /// Lockstep mode of the agent.
    pub is_lockstep: bool,
    /// Robots that the configuration names.
    pub robots: Vec<Followed>,
    /// Tells one run from another.
    pub session: String,
    /// Documents of the program beside the blackboard.
    documents: Mutex<Vec<Document>>,
    /// Parameters that an operator may set.
    operable: Mutex<Vec<Pattern>>,
    /// Controls that are had over plain requests.
    pub(crate) leases: Leases,
    /// Turns of changes.
    pub(crate) changes: Arc<ChangeTurns>,
    /// Requests that were logged a moment ago.
    pub(crate) repeats: RepeatFilter,
    /// Held during a change under a condition.
    condition: Mutex<()>,
    /// End of the run, once it is over.
    run_end: OnceLock<String>,
}

impl std::fmt::Debug for ControlSurface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ControlSurface").field("agent", &self.name()).finish_non_exhaustive()
    }
}

impl ControlSurface {
    /// Creates the control surface of an agent, which has one.
    ///
    /// # Errors
    /// When the system has no random numbers.
    pub fn new(agent: &Agent) -> std::io::Result<Self> {
        Ok(Self {
            operable: Mutex::new(operable(agent)),
            session: random_name()?,
            robots: Followed::of(&agent.configuration()),
            agent: AgentControl::new(agent),
            logger: Arc::clone(agent.logger()),
            is_lockstep: agent.is_lockstep(),
            documents: Mutex::default(),
            leases: Leases::default(),
            changes: Arc::default(),
            repeats: RepeatFilter::default(),
            condition: Mutex::default(),
            run_end: OnceLock::new(),
        })
    }

    /// Adds documents of the program; a document replaces one of the same name.
    pub fn add_documents(&self, documents: impl IntoIterator<Item = Document>) {
        let mut known = locked(&self.documents);
        for document in documents {
            known.retain(|other| other.name != document.name);
            known.push(document);
        }
    }

    /// Returns the documents of the program.
    pub fn documents(&self) -> Vec<Document> {
        locked(&self.documents).clone()
    }

    /// Lets operators set these parameters, and no others.
    pub fn allow_operators(&self, parameters: Vec<Pattern>) {
        *locked(&self.operable) = parameters;
    }

    /// Ends leases that were not renewed.
    /// It must be called periodically, [`LEASE_CHECK_PERIOD`](crate::LEASE_CHECK_PERIOD) apart.
    pub fn end_old_leases(&self) {
        self.leases.end_old();
    }

    /// Announces that the run is over, and how it ended; only the first call counts.
    /// From then on, operations that need a running main loop are refused.
    pub fn announce_end(&self, how: &str) {
        // A run ends once.
        let _ = self.run_end.set(how.to_owned());
    }

    /// Returns how the run ended; none while it runs.
    pub fn run_end(&self) -> Option<&str> {
        self.run_end.get().map(String::as_str)
    }

    /// Returns the blackboard.
    pub fn board(&self) -> &Arc<Board> {
        self.agent.composer().board()
    }

    /// Returns whether a property is a command before its gate.
    /// No other program may have such a command.
    pub fn is_ungated(&self, path: &str) -> bool {
        self.agent.composer().output_refusal(path).is_some()
    }

    /// Returns the name of the agent.
    pub fn name(&self) -> &str {
        self.board().agent()
    }

    /// Returns whether an operator may set the named parts of a setting.
    /// These are the fields of the value if it has some, otherwise the whole at the path.
    pub fn is_operable(&self, path: &str, value: &Json) -> bool {
        let operable = locked(&self.operable);
        let is_named = |path: &str| operable.iter().any(|pattern| pattern.matches(path));
        match value.as_object().filter(|fields| !fields.is_empty()) {
            Some(fields) => fields.keys().all(|name| is_named(&format!("{path}/{name}"))),
            None => is_named(path),
        }
    }

    /// Returns the time of the agent, ns.
    pub fn now(&self) -> u64 {
        self.agent.composer().now()
    }

    /// Writes a line into the log.
    pub fn log(&self, level: Level, text: &str) {
        self.logger.log(self.now(), level, text);
    }

    /// Locks the right to change something under a condition, for one at a time.
    pub fn turn(&self) -> MutexGuard<'_, ()> {
        locked(&self.condition)
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the parameters that the configuration lets operators set.
/// The reader of the console's table reports errors in it.
fn operable(agent: &Agent) -> Vec<Pattern> {
    let configuration = agent.configuration();
    let list = configuration.value("console.operable").and_then(|value| value.as_list());
    let texts = list.unwrap_or_default().iter().filter_map(|item| item.as_str());
    texts.filter_map(|text| Pattern::parse(text).ok()).collect()
}
