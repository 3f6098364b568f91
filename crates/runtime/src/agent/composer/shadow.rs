//! Trying a plugin's new code beside the old, before it takes over.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::channel::Budget;
use slate_blackboard::{Access, Store};
use slate_module::{Description, Direction, Interface, Plugin, PortDescription};

use super::exchange::{Exchanged, exchange_one};
use super::gather::other_plugin;
use super::reload::{Carried, Reload, alike};
use super::{Composer, Origin, PluginError, not_loaded};
use crate::agent::composition::Composition;
use crate::clock::monotonic;
use crate::main_loop::Seat;
use crate::plugin;
use crate::runner::{Retired, Shadow, ShadowState};

/// A plugin whose new code runs beside the old.
pub(in crate::agent) struct Trial {
    plugin: Plugin,
    pub(super) origin: Origin,
    pub(super) modules: Vec<String>,
}

impl Composer {
    /// Runs the code of a library beside that of a plugin: it begins with the modules' present states, makes the same
    /// steps on the same inputs in threads of its own, and what it writes is compared and thrown away. How it goes is
    /// at each module's `shadow`. Returns the modules.
    ///
    /// # Errors
    /// What does not fit, or when a module has other ports in the new code, or uses services, which would act. Nothing
    /// runs beside the plugin then.
    pub fn shadow(&self, name: &str, file: &Path) -> Result<Vec<String>, PluginError> {
        let mut composition = self.composition();
        if composition.catalogue.plugin(name).is_none() {
            return Err(not_loaded(&composition, name));
        }
        if composition.trials.contains_key(name) {
            let help = format!("`slate plugin promote {name}`, or `slate plugin shadow {name} --end`");
            return Err(refused(name, "new code runs beside it already", &help));
        }
        let modules = composition.modules_of(&[name.to_owned()]);
        if modules.is_empty() {
            return Err(instead(name, "no module runs its code, so there is nothing to compare with"));
        }
        if let Some(module) = modules.iter().find(|module| composition.present[*module].isolation.is_some()) {
            let reason = format!("module `{module}` is isolated, and its new code would run in the agent");
            return Err(instead(name, &reason));
        }
        composition.sources().look(file)?;
        let program = composition.ground.arenas.program.as_deref();
        let (new, _, residence) = plugin::load_for(file, program, |_| false)?;
        if new.name() != name {
            return Err(other_plugin(file, &new, name));
        }
        let described = self.admit(&composition, &new)?;
        let mut ready = Vec::new();
        for module in modules {
            let Some(fitting) = described.get(&module) else { continue };
            may_follow(&composition, name, &module, &fitting.description)?;
            let code = self.fresh(&composition, &module, fitting)?;
            ready.push((module, &fitting.description, code));
        }
        let origin = Origin { file: file.into(), residence };
        let mut trial = Trial { plugin: new, origin, modules: Vec::new() };
        for (module, description, code) in ready {
            if let Err(error) = self.begin(&composition, name, &module, description, code) {
                self.end(&composition, &trial);
                return Err(error);
            }
            trial.modules.push(module);
        }
        let modules = trial.modules.clone();
        composition.trials.insert(name.into(), trial);
        self.say(&format!("new code of plugin {name} runs beside the old"));
        Ok(modules)
    }

    /// Ends the new code beside a plugin; the old goes on.
    ///
    /// # Errors
    /// When there is none.
    pub fn end_shadow(&self, name: &str) -> Result<(), PluginError> {
        let mut composition = self.composition();
        if self.end_trial(&mut composition, name) { Ok(()) } else { Err(alone(&composition, name)) }
    }

