//! Shadows of modules: their start, takeover and end.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::channel::Budget;
use slate_blackboard::{Access, Store};
use slate_module::{Description, Interface, Level};

use super::PluginError;
use super::exchange::{ExchangedCode, exchange_one};
use crate::agent::composition::{Composition, PluginTrial};
use slate_engine::clock::monotonic;
use slate_engine::main_loop::{RunnerCell, SharedLoop};
use slate_engine::runner::{Retired, Shadow, ShadowState};

/// Time limit for a shadow to catch up with its steps, and to end.
const TIMEOUT: Duration = Duration::from_secs(2);

/// Polling interval for a shadow's steps.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// Longest wait at the end of a cycle for the last steps, ns.
/// It is short beside the rest of a period.
const MOMENT: u64 = 500_000;

/// Shadows of modules.
pub(super) struct ModuleTrials<'c> {
    shared: &'c Arc<SharedLoop>,
}

impl<'c> ModuleTrials<'c> {
    pub fn new(shared: &'c Arc<SharedLoop>) -> Self {
        Self { shared }
    }

    /// Starts a shadow of a module.
    pub fn begin(
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
        let doc = "Comparison of new code beside this module with it.";
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
            let loaded = &composition.assembly.modules[module];
            let (own, cell) = (loaded.own_thread, Arc::clone(&loaded.cell));
            let begun = self.shared.with_cells(&[Arc::clone(&cell)], own, move || {
                let (kind, instance) = {
                    // SAFETY: between two steps the runner is not in use; the reference ends before the call.
                    let runner = unsafe { cell.runner() };
                    runner.code.parts()
                };
                let state = if instance.is_null() {
                    Err("it had failed".into())
                } else {
                    // SAFETY: the instance is of that kind, and between two steps it belongs to this call.
                    cell.call(own, || unsafe { kind.save(instance) })?.map_err(|refusal| refusal.0)
                };
                let carried = state.map(|state| shadow.begin_with(state));
                // SAFETY: as above.
                unsafe { cell.runner() }.begin_shadow(shadow);
                Some(carried)
            });
            begun.ok_or_else(|| PluginError::Late { module: module.into() })
        });
        match begun {
            Ok(carried) => {
                if let Err(reason) = carried {
                    self.say(&format!("the new code beside {module} restarts with a fresh state: {reason}"));
                }
                Ok(())
            }
            Err(error) => {
                self.free_path(module);
                Err(error)
            }
        }
    }

    /// Replaces modules' code by their shadows, once these have caught up.
    pub fn take_over(
        &self,
        name: &str,
        cells: Vec<Arc<RunnerCell>>,
        own_thread: bool,
    ) -> Result<ExchangedCode, PluginError> {
        let mut waited = Duration::ZERO;
        loop {
            let involved = cells.clone();
            match self.shared.with_cells(&cells, own_thread, move || Some(exchange_all(&involved))) {
                Some(Ok(pairs)) => {
                    let (old, shadows): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
                    shadows.into_iter().for_each(|shadow| shadow.end(TIMEOUT));
                    return Ok(ExchangedCode { cells, own_thread, old });
                }
                Some(Err(Unready::Lags(module))) if waited >= TIMEOUT => {
                    let reason = format!("the new code of module `{module}` lags behind or does not return");
                    return Err(refused(name, &reason, &mend(name)));
                }
                Some(Err(Unready::Lags(_))) => {
                    std::thread::sleep(POLL_PERIOD);
                    waited += POLL_PERIOD;
                }
                Some(Err(Unready::Panicked(module))) => {
                    let reason = format!("the new code of module `{module}` has panicked");
                    return Err(refused(name, &reason, &mend(name)));
                }
                None => {
                    let late = cells.iter().find(|cell| !cell.is_idle()).or(cells.first());
                    let module = late.map(|cell| cell.name.to_string()).unwrap_or_default();
                    return Err(PluginError::Late { module });
                }
            }
        }
    }

    /// Ends the shadow of a plugin, if it has one.
    pub fn end(&self, composition: &mut Composition, name: &str) -> bool {
        let Some(trial) = composition.plugins.trials.remove(name) else { return false };
        self.end_one(composition, &trial);
        self.say(&format!("plugin {name} runs alone again"));
        true
    }

    fn say(&self, text: &str) {
        self.shared.logger.log(self.shared.clock.now(), Level::Info, text);
    }

    pub fn end_one(&self, composition: &Composition, trial: &PluginTrial) {
        for module in &trial.modules {
            let Some(loaded) = composition.assembly.modules.get(module) else { continue };
            let cell = Arc::clone(&loaded.cell);
            let shadow = self.shared.with_cells(&[Arc::clone(&cell)], loaded.own_thread, move || {
                // SAFETY: between two steps the runner is not in use.
                Some(unsafe { cell.runner() }.shadow.take())
            });
            if let Some(shadow) = shadow.flatten() {
                shadow.end(TIMEOUT);
            }
            // The path is free even if the thread that writes it hangs.
            self.free_path(module);
        }
    }

    pub fn free_path(&self, module: &str) {
        // It may have gone with its module.
        let _ = self.shared.board.remove(&path_of(module));
    }
}

/// Reason for which a shadow can't take over now.
enum Unready {
    Lags(String),
    Panicked(String),
}

/// Exchanges modules' code with their shadows: all of them, or none.
/// It runs between two steps of the modules.
fn exchange_all(cells: &[Arc<RunnerCell>]) -> Result<Vec<(Retired, Shadow)>, Unready> {
    let until = monotonic() + MOMENT;
    for cell in cells {
        let name = || cell.name.to_string();
        // SAFETY: between two steps the runner is not in use.
        let Some(shadow) = &unsafe { cell.runner() }.shadow else { return Err(Unready::Lags(name())) };
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
    let exchanged = cells.iter().filter_map(|cell| {
        // SAFETY: as above; the reference ends before the next one is made.
        let shadow = unsafe { cell.runner() }.shadow.take()?;
        // No step was made since, so that it is still there.
        let new = shadow.take_new()?;
        Some((exchange_one(cell, new), shadow))
    });
    Ok(exchanged.collect())
}

/// Returns the path of a module's shadow state.
fn path_of(module: &str) -> String {
    format!("{module}/shadow")
}

fn mend(name: &str) -> String {
    format!("the old code keeps running; `slate plugin shadow {name} --end`, and fix the new code")
}

pub(super) fn refused(name: &str, reason: &str, help: &str) -> PluginError {
    PluginError::Shadow { name: name.into(), reason: reason.into(), help: help.into() }
}
