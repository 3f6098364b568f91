//! The public interface for changes of an agent while it runs.

mod configuration;
mod operation;

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use slate_blackboard::{Board, BoardError, Property};
use slate_module::{Level, Parameter, PortDescription};

use super::external::{
    CycleEnd, ExternalInputError, ExternalInputs, ExternalValue, ValueWait, hand_refusal, output_refusal,
};
use super::handle::{AgentHandle, ModuleStatus, PluginStatus, WeakHandle};
use super::modules::ModuleAccess;
use super::plugins::{Loaded, PluginError, PluginLoader, Reload, Reloader, ShadowRunner};
use crate::recording::Recording;
use crate::sharing::AfterTick;

/// Changes an agent, from any thread and while it runs. One change is made at a time.
#[derive(Clone)]
pub struct Composer {
    pub(super) agent: AgentHandle,
}

impl std::fmt::Debug for Composer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Composer").field("agent", &self.agent.board().agent()).finish_non_exhaustive()
    }
}

/// A composer that does not keep its agent.
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
    /// The composer, as long as the agent is there.
    pub fn upgrade(&self) -> Option<Composer> {
        self.agent.upgrade().map(|agent| Composer { agent })
    }
}

impl Composer {
    /// A composer that does not keep the agent.
    pub fn downgrade(&self) -> WeakComposer {
        WeakComposer { agent: self.agent.downgrade() }
    }

    /// Loads a plugin, or a list of plugins, of the configuration, with the plugins that it needs. The modules of the
    /// configuration that are of its kinds begin; a kind of which there is none gets a module of its name.
    ///
    /// # Errors
    /// What does not fit; nothing is loaded then.
    pub fn load(&self, name: &str) -> Result<Loaded, PluginError> {
        PluginLoader::new(&self.agent).load(name)
    }

    /// Loads a plugin's library, as [`load`](Composer::load) does.
    ///
    /// # Errors
    /// What does not fit; nothing is loaded then.
    pub fn load_library(&self, file: &Path) -> Result<Loaded, PluginError> {
        PluginLoader::new(&self.agent).load_library(file)
    }

    /// Unloads a plugin, or the plugins of a list in reverse order: their modules end, their outputs get their safe
    /// values, and what they wrote last stays where others read it. Says what became of each library's memory.
    ///
    /// # Errors
    /// When another plugin needs it, a module does not let itself be unloaded, or has not returned from its tick.
    pub fn unload(&self, name: &str) -> Result<Vec<(String, &'static str)>, PluginError> {
        PluginLoader::new(&self.agent).unload(name)
    }

    /// Exchanges the code of a plugin: with what its library is now, or with `file`. It is done between two ticks, and
    /// each module's state is carried over when it fits the new code; else the module begins afresh. New code beside the
    /// plugin ends.
    ///
    /// # Errors
    /// What does not fit; the old code goes on then.
    pub fn reload(&self, name: &str, file: Option<&Path>) -> Result<Reload, PluginError> {
        Reloader::new(&self.agent).reload(name, file)
    }

    /// Runs the code of a library beside that of a plugin: it begins with the modules' present states, makes the same
    /// steps on the same inputs in threads of its own, and what it writes is compared and thrown away. How it goes is
    /// at each module's `shadow`. Returns the modules.
    ///
    /// # Errors
    /// What does not fit, or when a module has other ports in the new code, or uses services, which would act. Nothing
    /// runs beside the plugin then.
    pub fn shadow(&self, name: &str, file: &Path) -> Result<Vec<String>, PluginError> {
        ShadowRunner::new(&self.agent).shadow(name, file)
    }

    /// Ends the new code beside a plugin; the old goes on.
    ///
    /// # Errors
    /// When there is none.
    pub fn end_shadow(&self, name: &str) -> Result<(), PluginError> {
        ShadowRunner::new(&self.agent).end_shadow(name)
    }

    /// The new code beside a plugin takes over between two steps, with the states that it has by then.
    ///
    /// # Errors
    /// When there is none, it has panicked, it lags behind or hangs, or a module does not return; the old code goes on
    /// then.
    pub fn promote(&self, name: &str) -> Result<Reload, PluginError> {
        ShadowRunner::new(&self.agent).promote(name)
    }

    /// Switches a module on or off.
    ///
    /// # Errors
    /// When there is no such module, or another module switches it.
    pub fn enable(&self, module: &str, on: bool) -> Result<(), BoardError> {
        ModuleAccess::new(&self.agent).enable(module, on)
    }

    /// The parameters of a module, with their defaults and ranges; none of one that there is not. During a change they are
    /// those from before it.
    pub fn parameters(&self, module: &str) -> Vec<Parameter> {
        self.agent.overview().parameters(module)
    }