    /// The new code beside a plugin takes over between two steps, with the states that it has by then.
    ///
    /// # Errors
    /// When there is none, it has panicked, it lags behind or hangs, or a module does not return; the old code goes on
    /// then.
    pub fn promote(&self, name: &str) -> Result<Reload, PluginError> {
        self.tell_recording("new code that ran beside the old");
        let mut composition = self.composition();
        let trial = composition.trials.get(name).ok_or_else(|| alone(&composition, name))?;
        let (plugin, origin, modules) = (trial.plugin.clone(), trial.origin.clone(), trial.modules.clone());
        // Other plugins may have come since it began.
        let described = self.admit(&composition, &plugin)?;
        self.try_arrivals(&composition, &described)?;
        let (threaded, on_loop): (Vec<_>, Vec<_>) =
            modules.iter().map(|module| &composition.present[module]).partition(|present| present.own_thread);
        let threaded = threaded.into_iter().map(|present| vec![Arc::clone(&present.seat)]);
        let on_loop = on_loop.into_iter().map(|present| Arc::clone(&present.seat)).collect();
        let groups: Vec<(bool, Vec<_>)> =
            threaded.map(|seats| (true, seats)).chain([(false, on_loop)]).collect();
        let mut done = Vec::new();
        for (own_thread, seats) in groups.into_iter().filter(|(_, seats)| !seats.is_empty()) {
            match self.take_over(name, seats, own_thread) {
                Ok(exchanged) => done.push(exchanged),
                Err(error) => {
                    if !done.is_empty() {
                        done.into_iter().rev().for_each(|exchanged| self.take_back(exchanged));
                        // Some of it is no longer beside its module.
                        self.end_trial(&mut composition, name);
                    }
                    return Err(error);
                }
            }
        }
        for (module, fitting) in described {
            if let Some(present) = composition.present.get_mut(&module).filter(|_| modules.contains(&module))
            {
                (present.kind, present.description) = (fitting.kind, fitting.description);
            }
        }
        // The old instances end here, and not on the loop.
        drop(done);
        let trial = composition.trials.remove(name);
        modules.iter().for_each(|module| self.free_path(module));
        self.take_in(&mut composition, &plugin)?;
        let old = composition.origins.insert(name.into(), origin);
        drop(trial);
        self.say(&format!("the new code of plugin {name} has taken over"));
        let modules: Carried = modules.into_iter().map(|module| (module, Ok(()))).collect();
        let old_library = old.map_or("linked in", |origin| origin.residence.describe());
        Ok(Reload { plugin: name.into(), modules, in_place: true, old_library })
    }

    /// Lets new code run beside a module.
    fn begin(
        &self,
        composition: &Composition,
        name: &str,
        module: &str,
        description: &Description,
        code: Retired,
    ) -> Result<(), PluginError> {
        let failed = |error: &dyn std::fmt::Display| refused(name, &error.to_string(), "try again");
        let path = path_of(module);
        let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 16, queues: 4, window: 16 } };
        let doc = "How new code beside this module compares with it.";
        let property =
            self.shared.board.add_channel(&path, doc, ShadowState::DESCRIPTOR, store, Access::Output);
        let property = property.map_err(|error| failed(&error))?;
        let writer = property.channel().and_then(|channel| channel.writer().ok());
        let log = self.shared.logger.module(&Arc::from(path.as_str()), false, &self.shared.clock);
        let shadow = match (writer, log) {
            (Some(writer), Some(log)) => {
                Shadow::start(module, description, code, writer, log).map_err(|error| failed(&error))
            }
            _ => Err(failed(&"it can't get its handles")),
        };
        let begun = shadow.and_then(|shadow| {
            let present = &composition.present[module];
            let (own, seat) = (present.own_thread, Arc::clone(&present.seat));
            let begun = self.shared.with_seats(&[Arc::clone(&seat)], own, move || {
                let (kind, instance) = {
                    // SAFETY: between two steps the runner is not in use; the reference ends before the call.
                    let runner = unsafe { seat.runner() };
                    (runner.kind.clone(), runner.instance)
                };
                let state = if instance.is_null() {
                    Err("it had failed".into())
                } else {
                    // SAFETY: the instance is of that kind, and between two steps it belongs to this call.
                    seat.call(own, || unsafe { kind.save(instance) })?.map_err(|refusal| refusal.0)
                };
                let carried = state.map(|state| shadow.begin_with(state));
                // SAFETY: as above.
                unsafe { seat.runner() }.begin_shadow(shadow);
                Some(carried)
            });
            begun.ok_or_else(|| PluginError::Late { module: module.into() })
        });
        match begun {
            Ok(carried) => {
                if let Err(reason) = carried {
                    self.say(&format!("the new code beside {module} begins afresh: {reason}"));
                }
                Ok(())
            }
            Err(error) => {
                self.free_path(module);
                Err(error)
            }
        }
    }

    /// Lets the new code beside those modules take over as soon as it has made all steps of the old.
    fn take_over(
        &self,
        name: &str,
        seats: Vec<Arc<Seat>>,
        own_thread: bool,
    ) -> Result<Exchanged, PluginError> {
        let mut waited = Duration::ZERO;
        loop {
            let involved = seats.clone();
            match self.shared.with_seats(&seats, own_thread, move || Some(exchange_all(&involved))) {
                Some(Ok(pairs)) => {
                    let (old, shadows): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
                    shadows.into_iter().for_each(|shadow| shadow.end(PATIENCE));
                    return Ok(Exchanged { seats, own_thread, old });
                }
                Some(Err(Unready::Lags(module))) if waited >= PATIENCE => {
                    let reason = format!("the new code of module `{module}` lags behind or does not return");
                    return Err(refused(name, &reason, &mend(name)));
                }
                Some(Err(Unready::Lags(_))) => {
                    std::thread::sleep(LOOK);
                    waited += LOOK;
                }
                Some(Err(Unready::Panicked(module))) => {
                    let reason = format!("the new code of module `{module}` has panicked");
                    return Err(refused(name, &reason, &mend(name)));
                }
                None => {
                    let late = seats.iter().find(|seat| !seat.is_idle()).or(seats.first());
                    let module = late.map(|seat| seat.name.to_string()).unwrap_or_default();
                    return Err(PluginError::Late { module });
                }
            }
        }
    }

    /// Ends the new code beside a plugin, if there is any.
    pub(super) fn end_trial(&self, composition: &mut Composition, name: &str) -> bool {
        let Some(trial) = composition.trials.remove(name) else { return false };
        self.end(composition, &trial);
        self.say(&format!("plugin {name} runs alone again"));
        true
    }

    fn end(&self, composition: &Composition, trial: &Trial) {
        for module in &trial.modules {
            let Some(present) = composition.present.get(module) else { continue };
            let seat = Arc::clone(&present.seat);
            let shadow = self.shared.with_seats(&[Arc::clone(&seat)], present.own_thread, move || {
                // SAFETY: between two steps the runner is not in use.
                Some(unsafe { seat.runner() }.shadow.take())
            });
            if let Some(shadow) = shadow.flatten() {
                shadow.end(PATIENCE);
            }
            // The path is free even if the thread that writes it hangs.
            self.free_path(module);
        }
    }

    fn free_path(&self, module: &str) {
        // It may have gone with its module.
        let _ = self.shared.board.remove(&path_of(module));
    }
}

