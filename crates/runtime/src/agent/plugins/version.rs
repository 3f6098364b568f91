//! New version of a plugin's code, for the modules that run it.

use std::sync::Arc;

use slate_blackboard::interface::Descriptor;
use slate_module::{Description, Plugin};
use slate_sorted::SortedMap;

use super::PluginError;
use super::gather::check_kinds;
use crate::agent::assembly::ModuleStates;
use crate::agent::composition::{Composition, Fitting};
use slate_composition::Catalogue;
use slate_engine::main_loop::SharedLoop;
use slate_engine::runner::Retired;

/// Version of a plugin that fits the agent.
pub(super) struct PluginVersion<'c> {
    shared: &'c Arc<SharedLoop>,
    pub plugin: Plugin,
    /// Modules that the agent has with this version.
    pub modules: SortedMap<String, Fitting>,
}

impl<'c> PluginVersion<'c> {
    /// Checks a version, and finds the modules that the agent has with it.
    pub fn admit(
        shared: &'c Arc<SharedLoop>,
        composition: &Composition,
        plugin: Plugin,
    ) -> Result<Self, PluginError> {
        let name = plugin.name();
        let others = composition.target(|catalogue| catalogue.plugins.retain(|other| other.name() != name));
        check_kinds(&others.catalogue, &plugin)?;
        for dependency in plugin.dependencies() {
            if others.catalogue.plugin(dependency).is_none() {
                return Err(PluginError::Missing { name: name.into(), dependency: dependency.clone() });
            }
        }
        check_circle(&others.catalogue, &plugin, &mut vec![name.to_owned()])?;
        let modules = composition.check(&composition.target(|catalogue| catalogue.replace(&plugin)))?;
        Ok(Self { shared, plugin, modules })
    }

    /// Returns true if a module can keep its handles.
    /// Its ports, parameters and trigger must be unchanged.
    pub fn is_alike(&self, composition: &Composition, module: &str) -> bool {
        let old = &composition.assembly.modules[module].description;
        self.modules.get(module).is_some_and(|fitting| alike(old, &fitting.description))
    }

    /// Checks that the new modules can be made, before any change.
    pub fn try_arrivals(&self, composition: &Composition) -> Result<(), PluginError> {
        let loaded = &composition.assembly.modules;
        let mut come = self.modules.keys().filter(|module| !loaded.contains_key(*module));
        come.try_for_each(|module| self.fresh(composition, module).map(drop))
    }

    /// Replaces the version before it, whose modules run the new code already.
    /// New kinds are loaded now.
    pub fn take_in(&self, composition: &mut Composition) -> Result<(), PluginError> {
        let target = composition.target(|catalogue| catalogue.replace(&self.plugin));
        composition.catalogue = target.catalogue;
        let target = composition.target(|_| {});
        composition.change(target, self.shared, &ModuleStates::new())?;
        Ok(())
    }

    /// Makes an instance of the new code for a module.
    /// It has the module's present parameters if they fit. `None` for a module that this version lacks.
    pub fn fresh(&self, composition: &Composition, module: &str) -> Result<Option<Retired>, PluginError> {
        let Some(fitting) = self.modules.get(module) else { return Ok(None) };
        let property = self.shared.board.get(&format!("{module}/params"));
        let property =
            property.filter(|(property, _)| property.descriptor().hash == fitting.description.params.hash);
        let newest = property.and_then(|(property, _)| property.newest().ok().flatten());
        let params = newest.as_ref().map_or(fitting.params.as_slice(), |(bytes, ..)| bytes);
        // It runs where the module does: here, or apart.
        let loaded = composition.assembly.modules.get(module);
        let kind = loaded.map_or_else(|| fitting.kind.clone(), |loaded| loaded.placed(&fitting.kind));
        let is_isolated = loaded.is_some_and(|loaded| loaded.isolation.is_some());
        let timeout = composition.assembly.resources.timeout(&Arc::from(module), is_isolated);
        let instance = timeout
            .create(&kind, &fitting.setup, params)
            .map_err(|refusal| PluginError::Refused { module: module.into(), reason: refusal.0 })?;
        Ok(Some(Retired::new(kind, instance, timeout)))
    }

    /// Notes that a module runs this code.
    pub fn note(&mut self, composition: &mut Composition, module: &str) {
        if let Some((loaded, fitting)) =
            composition.assembly.modules.get_mut(module).zip(self.modules.remove(module))
        {
            (loaded.kind, loaded.description) = (fitting.kind, Arc::new(fitting.description));
        }
    }
}

/// Checks that the new code does not depend on its own dependents.
fn check_circle(catalogue: &Catalogue, plugin: &Plugin, open: &mut Vec<String>) -> Result<(), PluginError> {
    for dependency in plugin.dependencies() {
        open.push(dependency.clone());
        if open[0] == *dependency {
            return Err(PluginError::Circle { circle: std::mem::take(open) });
        }
        if let Some(needed) = catalogue.plugin(dependency) {
            check_circle(catalogue, needed, open)?;
        }
        open.pop();
    }
    Ok(())
}

/// Returns true if a module can keep its handles.
/// Its ports, parameters and trigger must be unchanged.
fn alike(old: &Description, new: &Description) -> bool {
    let same = |a: &'static Descriptor, b: &'static Descriptor| a.hash == b.hash;
    old.stage == new.stage
        && old.trigger == new.trigger
        && old.deadline == new.deadline
        && same(old.params, new.params)
        && old.ports.len() == new.ports.len()
        && old.ports.iter().zip(&new.ports).all(|(a, b)| {
            a.name == b.name
                && a.direction == b.direction
                && same(a.descriptor, b.descriptor)
                && a.required == b.required
                && a.role == b.role
                && a.stale_after == b.stale_after
                && a.safe == b.safe
                && a.capacity == b.capacity
                && a.window == b.window
        })
}
