//! Public interface for changes of a running agent.

mod configuration;
mod operation;
mod ports;

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use slate_blackboard::{Board, BoardError};
use slate_composition::ExternalInputError;
use slate_module::{Description, Level, Parameter, PortDescription};

use super::external::{CycleEnd, ExternalInputs, ExternalValue, ValueWait};
use super::handle::{AgentHandle, ModuleStatus, PluginStatus, WeakHandle};
use super::modules::ModuleAccess;
use super::plugins::{Loaded, PluginError, PluginLoader, Reload, Reloader, ShadowRunner};
use crate::recording::Recording;
use crate::sharing::AfterTick;

/// Handle that changes an agent, from any thread and while it runs.
/// It makes one change at a time.
#[derive(Clone)]
pub struct Composer {
    pub(super) agent: AgentHandle,
}

impl std::fmt::Debug for Composer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Composer").field("agent", &self.agent.board().agent()).finish_non_exhaustive()
    }
}

/// Composer that does not keep its agent alive.
#[derive(Clone, Default)]
pub struct WeakComposer {
    agent: WeakHandle,
}

impl std::fmt::Debug for WeakComposer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WeakComposer").finish_non_exhaustive()
    }
}

impl WeakComposer {
    /// Returns the composer, while the agent exists.
    pub fn upgrade(&self) -> Option<Composer> {
        self.agent.upgrade().map(|agent| Composer { agent })
    }
}

impl Composer {
    /// Returns a composer that does not keep the agent alive.
    pub fn downgrade(&self) -> WeakComposer {
        WeakComposer { agent: self.agent.downgrade() }
    }

    /// Loads a plugin, or a list of plugins, of the configuration.
    /// The plugins that it depends on are loaded too. The configuration's modules of its kinds begin; a kind without
    /// any gets a module of its name.
    ///
    /// # Errors
    /// The mismatches; nothing is loaded then.
    pub fn load(&self, name: &str) -> Result<Loaded, PluginError> {
        PluginLoader::new(&self.agent).load(name)
    }

    /// Loads a plugin's library, as [`load`](Composer::load) does.
    ///
    /// # Errors
    /// The mismatches; nothing is loaded then.
    pub fn load_library(&self, file: &Path) -> Result<Loaded, PluginError> {
        PluginLoader::new(&self.agent).load_library(file)
    }

    /// Unloads a plugin, or the plugins of a list in reverse order.
    /// Their modules end, their outputs take their safe values, and their last values stay where others read them.
    /// Returns the state of each library's memory.
    ///
    /// # Errors
    /// When another plugin depends on it, a module vetoes the unloading, or has not returned from its tick.
    pub fn unload(&self, name: &str) -> Result<Vec<(String, &'static str)>, PluginError> {
        PluginLoader::new(&self.agent).unload(name)
    }

    /// Exchanges the code of a plugin, with its present library or with `file`.
    /// The exchange takes place between two ticks. Each module's state is carried over if it fits the new code; else
    /// the module begins afresh. A shadow of the plugin ends.
    ///
    /// # Errors
    /// The mismatches; the old code stays then.
    pub fn reload(&self, name: &str, file: Option<&Path>) -> Result<Reload, PluginError> {
        Reloader::new(&self.agent).reload(name, file)
    }

    /// Runs a library's code as the shadow of a plugin.
    /// It begins with the modules' present states and makes the same steps on the same inputs in threads of its own;
    /// its outputs are compared and discarded. The result is at each module's `shadow`. Returns the modules.
    ///
    /// # Errors
    /// The mismatches, or when a module has other ports in the new code, or uses services, which would act. Nothing
    /// runs beside the plugin then.
    pub fn shadow(&self, name: &str, file: &Path) -> Result<Vec<String>, PluginError> {
        ShadowRunner::new(&self.agent).shadow(name, file)
    }

    /// Ends the shadow of a plugin; the old code stays.
    ///
    /// # Errors
    /// When the plugin has no shadow.
    pub fn end_shadow(&self, name: &str) -> Result<(), PluginError> {
        ShadowRunner::new(&self.agent).end_shadow(name)
    }

    /// Replaces a plugin's code by its shadow between two steps.
    /// The new code has the states that it has by then.
    ///
    /// # Errors
    /// When the plugin has no shadow, the shadow has panicked, lags behind or hangs, or a module does not return; the
    /// old code stays then.
    pub fn promote(&self, name: &str) -> Result<Reload, PluginError> {
        ShadowRunner::new(&self.agent).promote(name)
    }