/// How long new code may take for the steps that it is behind, and for its end.
const PATIENCE: Duration = Duration::from_secs(2);

/// How long is waited between two looks whether it has made them.
const LOOK: Duration = Duration::from_millis(1);

/// How long a cycle's end waits for the last of them, nanoseconds; short beside what is left of a period.
const MOMENT: u64 = 500_000;

/// Why new code can't take over now.
enum Unready {
    Lags(String),
    Panicked(String),
}

/// Exchanges the code of modules, between two of their steps, with that beside them: all or none.
fn exchange_all(seats: &[Arc<Seat>]) -> Result<Vec<(Retired, Shadow)>, Unready> {
    let until = monotonic() + MOMENT;
    for seat in seats {
        let name = || seat.name.to_string();
        // SAFETY: between two steps the runner is not in use.
        let Some(shadow) = &unsafe { seat.runner() }.shadow else { return Err(Unready::Lags(name())) };
        while !shadow.has_caught_up() {
            if monotonic() > until {
                return Err(Unready::Lags(name()));
            }
            std::thread::yield_now();
        }
        if shadow.panics() > 0 {
            return Err(Unready::Panicked(name()));
        }
    }
    let exchanged = seats.iter().filter_map(|seat| {
        // SAFETY: as above; the reference ends before the next one is made.
        let shadow = unsafe { seat.runner() }.shadow.take()?;
        // No step was made since, so that it is still there.
        let new = shadow.take_new()?;
        Some((exchange_one(seat, new), shadow))
    });
    Ok(exchanged.collect())
}

/// Whether new code may run beside that module.
fn may_follow(
    composition: &Composition,
    name: &str,
    module: &str,
    description: &Description,
) -> Result<(), PluginError> {
    let acts = |port: &PortDescription| matches!(port.direction, Direction::Aspect | Direction::Provider);
    let reason = if !alike(&composition.present[module].description, description) {
        "has other ports in the new code"
    } else if description.ports.iter().any(acts) {
        "uses services, so that its shadow would act"
    } else {
        return Ok(());
    };
    Err(instead(name, &format!("module `{module}` {reason}")))
}

/// Where it is shown how new code compares.
fn path_of(module: &str) -> String {
    format!("{module}/shadow")
}

fn mend(name: &str) -> String {
    format!("the old code goes on; `slate plugin shadow {name} --end`, and mend the new code")
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

fn refused(name: &str, reason: &str, help: &str) -> PluginError {
    PluginError::Shadow { name: name.into(), reason: reason.into(), help: help.into() }
}
