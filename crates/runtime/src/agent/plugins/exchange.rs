//! Exchange of code under modules with unchanged ports: for all, or for none.

use std::sync::Arc;

use slate_module::{Level, Refusal};

use super::departure::Departure;
use super::version::PluginVersion;
use super::{CarriedStates, PluginError};
use crate::agent::composition::Composition;
use slate_engine::main_loop::{Seat, SharedLoop};
use slate_engine::runner::Retired;

/// Module that gets new code.
struct PendingExchange {
    seat: Arc<Seat>,
    own_thread: bool,
    fresh: Retired,
}

/// Modules whose code was exchanged together, with their old instances.
pub(super) struct ExchangedCode {
    pub seats: Vec<Arc<Seat>>,
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

    /// Exchanges the code of modules with that of a version of their plugin.
    pub fn exchange(
        &self,
        composition: &mut Composition,
        modules: &[String],
        version: &mut PluginVersion<'_>,
    ) -> Result<CarriedStates, PluginError> {
        let _closed = Departure::new(self.shared, modules).end_threads(composition)?;
        let mut exchanges = Vec::new();
        for module in modules {
            let Some(fresh) = version.fresh(composition, module)? else { continue };
            let loaded = &composition.assembly.modules[module];
            exchanges.push(PendingExchange {
                seat: Arc::clone(&loaded.seat),
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
            let seats: Vec<_> = group.iter().map(|exchange| Arc::clone(&exchange.seat)).collect();
            let result = self.shared.with_seats(&seats, own_thread, move || exchange_all(group));
            let Some((carried, old)) = result else {
                let module = seats.iter().find(|seat| !seat.is_idle()).map(|seat| seat.name.to_string());
                done.into_iter().rev().for_each(|exchanged| self.take_back(exchanged));
                return Err(PluginError::Late { module: module.unwrap_or_default() });
            };
            states.extend(seats.iter().map(|seat| seat.name.to_string()).zip(carried));
            done.push(ExchangedCode { seats, own_thread, old });
        }
        modules.iter().for_each(|module| version.note(composition, module));
        // The old instances end here, and not on the loop.
        drop(done);
        Ok(states)
    }

    /// Returns modules to their old code, with the states that they had with it.
    pub fn take_back(&self, exchanged: ExchangedCode) {
        let ExchangedCode { seats, own_thread, old } = exchanged;
        let involved = seats.clone();
        let back = self.shared.with_seats(&seats, own_thread, move || {
            Some(involved.iter().zip(old).map(|(seat, old)| exchange_one(seat, old)).collect::<Vec<_>>())
        });
        if back.is_none() {
            let names: Vec<_> = seats.iter().map(|seat| &*seat.name).collect();
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
    for PendingExchange { seat, own_thread, fresh } in exchanges {
        // It ends with this when a module does not return.
        let (kind, instance) = fresh.parts();
        let (old_kind, old) = {
            // SAFETY: the seat is claimed or the loop's; the reference ends before the module is called.
            let runner = unsafe { seat.runner() };
            runner.code.parts()
        };
        // SAFETY: both instances are of their kinds, and between two ticks they belong to this call.
        let state = seat.call(own_thread, || unsafe {
            if old.is_null() {
                return Err(Refusal("it had failed".into()));
            }
            old_kind.save(old).and_then(|state| kind.restore(instance, &state))
        })?;
        carried.push(state.map_err(|refusal| refusal.0));
        ready.push((seat, fresh));
    }
    Some((carried, ready.into_iter().map(|(seat, fresh)| exchange_one(&seat, fresh)).collect()))
}

/// Exchanges the code of a module and returns the old code.
/// The module's seat must be claimed, or the loop's.
pub(super) fn exchange_one(seat: &Seat, fresh: Retired) -> Retired {
    let (kind, instance) = fresh.into_parts();
    // SAFETY: as said above, nobody else uses the runner.
    let runner = unsafe { seat.runner() };
    runner.exchange(kind, instance)
}