    /// The port of a module at a path.
    pub fn port(&self, path: &str) -> Option<PortDescription> {
        self.agent.overview().port(path)
    }

    /// Why nobody sets an input, if it moves a robot past its gate or Knowledge alone fills it.
    pub fn hand_refusal(&self, input: &str) -> Option<String> {
        hand_refusal(&self.agent, input)
    }

    /// The plugins that are loaded, and those of the configuration that are not. During a change they are those from
    /// before it.
    pub fn plugins(&self) -> Vec<PluginStatus> {
        self.agent.overview().plugins().to_vec()
    }

    /// The modules that there are, with how they are at this moment. During a change they are those from before it.
    pub fn modules(&self) -> Vec<ModuleStatus> {
        self.agent.overview().modules(self.agent.board())
    }

    /// Whether a module is the agent's clock.
    pub fn is_time_source(&self, module: &str) -> bool {
        self.agent.overview().is_time_source(module)
    }

    /// What records the agent, if anything does.
    pub fn recording(&self) -> Option<&dyn Recording> {
        self.agent.recorder.recording.as_deref()
    }

    /// Waits until the changes that were made are in what records the agent, but not for long.
    pub fn settle_changes(&self) {
        self.agent.recorder.settle();
    }

    /// Returns an input that a program outside of the agent can fill, as no link does, and the field that the path names.
    /// Its [`set_external`](Property::set_external) says so to tools and recordings, from which a rerun takes the values.
    ///
    /// # Errors
    /// Why it can't be filled.
    pub fn external_input(&self, input: &str) -> Result<(Arc<Property>, String), ExternalInputError> {
        ExternalInputs::new(&self.agent).find(input)
    }

    /// Returns the reason for which a program outside of the agent can't have the values of a property, and the remedy.
    pub fn output_refusal(&self, path: &str) -> Option<(String, &'static str)> {
        output_refusal(&self.agent, path)
    }

    /// The inbox of a path, to which a program outside of the agent may send messages.
    ///
    /// # Errors
    /// When it is no inbox, or takes messages of blocks alone.
    pub fn external_inbox(&self, inbox: &str) -> Result<Arc<Property>, ExternalInputError> {
        ExternalInputs::new(&self.agent).find_inbox(inbox)
    }

    /// Sets inputs to values from outside, in their order; returns what came of each. In lockstep it waits for the end of
    /// the cycle and sets all of them before the next one; before the first cycle, values are refused. Nothing is returned
    /// when the loop has ended by a panic.
    pub fn set_external(&self, values: Vec<ExternalValue>) -> Vec<Result<(), ExternalInputError>> {
        ExternalInputs::new(&self.agent).set(values)
    }

    /// Does something between two cycles when the agent is in lockstep, so that a rerun can do it after the same cycle; else at
    /// once. Returns nothing when the loop has ended by a panic.
    pub fn between_cycles<R: Send + 'static>(&self, work: impl FnOnce() -> R + Send + 'static) -> Option<R> {
        if !self.is_lockstep() {
            return Some(work());
        }
        self.agent.shared.between_cycles(&[], move |_| Some(work())).ok()
    }

    /// Has the loop wait in lockstep at the end of each cycle for values from outside; none ends that. It is
    /// called in the loop's thread, where it changes nothing of the agent but the inputs that it sets.
    pub fn wait_after_cycles(&self, wait: Option<ValueWait>) {
        let agent = self.agent.downgrade();
        self.agent.shared.set_wait(wait.map(|mut wait| -> slate_engine::main_loop::CycleWait {
            Box::new(move |now, is_running| {
                agent.upgrade().map_or(Ok(()), |agent| wait(&CycleEnd::new(&agent, now, is_running)))
            })
        }));
    }

    /// Adds what is called after each tick that wrote something, in the thread of the tick: it must not wait. It stays as long
    /// as the agent. Returns false when there is no room for one more.
    pub fn after_tick(&self, call: AfterTick) -> bool {
        self.agent.shared.hooks.after_tick.add(call)
    }

    /// Everything that the robot knows.
    pub fn board(&self) -> &Arc<Board> {
        self.agent.board()
    }

    /// The agent's time, nanoseconds.
    pub fn now(&self) -> u64 {
        self.agent.now()
    }

    /// The date of a time of the agent.
    pub fn date_of(&self, time: u64) -> SystemTime {
        self.agent.shared.clock.date_of(time)
    }

    /// Whether the agent is in lockstep: its time is set, and wall-clock time changes nothing.
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

    /// Waits until what was logged so far is written, but not longer than `limit`.
    pub fn flush_log(&self, limit: Duration) {
        self.agent.shared.logger.flush(limit);
    }
}
