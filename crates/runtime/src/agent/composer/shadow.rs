//! Trying a plugin's new code beside the old, before it takes over.

use std::path::Path;
use std::sync::Arc;

use slate_blackboard::channel::Budget;
use slate_blackboard::{Access, Store};
use slate_module::{Direction, Interface, Plugin};

use super::gather::other_plugin;
use super::reload::{Reload, alike};
use super::{Composer, Origin, PluginError, unknown};
use crate::agent::composition::Composition;
use crate::plugin;
use crate::runner::{Retired, Shadow, ShadowState};

/// A plugin whose new code runs beside the old.
pub(in crate::agent) struct Trial {
    plugin: Plugin,
    origin: Origin,
    modules: Vec<String>,
}

impl Composer {
    /// Runs the code of a library beside that of a plugin: it begins with the modules' present states, makes the same
    /// steps on the same inputs in threads of its own, and what it writes is compared and thrown away. How it goes is
    /// at each module's `shadow`. Returns the modules.
    ///
    /// # Errors
    /// What does not fit, or when a module has other ports in the new code, or uses services, which would act.
    pub fn shadow(&self, name: &str, file: &Path) -> Result<Vec<String>, PluginError> {
        let mut composition = self.composition();
        if composition.catalogue.plugin(name).is_none() {
            return Err(unknown(&composition, name));
        }
        if composition.trials.contains_key(name) {
            let help = format!("`slate plugin promote {name}`, or `slate plugin shadow {name} --end`");
            return Err(trial(name, "new code runs beside it already", &help));
        }
        let (new, _, residence) = plugin::load(file)?;
        if new.name() != name {
            return Err(other_plugin(file, &new, name));
        }
        let target = composition.target(|catalogue| catalogue.replace(&new));
        let described = composition.check(&target)?;
        let modules = composition.modules_of(&[name.to_owned()]);
        let mut ready = Vec::new();
        for module in &modules {
            let present = &composition.present[module];
            let Some(fitting) = described.get(module) else { continue };
            let description = &fitting.description;
            if !alike(&present.description, description) {
                let reason = format!("module `{module}` has other ports in the new code");
                return Err(trial(name, &reason, "reload the plugin instead"));
            }
            if present.isolation.is_some() {
                let reason =
                    format!("module `{module}` is isolated, and its new code would run in the agent");
                return Err(trial(name, &reason, "reload the plugin instead"));
            }
            let acts = |port: &slate_module::PortDescription| {
                matches!(port.direction, Direction::Aspect | Direction::Provider)
            };
            if description.ports.iter().any(acts) {
                let reason = format!("module `{module}` uses services, so that its shadow would act");
                return Err(trial(name, &reason, "reload the plugin instead"));
            }
            let new = self.fresh(&composition, module, fitting)?;
            ready.push((module.clone(), description.clone(), new));
        }
        let failed = |error: &dyn std::fmt::Display| trial(name, &error.to_string(), "try again");
        for (module, description, new) in ready {
            let path = format!("{module}/shadow");
            let budget = Budget { latest: 16, queues: 4, window: 16 };
            let store = Store { capacity: 0, depth: 1, budget };
            let doc = "How new code beside this module compares with it.";
            let added =
                self.shared.board.add_channel(&path, doc, ShadowState::DESCRIPTOR, store, Access::Output);
            let property = added.map_err(|error| failed(&error))?;
            let writer = property.channel().and_then(|channel| channel.writer().ok());
            let log = self.shared.logger.module(&Arc::from(path.as_str()), false, &self.shared.clock);
            let (Some(writer), Some(log)) = (writer, log) else {
                return Err(failed(&"it can't get its handles"));
            };
            let present = &composition.present[&module];
            let (own, seat, of) = (present.own_thread, Arc::clone(&present.seat), module.clone());
            let started = self.shared.with_seats(&[Arc::clone(&seat)], own, move || {
                let (kind, instance) = {
                    // SAFETY: between two steps the runner is not in use; the reference ends before the call.
                    let runner = unsafe { seat.runner() };
                    (runner.kind.clone(), runner.instance)
                };
                // SAFETY: both instances belong to this call.
                let carried =
                    seat.call(own, || unsafe { kind.save(instance).and_then(|state| new.restore(&state)) })?;
                let shadow = Shadow::start(&of, &description, new, writer, log);
                // SAFETY: as above.
                let runner = unsafe { seat.runner() };
                Some(shadow.map(|shadow| runner.begin_shadow(shadow)).map(|()| carried))
            });
            match started {
                Some(Ok(Ok(()))) => {}
                Some(Ok(Err(refusal))) => {
                    self.say(&format!("the new code beside {module} begins afresh: {refusal}"));
                }
                Some(Err(error)) => return Err(failed(&error)),
                None => return Err(PluginError::Late { module }),
            }
        }
        let origin = Origin { file: file.into(), residence };
        composition.trials.insert(name.into(), Trial { plugin: new, origin, modules: modules.clone() });
        self.say(&format!("new code of plugin {name} runs beside the old"));
        Ok(modules)
    }

