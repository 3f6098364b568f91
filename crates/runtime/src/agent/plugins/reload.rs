//! Exchange of a plugin's code under the modules that run it.

use std::path::Path;

use slate_module::Plugin;

use super::exchange::CodeExchange;
use super::gather::{PluginSources, other_plugin};
use super::removal::ModuleRemoval;
use super::trial::ModuleTrials;
use super::version::PluginVersion;
use super::{CarriedStates, PluginError, Reload, not_loaded};
use crate::agent::assembly::ModuleStates;
use crate::agent::composition::{Composition, LibraryOrigin};
use crate::agent::handle::AgentHandle;
use crate::recording::Change;

/// Exchange of plugins' code.
pub(in crate::agent) struct Reloader<'c> {
    agent: &'c AgentHandle,
}

impl<'c> Reloader<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Exchanges the code of a plugin, with its present library or with `file`.
    pub fn reload(&self, name: &str, file: Option<&Path>) -> Result<Reload, PluginError> {
        let mut composition = self.agent.composition();
        let Some(old) = composition.catalogue.plugin(name).cloned() else {
            return Err(not_loaded(&composition, name));
        };
        let origin = composition.plugins.origins.get(name).cloned();
        let Some(file) = file.or(origin.as_ref().map(|origin| origin.file.as_path())) else {
            return Err(PluginError::LinkedIn { name: name.into() });
        };
        let (new, residence) = PluginSources::of(&composition).open(file, &composition.catalogue)?;
        if new.name() != name {
            return Err(other_plugin(file, &new, name));
        }
        let mut version = PluginVersion::admit(&self.agent.shared, &composition, new)?;
        let modules = composition.modules_of(&[name.to_owned()]);
        let in_place = modules.iter().all(|module| version.is_alike(&composition, module));
        version.try_arrivals(&composition)?;
        // While the old code ticks: `create` may load a network, or start an interpreter.
        let mut fresh = Vec::new();
        for module in &modules {
            fresh.push(version.fresh(&composition, module)?);
        }
        let fresh = in_place.then_some(fresh);
        let file = std::path::absolute(file).unwrap_or_else(|_| file.into());
        let hash = version.plugin.kinds().iter().find_map(slate_engine::plugin::code_of).unwrap_or_default();
        let change = Change::Reload { plugin: name.into(), file: file.clone(), hash };
        let modules = self.agent.recorder.make(vec![change], || -> Result<CarriedStates, PluginError> {
            if let Some(fresh) = fresh {
                let exchange = CodeExchange::new(&self.agent.shared);
                let modules = exchange.exchange(&mut composition, &modules, fresh, &mut version)?;
                ModuleTrials::new(&self.agent.shared).end(&mut composition, name);
                version.take_in(&mut composition)?;
                Ok(modules)
            } else {
                ModuleRemoval::new(&self.agent.shared, &modules).check_vetoes(&composition)?;
                // While they are away nothing may miss them; found out before anything is ended for it.
                composition.check(&composition.target(|catalogue| catalogue.remove(name)))?;
                ModuleTrials::new(&self.agent.shared).end(&mut composition, name);
                let resources = &mut composition.assembly.resources;
                resources.kept = resources.settings(&modules);
                let replaced = self.replace(&mut composition, &modules, &old, &version.plugin);
                composition.assembly.resources.kept.clear();
                replaced
            }
        })?;
        composition.plugins.origins.insert(name.into(), LibraryOrigin { file, residence });
        drop(old);
        let old_library = origin.map_or("linked in", |origin| origin.residence.describe());
        for (module, state) in &modules {
            let what = match state {
                Ok(()) => "with its state".to_owned(),
                Err(reason) => format!("afresh, as its state could not be carried over: {reason}"),
            };
            self.agent.say(&format!("module {module} runs the new code of plugin {name} {what}"));
        }
        Ok(Reload { plugin: name.into(), modules, in_place, old_library })
    }

    /// Replaces modules whose ports change with the new code.
    /// They are removed and made again.
    fn replace(
        &self,
        composition: &mut Composition,
        modules: &[String],
        old: &Plugin,
        new: &Plugin,
    ) -> Result<CarriedStates, PluginError> {
        let _closed = ModuleRemoval::new(&self.agent.shared, modules).end_threads(composition)?;
        let mut without = composition.target(|catalogue| catalogue.remove(old.name()));
        without.keep = true;
        let states = composition.change(without, &self.agent.shared, &ModuleStates::new())?.left;
        let with = composition.target(|catalogue| catalogue.add(new.clone()));
        match composition.change(with, &self.agent.shared, &states) {
            Ok(mut changed) => Ok(modules
                .iter()
                .map(|module| {
                    let state = match &states[module] {
                        Ok(_) => changed.restored.remove(module).unwrap_or(Ok(())),
                        Err(reason) => Err(reason.clone()),
                    };
                    (module.clone(), state)
                })
                .collect()),
            Err(report) => {
                // It was there a moment ago, so it fits.
                let back = composition.target(|catalogue| catalogue.add(old.clone()));
                composition.change(back, &self.agent.shared, &states)?;
                Err(report.into())
            }
        }
    }
}
