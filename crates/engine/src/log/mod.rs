//! Logger with several targets and a level per module.
//!
//! A tick formats into memory of its own; a thread of the logger writes to the targets, so no module ever waits for a
//! terminal or a disk. In lockstep nothing is lost and lines stand in the order of the modules; on the wall clock a
//! full buffer drops lines and counts them, and a module that floods it leaves room for the others.
//!
//! The targets are set by the configuration (`[log.targets]`), by the application (when it loads an agent), or at run
//! time ([`Logger::add_target`]). The last lines are always on the blackboard, at `/log/tail`, and the numbers of
//! written, dropped and suppressed lines at `/log/counts`.

mod buffer;
mod record;
mod repeat;
mod source;
mod tail;
mod target;
mod thread;

use std::fmt;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use slate_blackboard::{Board, BoardError};
use slate_module::Level;
use slate_sorted::SortedMap;

use crate::background::set_batch_scheduling;
use crate::clock::Clock;

pub use record::Record;
pub use slate_composition::own::{LogCounts, LogLevel, LogLine};
pub use slate_configuration::Levels;
pub use source::ModuleLog;
pub use target::{
    ConsoleTarget, FileTarget, LogTarget, MemoryTarget, RemoteTarget, Rotation, SyslogAddress, SyslogTarget,
};

use buffer::{Sender, buffer};
use repeat::Repeats;
use source::{LogMessage, LogSource, MODULE_CAPACITY, SHARED_CAPACITY};
use tail::Tail;
use thread::Thread;

/// Settings of an agent's log.
#[derive(Clone, Debug)]
pub struct LogSettings {
    /// Log levels by module.
    pub levels: Levels,
    /// Maximum number of lines of one text that a module writes in a second.
    /// In the agent's time; the rest is summed up in one line. 0 for no limit.
    pub repeat: u64,
    /// True to wait for a full buffer rather than drop lines, and to keep their order.
    /// The order is then the same in every run.
    pub lockstep: bool,
    /// Number of modules with reserved places in the buffer.
    pub modules: usize,
}

/// Logger of an agent.
pub struct Logger {
    /// Log of the agent itself; `None` only at the end.
    agent: Option<ModuleLog>,
    thread: Option<JoinHandle<()>>,
    messages: Option<Sender<LogMessage>>,
    counts: Arc<Counts>,
    modules: Mutex<Modules>,
}

/// Lines so far.
#[derive(Default)]
struct Counts {
    sent: AtomicU64,
    written: AtomicU64,
    dropped: AtomicU64,
    /// Lines in the common part of the buffer.
    shared: AtomicU32,
}

/// Levels and sources of all modules; locked to change levels, never in a tick.
struct Modules {
    levels: Levels,
    sources: SortedMap<Arc<str>, Arc<LogSource>>,
}

impl fmt::Debug for Logger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Logger").field("levels", &self.modules().levels).finish_non_exhaustive()
    }
}

impl Logger {
    /// Returns a logger with those targets.
    ///
    /// # Errors
    /// When its thread can't be started.
    pub fn new(settings: LogSettings, targets: Vec<Box<dyn LogTarget>>) -> std::io::Result<Self> {
        let capacity = SHARED_CAPACITY as usize + MODULE_CAPACITY as usize * (settings.modules + 1);
        let (messages, receiver) = buffer(capacity);
        let counts = Arc::new(Counts::default());
        let repeats = Repeats::new(settings.repeat);
        let thread = Thread::new(targets, repeats, Arc::clone(&counts), settings.lockstep);
        let thread = std::thread::Builder::new().name("log".into()).spawn(move || {
            set_batch_scheduling();
            thread.run(&receiver);
        })?;
        let name = Arc::from("agent");
        let source = Arc::new(LogSource::new(&name, settings.levels.of(&name)));
        // The agent may log from any thread and about what is late, so it never waits.
        let agent = ModuleLog::new(messages.clone(), Arc::clone(&counts), Arc::clone(&source), false, None);
        Ok(Self {
            agent: Some(agent),
            thread: Some(thread),
            messages: Some(messages),
            counts,
            modules: Mutex::new(Modules {
                levels: settings.levels,
                sources: SortedMap::from([(name, source)]),
            }),
        })
    }

    /// Returns the level of a module.
    pub fn level(&self, module: &str) -> Level {
        self.modules().levels.of(module)
    }

    /// Changes the log level of a module and of all below its name.
    /// `r2` also sets `r2/planner`. Without a name, it sets all modules that no level names. Running modules follow
    /// with their next line.
    pub fn set_level(&self, module: Option<&str>, level: Level) {
        let mut modules = self.modules();
        modules.levels.set(module, level);
        modules.sources.values().for_each(|source| source.set_level(modules.levels.of(&source.name)));
    }

