//! Trial of a plugin's new code beside the old, before it takes over.

use std::path::Path;
use std::sync::Arc;

use slate_module::{Direction, PortDescription};

use super::exchange::CodeExchange;
use super::gather::{PluginSources, other_plugin};
use super::trial::{ModuleTrials, refused};
use super::version::PluginVersion;
use super::{CarriedStates, PluginError, Reload, not_loaded};
use crate::agent::composition::{Composition, Fitting, LibraryOrigin, PluginTrial};
use crate::agent::handle::AgentHandle;
use slate_engine::plugin;

/// Trials of new code of plugins.
pub(in crate::agent) struct ShadowRunner<'c> {
    agent: &'c AgentHandle,
}

impl<'c> ShadowRunner<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Runs a library's code as the shadow of a plugin.
    /// It begins with the modules' present states and makes the same steps on the same inputs in threads of its own;
    /// its outputs are compared and discarded.
    pub fn shadow(&self, name: &str, file: &Path) -> Result<Vec<String>, PluginError> {
        let mut composition = self.agent.composition();
        if composition.catalogue.plugin(name).is_none() {
            return Err(not_loaded(&composition, name));
        }
        if composition.plugins.trials.contains_key(name) {
            let help = format!("`slate plugin promote {name}`, or `slate plugin shadow {name} --end`");
            return Err(refused(name, "new code runs beside it already", &help));
        }
        let modules = composition.modules_of(&[name.to_owned()]);
        if modules.is_empty() {
            return Err(instead(name, "no module runs its code, so there is nothing to compare with"));
        }
        if let Some(module) =
            modules.iter().find(|module| composition.assembly.modules[*module].isolation.is_some())
        {
            let reason = format!("module `{module}` is isolated, and its new code would run in the agent");
            return Err(instead(name, &reason));
        }
        PluginSources::of(&composition).check_file(file)?;
        let program = composition.assembly.resources.arenas.program.as_deref();
        let (new, _, residence) = plugin::load_for(file, program, Vec::new, |_| false)?;
        if new.name() != name {
            return Err(other_plugin(file, &new, name));
        }
        let version = PluginVersion::admit(&self.agent.shared, &composition, new)?;
        let mut ready = Vec::new();
        for module in modules {
            let Some(fitting) = version.modules.get(&module) else { continue };
            may_follow(&composition, name, &module, &version)?;
            if let Some(code) = version.fresh(&composition, &module)? {
                ready.push((module, &fitting.description, code));
            }
        }
        let origin = LibraryOrigin { file: file.into(), residence };
        let mut trial = PluginTrial { plugin: version.plugin.clone(), origin, modules: Vec::new() };
        let trials = ModuleTrials::new(&self.agent.shared);
        for (module, description, code) in ready {
            if let Err(error) = trials.begin(&composition, name, &module, description, code) {
                trials.end_one(&composition, &trial);
                return Err(error);
            }
            trial.modules.push(module);
        }
        let modules = trial.modules.clone();
        composition.plugins.trials.insert(name.into(), trial);
        self.agent.say(&format!("new code of plugin {name} runs beside the old"));
        Ok(modules)
    }

    /// Ends the shadow of a plugin; the old code stays.
    pub fn end_shadow(&self, name: &str) -> Result<(), PluginError> {
        let mut composition = self.agent.composition();
        if ModuleTrials::new(&self.agent.shared).end(&mut composition, name) {
            Ok(())
        } else {
            Err(alone(&composition, name))
        }
    }

    /// Replaces a plugin's code by its shadow between two steps.
    /// The new code has the states that it has by then.
    pub fn promote(&self, name: &str) -> Result<Reload, PluginError> {
        self.agent.recorder.record_unrepeatable("new code that ran beside the old");
        let mut composition = self.agent.composition();
        let trial = composition.plugins.trials.get(name).ok_or_else(|| alone(&composition, name))?;
        let (plugin, origin, modules) = (trial.plugin.clone(), trial.origin.clone(), trial.modules.clone());
        // Other plugins may have come since it began.
        let mut version = PluginVersion::admit(&self.agent.shared, &composition, plugin)?;
        version.try_arrivals(&composition)?;
        let trials = ModuleTrials::new(&self.agent.shared);
        let (threaded, on_loop): (Vec<_>, Vec<_>) = modules
            .iter()
            .map(|module| &composition.assembly.modules[module])
            .partition(|loaded| loaded.own_thread);
        let threaded = threaded.into_iter().map(|loaded| vec![Arc::clone(&loaded.cell)]);
        let on_loop = on_loop.into_iter().map(|loaded| Arc::clone(&loaded.cell)).collect();
        let groups: Vec<(bool, Vec<_>)> =
            threaded.map(|cells| (true, cells)).chain([(false, on_loop)]).collect();
        let mut done = Vec::new();
        for (own_thread, cells) in groups.into_iter().filter(|(_, cells)| !cells.is_empty()) {
            match trials.take_over(name, cells, own_thread) {
                Ok(exchanged) => done.push(exchanged),
                Err(error) => {
                    if !done.is_empty() {
                        done.into_iter()
                            .rev()
                            .for_each(|exchanged| CodeExchange::new(&self.agent.shared).take_back(exchanged));
                        // Some of it is no longer beside its module.
                        trials.end(&mut composition, name);
                    }
                    return Err(error);
                }
            }
        }
        modules.iter().for_each(|module| version.note(&mut composition, module));
        // The old instances end here, and not on the loop.
        drop(done);
        let trial = composition.plugins.trials.remove(name);
        modules.iter().for_each(|module| trials.free_path(module));
        version.take_in(&mut composition)?;
        let old = composition.plugins.origins.insert(name.into(), origin);
        drop(trial);
        self.agent.say(&format!("the new code of plugin {name} has taken over"));
        let modules: CarriedStates = modules.into_iter().map(|module| (module, Ok(()))).collect();
        let old_library = old.map_or("linked in", |origin| origin.residence.describe());
        Ok(Reload { plugin: name.into(), modules, in_place: true, old_library })
    }
}

/// Checks that a shadow may run beside a module.
fn may_follow(
    composition: &Composition,
    name: &str,
    module: &str,
    version: &PluginVersion<'_>,
) -> Result<(), PluginError> {
    let acts = |port: &PortDescription| matches!(port.direction, Direction::Aspect | Direction::Provider);
    let uses_services = |fitting: &Fitting| fitting.description.ports.iter().any(acts);
    let reason = if !version.is_alike(composition, module) {
        "has other ports in the new code"
    } else if version.modules.get(module).is_some_and(uses_services) {
        "uses services, so that its shadow would act"
    } else {
        return Ok(());
    };
    Err(instead(name, &format!("module `{module}` {reason}")))
}

fn instead(name: &str, reason: &str) -> PluginError {
    refused(name, reason, "reload the plugin instead")
}

fn alone(composition: &Composition, name: &str) -> PluginError {
    if composition.catalogue.plugin(name).is_none() {
        return not_loaded(composition, name);
    }
    refused(name, "no new code runs beside it", &format!("`slate plugin shadow {name} FILE` begins it"))
}
