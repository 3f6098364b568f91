//! Exchange of code under modules with unchanged ports: for all, or for none.

use std::sync::Arc;

use slate_module::{Level, Refusal};

use super::removal::ModuleRemoval;
use super::version::PluginVersion;
use super::{CarriedStates, PluginError};
use crate::agent::composition::Composition;
use slate_engine::main_loop::{RunnerCell, SharedLoop};
use slate_engine::runner::Retired;

/// Module that gets new code.
struct PendingExchange {
    cell: Arc<RunnerCell>,
    own_thread: bool,
    fresh: Retired,
}

/// Modules whose code was exchanged together, with their old instances.
pub(super) struct ExchangedCode {
    pub cells: Vec<Arc<RunnerCell>>,
    pub own_thread: bool,
    pub old: Vec<Retired>,
}

/// Exchange of modules' code.
pub(super) struct CodeExchange<'c> {
    shared: &'c Arc<SharedLoop>,
}

impl<'c> CodeExchange<'c> {
    pub fn new(shared: &'c Arc<SharedLoop>) -> Self {
        Self { shared }
    }

    /// Exchanges the code of modules with fresh instances of a version of their plugin.
    pub fn exchange(
        &self,
        composition: &mut Composition,
        modules: &[String],
        fresh: Vec<Option<Retired>>,
        version: &mut PluginVersion<'_>,
    ) -> Result<CarriedStates, PluginError> {
        let _closed = ModuleRemoval::new(self.shared, modules).end_threads(composition)?;
        let mut exchanges = Vec::new();
        for (module, fresh) in modules.iter().zip(fresh) {
            let Some(fresh) = fresh else { continue };
            let loaded = &composition.assembly.modules[module];
            exchanges.push(PendingExchange {
                cell: Arc::clone(&loaded.cell),
                own_thread: loaded.own_thread,
                fresh,
            });
        }
        let (threaded, on_loop): (Vec<_>, Vec<_>) =
            exchanges.into_iter().partition(|exchange| exchange.own_thread);
        let mut states = Vec::new();
        let mut done: Vec<ExchangedCode> = Vec::new();
        let groups = threaded.into_iter().map(|exchange| vec![exchange]).chain([on_loop]);
        for group in groups.filter(|group| !group.is_empty()) {
            let own_thread = group[0].own_thread;
            let cells: Vec<_> = group.iter().map(|exchange| Arc::clone(&exchange.cell)).collect();
            let result = self.shared.with_cells(&cells, own_thread, move || exchange_all(group));
            let Some((carried, old)) = result else {
                let module = cells.iter().find(|cell| !cell.is_idle()).map(|cell| cell.name.to_string());
                done.into_iter().rev().for_each(|exchanged| self.take_back(exchanged));
                return Err(PluginError::Late { module: module.unwrap_or_default() });
            };
            states.extend(cells.iter().map(|cell| cell.name.to_string()).zip(carried));
            done.push(ExchangedCode { cells, own_thread, old });
        }
        modules.iter().for_each(|module| version.note(composition, module));
        // The old instances end here, and not on the loop.
        drop(done);
        Ok(states)
    }

    /// Returns modules to their old code, with the states that they had with it.
    pub fn take_back(&self, exchanged: ExchangedCode) {
        let ExchangedCode { cells, own_thread, old } = exchanged;
        let involved = cells.clone();
        let back = self.shared.with_cells(&cells, own_thread, move || {
            Some(involved.iter().zip(old).map(|(cell, old)| exchange_one(cell, old)).collect::<Vec<_>>())
        });
        if back.is_none() {
            let names: Vec<_> = cells.iter().map(|cell| &*cell.name).collect();
            let text =
                format!("{} can't go back to the old code, as a call does not return", names.join(", "));
            self.shared.logger.log(self.shared.clock.now(), Level::Error, &text);
        }
    }
}

/// Result for each state, and the old instances.
type CarriedCode = (Vec<Result<(), String>>, Vec<Retired>);

/// Carries the states over, and then exchanges the code of all modules.
/// `None` if a module does not return.
fn exchange_all(exchanges: Vec<PendingExchange>) -> Option<CarriedCode> {
    let mut carried = Vec::new();
    let mut ready = Vec::new();
    for PendingExchange { cell, own_thread, fresh } in exchanges {
        // It ends with this when a module does not return.
        let (kind, instance) = fresh.parts();
        let (old_kind, old) = {
            // SAFETY: the cell is claimed or the loop's; the reference ends before the module is called.
            let runner = unsafe { cell.runner() };
            runner.code.parts()
        };
        // SAFETY: both instances are of their kinds, and between two ticks they belong to this call.
        let state = cell.call(own_thread, || unsafe {
            if old.is_null() {
                return Err(Refusal("it had failed".into()));
            }
            old_kind.save(old).and_then(|state| kind.restore(instance, &state))
        })?;
        carried.push(state.map_err(|refusal| refusal.0));
        ready.push((cell, fresh));
    }
    Some((carried, ready.into_iter().map(|(cell, fresh)| exchange_one(&cell, fresh)).collect()))
}

/// Exchanges the code of a module and returns the old code.
/// The module's cell must be claimed, or the loop's.
pub(super) fn exchange_one(cell: &RunnerCell, fresh: Retired) -> Retired {
    let (kind, instance) = fresh.into_parts();
    // SAFETY: as said above, the runner has no other user.
    let runner = unsafe { cell.runner() };
    runner.exchange(kind, instance)
}
