//! Agent: one process with one blackboard and a name.

mod actuators;
mod assembly;
mod build;
mod composer;
mod composition;
mod external;
mod handle;
mod links;
mod loading;
mod logging;
mod looping;
mod memories;
mod modules;
mod options;
mod playing;
mod plugins;
mod remote_links;
mod remotes;
mod requests;
mod running;
mod settings;
mod snapshot;
mod start_check;
mod teleoperation;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use slate_blackboard::Board;

use crate::aspects::ThreadRegistry;
use crate::memory::MemoryError;
use crate::snapshot::{Snapshot, SnapshotError};
use actuators::GateOperator;
pub use composer::{Composer, WeakComposer};
pub use external::{CycleEnd, ExternalContent, ExternalValue, ValueWait};
use handle::AgentHandle;
pub use handle::{ModuleStatus, PluginStatus};
pub use links::{LinkStatus, NewLink, RemoteEnd};
pub use loading::{StartError, catalogue};
pub use looping::SystemClock;
use memories::Memories;
pub use options::{Mode, Options};
pub use plugins::{Loaded, PluginError, Reload};
use remote_links::RemoteLinks;
pub use running::Stopper;
use settings::FollowedSettings;
use slate_configuration::{Configuration, Database};
use slate_engine::log::Logger;
use slate_engine::main_loop::End;
use snapshot::SnapshotRestorer;
pub use start_check::check_start;
pub use teleoperation::{CommandError, ControlsError, ControlsHolder, Teleoperation};

/// Loaded agent, ready to run.
pub struct Agent {
    handle: AgentHandle,
    hang: Duration,
    threads: Arc<ThreadRegistry>,
    /// Memories of the modules.
    memories: Memories,
    /// Settings that follow the database while the agent runs.
    settings: Option<FollowedSettings>,
}

impl std::fmt::Debug for Agent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Agent").field("name", &self.board().agent()).finish_non_exhaustive()
    }
}

impl Agent {
    /// Database of the configuration; `None` if the agent was loaded without one.
    pub fn database(&self) -> Option<&Database> {
        self.settings.as_ref().map(|settings| &settings.database)
    }

    /// Present configuration: the loaded one with all changes since.
    pub fn configuration(&self) -> Arc<Configuration> {
        Arc::clone(&self.handle.composition().configuration)
    }

    /// Returns true if the agent runs in lockstep.
    /// A time source then sets its time and all modules run on the loop, so the same configuration and seed give the
    /// same bytes.
    pub fn is_lockstep(&self) -> bool {
        self.handle.shared.lockstep
    }

    /// Returns true if the actuators are armed as soon as they exist.
    pub fn begins_armed(&self) -> bool {
        self.handle.composition().armed
    }

    /// Handle that changes the agent, also while it runs and from any thread.
    pub fn composer(&self) -> Composer {
        Composer { agent: self.handle.clone() }
    }

    /// The agent's board, with all properties.
    pub fn board(&self) -> &Arc<Board> {
        &self.handle.shared.board
    }

    /// Logger of the agent and its modules.
    pub fn logger(&self) -> &Arc<Logger> {
        &self.handle.shared.logger
    }

    /// The agent's time, nanoseconds.
    pub fn now(&self) -> u64 {
        self.handle.shared.clock.now()
    }

    /// Reads the agent's time from any thread, nanoseconds.
    pub fn clock(&self) -> impl Fn() -> u64 + Send + 'static {
        let clock = Arc::clone(&self.handle.shared.clock);
        move || clock.now()
    }

    /// The names of the modules.
    pub fn modules(&self) -> Vec<String> {
        self.handle.composition().assembly.modules.keys().cloned().collect()
    }

    /// Returns a module's counts of ticks, missed deadlines and panics.
    pub fn counts(&self, module: &str) -> Option<(u64, u64, u64)> {
        let composition = self.handle.composition();
        let cell = &composition.assembly.modules.get(module)?.cell;
        let load = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Some((cell.ticks(), load(&cell.health.misses), load(&cell.health.panics)))
    }

    /// Returns a digest of all values written in lockstep; `None` on the wall clock.
    pub fn digest(&mut self) -> Option<u64> {
        // SAFETY: `&mut self` says that no run is in progress in another thread, and jobs don't use the digest.
        unsafe { self.handle.shared.core() }.digest.as_ref().map(slate_engine::digest::Digest::value)
    }

    /// Stops all actuators until [`reset`](Agent::reset) and [`arm`](Agent::arm).
    pub fn stop_actuators(&self, reason: &str) {
        GateOperator::new(&self.handle).stop_actuators(reason);
    }

    /// Ends a stop of the actuators.
    pub fn reset(&self) {
        GateOperator::new(&self.handle).reset();
    }

    /// Arms all actuators; false if one is still stopped.
    pub fn arm(&self) -> bool {
        GateOperator::new(&self.handle).arm()
    }

    /// The modules with memories, each with the hash of its initial file, if any.
    /// Memories are inputs of the run, as the configuration is.
    pub fn memories(&self) -> impl Iterator<Item = (&str, Option<u64>)> {
        self.memories.begun()
    }

    /// Writes the modules' memories into the files of the configuration.
    /// Does so once, after the run, and only if the agent was made to [keep](Options::keeps_memory) them.
    ///
    /// # Errors
    /// When a module is busy or absent, or a file can't be written: the earlier file stays.
    pub fn remember(&mut self) -> Result<(), MemoryError> {
        self.memories.write(&self.handle)
    }

    /// Restores a snapshot, as [`Composer::restore`].
    /// The settings of the agent's database change to those of the snapshot.
    ///
    /// # Errors
    /// The mismatches; the agent is unchanged then.
    pub fn restore(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        SnapshotRestorer::new(&self.handle).restore(snapshot, self.database())
    }

    /// Restores a snapshot under the settings with which the agent was loaded.
    /// They replace the parameters, switches and values of inputs of the snapshot's configuration.
    ///
    /// # Errors
    /// The mismatches; the agent is unchanged then.
    pub fn restore_under_own_settings(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        SnapshotRestorer::new(&self.handle).restore_under_own_settings(snapshot)
    }
}

impl Drop for Agent {
    fn drop(&mut self) {
        self.handle.shared.run.finish(End::Stopped);
        RemoteLinks::new(&self.handle).end_sharing();
        self.threads.end();
        self.handle.shared.logger.flush(running::LAST_LINES);
    }
}
