//! How an agent is started.

use std::path::PathBuf;
use std::sync::Arc;

use slate_safety::StopLatch;

use crate::playback::Playback;
use crate::recording::Recording;
use crate::sharing::Sharing;
use slate_engine::clock::{Calendar, TimeSource};
use slate_engine::log::LogTarget;
use slate_engine::main_loop::Rate;

/// How the modules of an agent are run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// All on the main loop, stage by stage; in lockstep under a time source.
    Staged,
    /// Modules that wait for something or have a period get threads of their own.
    Threaded,
}

/// How an agent is started.
pub struct Options {
    /// How the modules are run.
    pub mode: Mode,
    /// How fast virtual time goes.
    pub rate: Rate,
    /// Threads that help the main loop with independent modules.
    pub workers: usize,
    /// Uses the workers also where it does not pay; the result is the same.
    pub always_help: bool,
    /// Where the log goes, beside the targets of the configuration.
    pub log: Vec<Box<dyn LogTarget>>,
    /// Arms the actuators at the start, as robots in the simulator do.
    pub armed: bool,
    /// The stop that all gates obey.
    pub stop: StopLatch,
    /// Sets the agent's time, in place of a module that the configuration names as its time source, or beside it.
    pub time_source: Option<Box<dyn TimeSource>>,
    /// Says the date, for logs; the system's if there is none.
    pub calendar: Option<Calendar>,
    /// What is started to run isolated modules: a program whose `main` calls [`isolation::enter`](slate_engine::isolation::enter)
    /// first, with the same plugins. Nothing for this program.
    pub isolation_program: Option<PathBuf>,
    /// A file in which libraries are known as they were when they were loaded last: one that has changed since is told of
    /// before it is opened, and one that is damaged is refused. Made when it is needed.
    pub known_libraries: Option<PathBuf>,
    /// Whether [`Agent::remember`](crate::Agent::remember) is to write what modules remember; their files are kept from other runs until then.
    pub keeps_memory: bool,
    /// Whether files of the configuration that are edited are taken over, when the agent is loaded with a database.
    pub follows_files: bool,
    /// What carries values to other agents and from them, if links or `[share]` want that.
    pub sharing: Option<Box<dyn Sharing>>,
    /// What records the agent.
    pub recording: Option<Arc<dyn Recording>>,
    /// What plays a recording in it: the time is as that says.
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