    /// Returns all levels.
    pub fn levels(&self) -> Levels {
        self.modules().levels.clone()
    }

    /// Changes all levels, as [`set_level`](Logger::set_level) does for some.
    pub fn set_levels(&self, levels: Levels) {
        let mut modules = self.modules();
        modules.sources.values().for_each(|source| source.set_level(levels.of(&source.name)));
        modules.levels = levels;
    }

    /// Adds a target, which gets all lines from now on.
    pub fn add_target(&self, target: Box<dyn LogTarget>) {
        self.send(LogMessage::Target(target));
    }

    /// Logs a line of the agent itself.
    /// It is dropped and counted if the targets are too slow.
    pub fn log(&self, time: u64, level: Level, text: &str) {
        if let Some(agent) = &self.agent {
            agent.write_at(time, level, text.as_bytes());
        }
    }

    /// Logs a line that a module wrote at that time in a run that is recorded.
    pub fn log_recorded(&self, module: &str, time: u64, level: Level, text: &str) {
        let Some(messages) = self.messages.clone() else { return };
        let name: Arc<str> = module.into();
        let mut modules = self.modules();
        let own = modules.levels.of(module);
        let source =
            modules.sources.entry(Arc::clone(&name)).or_insert_with(|| Arc::new(LogSource::new(&name, own)));
        let log = ModuleLog::new(messages, Arc::clone(&self.counts), Arc::clone(source), true, None);
        drop(modules);
        log.write_at(time, level, text.as_bytes());
    }

    /// Waits until the targets have all lines logged so far, at most `limit`.
    /// Repetitions and dropped lines are summed up.
    pub fn flush(&self, limit: Duration) {
        let Some(messages) = &self.messages else { return };
        let has_ended = || self.thread.as_ref().is_none_or(JoinHandle::is_finished);
        let mut waited = Duration::ZERO;
        let mut wait = || {
            std::thread::sleep(FLUSH_POLL_PERIOD);
            waited += FLUSH_POLL_PERIOD;
            waited < limit && !has_ended()
        };
        while messages.try_send(LogMessage::Flush).is_err() {
            if !wait() {
                return;
            }
        }
        let sent = self.counts.sent.fetch_add(1, Ordering::AcqRel) + 1;
        while self.counts.written.load(Ordering::Acquire) < sent && wait() {}
    }

    /// Returns the number of lines dropped because the targets were too slow.
    pub fn dropped(&self) -> u64 {
        self.counts.dropped.load(Ordering::Relaxed)
    }

    /// Returns the number of dropped lines of a module, or of `agent`.
    pub fn dropped_of(&self, module: &str) -> u64 {
        self.modules().sources.get(module).map_or(0, |source| source.dropped())
    }

    /// Publishes the last lines and the counts at `/log/tail` and `/log/counts`.
    ///
    /// # Errors
    /// When a module has a property of that name.
    pub fn publish_on(&self, board: &Board) -> Result<(), BoardError> {
        self.send(LogMessage::Tail(Box::new(Tail::new(board)?)));
        Ok(())
    }

    /// Returns the log of a module; its lines carry the time of `clock`.
    /// A `lossless` one waits for a full buffer rather than drop a line.
    pub fn module(&self, name: &Arc<str>, lossless: bool, clock: &Arc<Clock>) -> Option<Box<ModuleLog>> {
        let messages = self.messages.clone()?;
        let mut modules = self.modules();
        let level = modules.levels.of(name);
        // A module that is loaded again continues with the counts of the old one.
        let source =
            modules.sources.entry(Arc::clone(name)).or_insert_with(|| Arc::new(LogSource::new(name, level)));
        let source = Arc::clone(source);
        let clock = Some(Arc::clone(clock));
        Some(Box::new(ModuleLog::new(messages, Arc::clone(&self.counts), source, lossless, clock)))
    }

    fn send(&self, message: LogMessage) {
        if let Some(messages) = &self.messages
            && messages.send(message)
        {
            self.counts.sent.fetch_add(1, Ordering::Release);
        }
    }

    fn modules(&self) -> MutexGuard<'_, Modules> {
        self.modules.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Interval at which a flush checks for its end.
const FLUSH_POLL_PERIOD: Duration = Duration::from_micros(500);

impl Drop for Logger {
    fn drop(&mut self) {
        self.agent = None;
        self.messages = None;
        // Modules that hang keep a sender of their own, so the thread is not waited for if any is left.
        if let Some(thread) = self.thread.take()
            && Arc::strong_count(&self.counts) <= 2
        {
            // A target that panicked has lost its lines already.
            let _ = thread.join();
        }
    }
}
