//! Start options of an agent.

use std::path::PathBuf;
use std::sync::Arc;

use slate_safety::StopLatch;

use crate::playback::Playback;
use crate::recording::Recording;
use crate::sharing::Sharing;
use slate_engine::clock::{Calendar, TimeSource};
use slate_engine::log::LogTarget;
use slate_engine::main_loop::Rate;

/// Execution mode of the modules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// All on the main loop, stage by stage; in lockstep under a time source.
    Staged,
    /// Threads of their own for modules that wait for something or have a period.
    Threaded,
}

/// Start options of an agent.
pub struct Options {
    /// Execution mode of the modules.
    pub mode: Mode,
    /// Rate of virtual time.
    pub rate: Rate,
    /// Number of threads that help the main loop with independent modules.
    pub workers: usize,
    /// True to use the workers even where it does not pay; the result is the same.
    pub always_help: bool,
    /// Log targets beside those of the configuration.
    pub log: Vec<Box<dyn LogTarget>>,
    /// True to arm the actuators at the start, as robots in the simulator do.
    pub armed: bool,
    /// Stop latch that all gates obey.
    pub stop: StopLatch,
    /// Time source that sets the agent's time.
    /// It replaces the module that the configuration names as its time source, or works beside it.
    pub time_source: Option<Box<dyn TimeSource>>,
    /// Calendar for the date in logs; `None` for the system's.
    pub calendar: Option<Calendar>,
    /// Program that runs isolated modules; `None` for this program.
    /// Its `main` calls [`isolation::enter`](slate_engine::isolation::enter) first, with the same plugins.
    pub isolation_program: Option<PathBuf>,
    /// File with the known state of all libraries that were loaded.
    /// A library that has changed since is reported before it is opened, and a damaged one is refused. The file is
    /// created when needed.
    pub known_libraries: Option<PathBuf>,
    /// True if [`Agent::remember`](crate::Agent::remember) writes the memories.
    /// Their files are locked against other runs until then.
    pub keeps_memory: bool,
    /// True if edited configuration files are read again.
    /// It takes effect when the agent is loaded with a database.
    pub follows_files: bool,
    /// Transport of values between agents, if links or `[share]` need it.
    pub sharing: Option<Box<dyn Sharing>>,
    /// Recorder of the agent.
    pub recording: Option<Arc<dyn Recording>>,
    /// Player of a recording in the agent; it then sets the time.
    pub playback: Option<Box<dyn Playback>>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            mode: Mode::Staged,
            rate: Rate::REALTIME,
            workers: 0,
            always_help: false,
            log: Vec::new(),
            armed: false,
            stop: StopLatch::in_memory(),
            time_source: None,
            calendar: None,
            isolation_program: None,
            known_libraries: None,
            keeps_memory: false,
            follows_files: true,
            sharing: None,
            recording: None,
            playback: None,
        }
    }
}

impl std::fmt::Debug for Options {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Options").field("mode", &self.mode).field("rate", &self.rate).finish_non_exhaustive()
    }
}
