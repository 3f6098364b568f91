//! Exchanging the code of a plugin under the modules that run it.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use slate_blackboard::interface::Descriptor;
use slate_module::{Description, Plugin};

use super::gather::{check_kinds, other_plugin};
use super::{Composer, Origin, PluginError, not_loaded};
use crate::agent::composition::{Composition, Fitting};
use crate::recording::Change;
use crate::runner::Retired;
use slate_composition::Catalogue;

/// Modules, each with what became of its state: carried over, or why it began afresh.
pub type Carried = Vec<(String, Result<(), String>)>;

/// What a reload came to.
#[derive(Clone, Debug)]
pub struct Reload {
    /// The plugin.
    pub plugin: String,
    /// Its modules.
    pub modules: Carried,
    /// Whether each module went on with its ports, between two ticks; else they are other ports now, and the modules
    /// were away for some cycles.
    pub in_place: bool,
    /// What became of the old library's memory.
    pub old_library: &'static str,
}

impl Composer {
    /// Exchanges the code of a plugin: with what its library is now, or with `file`. It is done between two ticks, and
    /// each module's state is carried over when it fits the new code; else the module begins afresh. New code beside the
    /// plugin ends.
    ///
    /// # Errors
    /// What does not fit; the old code goes on then.
    pub fn reload(&self, name: &str, file: Option<&Path>) -> Result<Reload, PluginError> {
        let mut composition = self.composition();
        let Some(old) = composition.catalogue.plugin(name).cloned() else {
            return Err(not_loaded(&composition, name));
        };
        let origin = composition.origins.get(name).cloned();
        let Some(file) = file.or(origin.as_ref().map(|origin| origin.file.as_path())) else {
            return Err(PluginError::LinkedIn { name: name.into() });
        };
        let (new, residence) = composition.sources().open(file)?;
        if new.name() != name {
            return Err(other_plugin(file, &new, name));
        }
        let described = self.admit(&composition, &new)?;
        let modules = composition.modules_of(&[name.to_owned()]);
        let mut in_place = true;
        for module in &modules {
            let present = &composition.present[module];
            in_place &= described
                .get(module)
                .is_some_and(|fitting| alike(&present.description, &fitting.description));
        }
        self.try_arrivals(&composition, &described)?;
        for module in modules.iter().filter(|_| !in_place) {
            if let Some(fitting) = described.get(module) {
                self.fresh(&composition, module, fitting)?;
            }
        }
        let file = std::path::absolute(file).unwrap_or_else(|_| file.into());
        let hash = new.kinds().iter().find_map(crate::plugin::code_of).unwrap_or_default();
        let change = Change::Reload { plugin: name.into(), file: file.clone(), hash };
        let modules = self.make_recorded(vec![change], || -> Result<Carried, PluginError> {
            if in_place {
                let modules = self.exchange(&mut composition, &modules, described)?;
                self.end_trial(&mut composition, name);
                self.take_in(&mut composition, &new)?;
                Ok(modules)
            } else {
                self.ask(&composition, &modules)?;
                // While they are away nothing may miss them; found out before anything is ended for it.
                composition.check(&composition.target(|catalogue| catalogue.remove(name)))?;
                self.end_trial(&mut composition, name);
                composition.ground.kept = composition.settings(&modules);
                let replaced = self.replace(&mut composition, &modules, &old, &new);
                composition.ground.kept.clear();
                replaced
            }
        })?;
        composition.origins.insert(name.into(), Origin { file, residence });
        drop(old);
        let old_library = origin.map_or("linked in", |origin| origin.residence.describe());
        for (module, state) in &modules {
            let what = match state {
                Ok(()) => "with its state".to_owned(),
                Err(reason) => format!("afresh, as its state could not be carried over: {reason}"),
            };
            self.say(&format!("module {module} runs the new code of plugin {name} {what}"));
        }
        Ok(Reload { plugin: name.into(), modules, in_place, old_library })
    }

    /// What the modules would be with another version of a plugin, when that fits.
    pub(super) fn admit(
        &self,
        composition: &Composition,
        new: &Plugin,
    ) -> Result<BTreeMap<String, Fitting>, PluginError> {
        let name = new.name();
        let others = composition.target(|catalogue| catalogue.plugins.retain(|plugin| plugin.name() != name));
        check_kinds(&others.catalogue, new)?;
        for dependency in new.dependencies() {
            if others.catalogue.plugin(dependency).is_none() {
                return Err(PluginError::Missing { name: name.into(), dependency: dependency.clone() });
            }
        }
        check_circle(&others.catalogue, new, &mut vec![name.to_owned()])?;
        Ok(composition.check(&composition.target(|catalogue| catalogue.replace(new)))?)
    }

    /// Whether the modules that come can be made, before anything is changed.
    pub(super) fn try_arrivals(
        &self,
        composition: &Composition,
        described: &BTreeMap<String, Fitting>,
    ) -> Result<(), PluginError> {
        let mut come = described.iter().filter(|(module, _)| !composition.present.contains_key(*module));
        come.try_for_each(|(module, fitting)| self.fresh(composition, module, fitting).map(drop))
    }

    /// A version of a plugin whose code the modules run already takes its place; kinds that are new come now.
    pub(super) fn take_in(&self, composition: &mut Composition, new: &Plugin) -> Result<(), PluginError> {
        let target = composition.target(|catalogue| catalogue.replace(new));
        composition.catalogue = target.catalogue;
        let target = composition.target(|_| {});
        composition.change(target, &self.shared, &BTreeMap::new())?;
        Ok(())
    }

    /// An instance of the new code for a module, with its present parameters when they fit.
    pub(super) fn fresh(
        &self,
        composition: &Composition,
        module: &str,
        fitting: &Fitting,
    ) -> Result<Retired, PluginError> {
        let property = self.shared.board.get(&format!("{module}/params"));
        let property =
            property.filter(|(property, _)| property.descriptor().hash == fitting.description.params.hash);
        let newest = property.and_then(|(property, _)| property.newest().ok().flatten());
        let params = newest.as_ref().map_or(fitting.params.as_slice(), |(bytes, ..)| bytes);
        // It runs where the module does: here, or apart.
        let present = composition.present.get(module);
        let kind = present.map_or_else(|| fitting.kind.clone(), |present| present.placed(&fitting.kind));
        let is_isolated = present.is_some_and(|present| present.isolation.is_some());
        let patience = composition.ground.patience(&Arc::from(module), is_isolated);
        let instance = patience
            .create(&kind, &fitting.setup, params)
            .map_err(|refusal| PluginError::Refused { module: module.into(), reason: refusal.0 })?;
        Ok(Retired::new(kind, instance, patience))
    }

    /// Takes modules out whose ports are other ones with the new code, and puts them in again.
    fn replace(
        &self,
        composition: &mut Composition,
        modules: &[String],
        old: &Plugin,
        new: &Plugin,
    ) -> Result<Carried, PluginError> {
        let _closed = self.end_threads(composition, modules)?;
        let mut without = composition.target(|catalogue| catalogue.remove(old.name()));
        without.keep = true;
        let states = composition.change(without, &self.shared, &BTreeMap::new())?.left;
        let with = composition.target(|catalogue| catalogue.add(new.clone()));
        match composition.change(with, &self.shared, &states) {
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
                composition.change(back, &self.shared, &states)?;
                Err(report.into())
            }
        }
    }
}

/// The new code must not need what needs it.
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

/// Whether a module can go on with its handles: ports, parameters and trigger are the same.
pub(super) fn alike(old: &Description, new: &Description) -> bool {
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