    /// Switches a module on or off.
    ///
    /// # Errors
    /// When the module is unknown, or another module switches it.
    pub fn enable(&self, module: &str, on: bool) -> Result<(), BoardError> {
        ModuleAccess::new(&self.agent).enable(module, on)
    }

    /// Parameters of a module with their defaults and ranges; empty if it is unknown.
    /// During a change they are those from before it.
    pub fn parameters(&self, module: &str) -> Vec<Parameter> {
        self.agent.overview().parameters(module)
    }

    /// Documentation of a module's kind, and its description; `None` if unknown.
    /// During a change they are those from before it.
    pub fn documentation(&self, module: &str) -> Option<(String, Arc<Description>)> {
        self.agent.overview().documentation(module)
    }

    /// The port of a module at a path.
    pub fn port(&self, path: &str) -> Option<PortDescription> {
        self.agent.overview().port(path)
    }

    /// Lists the loaded plugins, and the unloaded ones of the configuration.
    /// During a change they are those from before it.
    pub fn plugins(&self) -> Vec<PluginStatus> {
        self.agent.overview().plugins().to_vec()
    }

    /// Lists the modules with their present conditions.
    /// During a change they are those from before it.
    pub fn modules(&self) -> Vec<ModuleStatus> {
        self.agent.overview().modules(self.agent.board())
    }

    /// Returns true if a module is the agent's time source.
    pub fn is_time_source(&self, module: &str) -> bool {
        self.agent.overview().is_time_source(module)
    }

    /// Recorder of the agent, if any.
    pub fn recording(&self) -> Option<&dyn Recording> {
        self.agent.recorder.recording.as_deref()
    }

    /// Waits for a short time until the recorder has stored all changes.
    pub fn settle_changes(&self) {
        self.agent.recorder.settle();
    }

    /// Sets inputs to values from outside, in their order; returns their results.
    /// In lockstep it waits for the end of the cycle and sets all of them before the next one; before the first cycle,
    /// values are refused. The result is empty if the loop has ended by a panic.
    pub fn set_external(&self, values: Vec<ExternalValue>) -> Vec<Result<(), ExternalInputError>> {
        ExternalInputs::new(&self.agent).set(values)
    }

    /// Runs work between two cycles in lockstep, else at once.
    /// A rerun can do the work after the same cycle. `None` if the loop has ended by a panic.
    pub fn between_cycles<R: Send + 'static>(&self, work: impl FnOnce() -> R + Send + 'static) -> Option<R> {
        if !self.is_lockstep() {
            return Some(work());
        }
        self.agent.shared.between_cycles(&[], move |_| Some(work())).ok()
    }

    /// Sets the callback that waits for external values after each cycle.
    /// It works in lockstep only; `None` removes it. The loop's thread calls it, and it must change nothing of the
    /// agent but the inputs that it sets.
    pub fn wait_after_cycles(&self, wait: Option<ValueWait>) {
        let agent = self.agent.downgrade();
        self.agent.shared.set_wait(wait.map(|mut wait| -> slate_engine::main_loop::CycleWait {
            Box::new(move |now, is_running| {
                agent.upgrade().map_or(Ok(()), |agent| wait(&CycleEnd::new(&agent, now, is_running)))
            })
        }));
    }

    /// Adds a callback after each tick that wrote a value.
    /// The thread of the tick calls it: it must not wait. It stays as long as the agent. False if there is no room for
    /// it.
    pub fn after_tick(&self, call: AfterTick) -> bool {
        self.agent.shared.hooks.after_tick.add(call)
    }

    /// The agent's board, with all properties.
    pub fn board(&self) -> &Arc<Board> {
        self.agent.board()
    }

    /// The agent's time, nanoseconds.
    pub fn now(&self) -> u64 {
        self.agent.now()
    }

    /// Converts the agent's time into a date.
    pub fn date_of(&self, time: u64) -> SystemTime {
        self.agent.shared.clock.date_of(time)
    }

    /// Returns true in lockstep, with time set by its source.
    /// Wall-clock time changes nothing then.
    pub fn is_lockstep(&self) -> bool {
        self.agent.shared.lockstep
    }

    /// Writes a line into the log.
    pub fn say(&self, text: &str) {
        self.agent.say(text);
    }

    /// Writes a line of that level into the log.
    pub fn log(&self, level: Level, text: &str) {
        self.agent.log(level, text);
    }

    /// Waits until all lines logged so far are written, at most for `limit`.
    pub fn flush_log(&self, limit: Duration) {
        self.agent.shared.logger.flush(limit);
    }
}
