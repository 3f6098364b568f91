//! Exchanging the code of a plugin under the modules that run it.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use slate_blackboard::interface::Descriptor;
use slate_module::{Description, Plugin};

use super::gather::{check_kinds, other_plugin};
use super::{Composer, Origin, PluginError, unknown};
use crate::agent::catalogue::Catalogue;
use crate::agent::composition::{Composition, Fitting};
use crate::runner::Retired;

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
    /// each module's state is carried over when it fits the new code; else the module begins afresh.
    ///
    /// # Errors
    /// What does not fit; the old code goes on then.
    pub fn reload(&self, name: &str, file: Option<&Path>) -> Result<Reload, PluginError> {
        let mut composition = self.composition();
        let Some(old) = composition.catalogue.plugin(name).cloned() else {
            return Err(unknown(&composition, name));
        };
        if composition.trials.contains_key(name) {
            return Err(PluginError::Shadow {
                name: name.into(),
                reason: "new code runs beside it".into(),
                help: format!("`slate plugin promote {name}`, or `slate plugin shadow {name} --end`"),
            });
        }
        let origin = composition.origins.get(name).cloned();
        let Some(file) = file.or(origin.as_ref().map(|origin| origin.file.as_path())) else {
            return Err(PluginError::LinkedIn { name: name.into() });
        };
        let (new, residence) = composition.open(file)?;
        if new.name() != name {
            return Err(other_plugin(file, &new, name));
        }
        let target = composition.target(|catalogue| catalogue.plugins.retain(|plugin| plugin.name() != name));
        check_kinds(&target.catalogue, &new)?;
        for dependency in new.dependencies() {
            if target.catalogue.plugin(dependency).is_none() {
                return Err(PluginError::Missing { name: name.into(), dependency: dependency.clone() });
            }
        }
        check_circle(&target.catalogue, &new, &mut vec![name.to_owned()])?;
        let exchanged = |catalogue: &mut Catalogue| catalogue.replace(&new);
        let described = composition.check(&composition.target(exchanged))?;
        let modules = composition.modules_of(&[name.to_owned()]);
        let mut in_place = true;
        for module in &modules {
            let present = &composition.present[module];
            in_place &= described
                .get(module)
                .is_some_and(|fitting| alike(&present.description, &fitting.description));
        }
        for (module, fitting) in &described {
            // What can't be made is found out before anything is changed.
            let comes = !composition.present.contains_key(module);
            if comes || (!in_place && modules.contains(module)) {
                self.fresh(&composition, module, fitting)?;
            }
        }
        let modules = if in_place {
            let modules = self.exchange(&mut composition, &modules, described)?;
            let target = composition.target(exchanged);
            composition.catalogue = target.catalogue;
            // Kinds that are new to the configuration come now.
            let target = composition.target(|_| {});
            composition.change(target, &self.shared, &BTreeMap::new())?;
            modules
        } else {
            self.ask(&composition, &modules)?;
            composition.ground.kept = composition.settings(&modules);
            let replaced = self.replace(&mut composition, &modules, &old, &new);
            composition.ground.kept.clear();
            replaced?
        };
        composition.origins.insert(name.into(), Origin { file: file.into(), residence });
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
        let made = fitting.setup.with(|setup| kind.create(setup, params));
        let instance =
            made.map_err(|refusal| PluginError::Refused { module: module.into(), reason: refusal.0 })?;
        let is_isolated = present.is_some_and(|present| present.isolation.is_some());
        Ok(Retired::new(kind, instance, composition.ground.patience(&Arc::from(module), is_isolated)))
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
                && a.role == b.role
                && a.stale_after == b.stale_after
                && a.safe == b.safe
                && a.capacity == b.capacity
                && a.window == b.window
        })
}