    /// Ends the new code beside a plugin; the old goes on.
    ///
    /// # Errors
    /// When there is none.
    pub fn end_shadow(&self, name: &str) -> Result<(), PluginError> {
        let mut composition = self.composition();
        let Some(ended) = composition.trials.remove(name) else {
            return Err(trial(name, "no new code runs beside it", "begin with a library's file"));
        };
        for module in &ended.modules {
            // What hangs is left to its thread.
            drop(self.take_shadow(&composition, module));
        }
        Ok(())
    }

    /// The new code beside a plugin takes over, with the states that it has by now.
    ///
    /// # Errors
    /// When there is none, or a module does not return; the old code goes on then.
    pub fn promote(&self, name: &str) -> Result<Reload, PluginError> {
        let mut composition = self.composition();
        let Some(promoted) = composition.trials.remove(name) else {
            return Err(trial(name, "no new code runs beside it", "begin with a library's file"));
        };
        let mut news = Vec::new();
        for module in &promoted.modules {
            match self.take_shadow(&composition, module) {
                Some(new) => news.push((module.clone(), new)),
                None => {
                    let reason = format!("the new code of `{module}` does not return");
                    return Err(trial(name, &reason, "the old code goes on; mend the new one"));
                }
            }
        }
        let mut modules = Vec::new();
        for (module, new) in news {
            let kind = new.parts().0.clone();
            let present = &composition.present[&module];
            let (own, seat) = (present.own_thread, Arc::clone(&present.seat));
            let old = self.shared.with_seats(&[Arc::clone(&seat)], own, move || {
                let (kind, instance) = new.into_parts();
                // SAFETY: between two steps the runner is not in use.
                Some(unsafe { seat.runner() }.exchange(kind, instance))
            });
            if old.is_none() {
                return Err(PluginError::Late { module });
            }
            if let Some(present) = composition.present.get_mut(&module) {
                present.kind = kind;
            }
            modules.push((module, Ok(())));
        }
        let target = composition.target(|catalogue| catalogue.replace(&promoted.plugin));
        composition.catalogue = target.catalogue;
        let old = composition.origins.insert(name.into(), promoted.origin);
        drop(promoted.plugin);
        self.say(&format!("the new code of plugin {name} has taken over"));
        let old_library = old.map_or("linked in", |origin| origin.residence.describe());
        Ok(Reload { plugin: name.into(), modules, in_place: true, old_library })
    }

    /// Takes the new code from beside a module; nothing when it does not return.
    fn take_shadow(&self, composition: &Composition, module: &str) -> Option<Retired> {
        let present = composition.present.get(module)?;
        let (own, seat) = (present.own_thread, Arc::clone(&present.seat));
        let shadow = self.shared.with_seats(&[Arc::clone(&seat)], own, move || {
            // SAFETY: between two steps the runner is not in use.
            Some(unsafe { seat.runner() }.shadow.take())
        });
        // The path is free even if the thread that writes it hangs.
        let _ = self.shared.board.remove(&format!("{module}/shadow"));
        shadow.flatten()?.end(PATIENCE)
    }
}

/// How long new code may take for what it was given.
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(2);

fn trial(name: &str, reason: &str, help: &str) -> PluginError {
    PluginError::Shadow { name: name.into(), reason: reason.into(), help: help.into() }
}
