//! Other links between modules that go on: they are checked as a whole, and exchanged between two cycles.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use slate_blackboard::wake::Wake;

use super::build::{Rewiring, rewire};
use super::composition::{Composition, Levels, listeners};
use super::survey::{Complaints, Lead, Survey, Wire, survey};
use super::unlinked::Unlinked;
use crate::configuration::{Configuration, Diagnostic, Report};
use crate::main_loop::{Seat, Shared};
use crate::runner::{Unwired, Wiring};

/// The links of a module, by its ports.
pub(super) type Leads = BTreeMap<Wire, Vec<Lead>>;

/// What changes of one module.
struct Rewire {
    seat: Arc<Seat>,
    wiring: Option<Wiring>,
    /// Whom its outputs wake, by path.
    wakes: BTreeMap<String, Vec<Arc<Wake>>>,
}

/// What came of an exchange: what is no longer needed, or a module that is in the way.
type Exchanged = Result<Vec<(Unwired, Vec<Vec<Arc<Wake>>>)>, String>;

impl Composition {
    /// Gives the modules the links of that configuration; instances, states and counters go on. Returns the modules that
    /// read something else now.
    pub fn relink(
        &mut self,
        configuration: &Arc<Configuration>,
        shared: &Arc<Shared>,
    ) -> Result<Vec<String>, Unlinked> {
        let mut complaints = Complaints::new(configuration);
        let survey = survey(configuration, &self.catalogue, &mut complaints);
        if !complaints.diagnostics.is_empty() {
            return Err(Report::from(complaints.diagnostics).into());
        }
        self.remotes.misfits.clone_from(&survey.misfits);
        let changed = self.changed(configuration, &survey);
        let new_listeners = listeners(&survey);
        let woken = self.woken(&new_listeners);
        if changed.is_empty() && woken.is_empty() {
            return Ok(Vec::new());
        }
        let standing = self.standing();
        let rewiring = rewire(configuration, &survey, &mut self.ground, &changed, &woken);
        let Rewiring { mut wirings, mut wakes, placements, reserved } = rewiring.map_err(|diagnostics| {
            self.undo(&standing, std::iter::empty());
            Report::from(diagnostics)
        })?;
        let mut rewires = BTreeMap::new();
        for (name, present) in &self.present {
            let own =
                |path: &&String| path.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('/'));
            let paths: Vec<String> = wakes.keys().filter(own).cloned().collect();
            let wakes: BTreeMap<_, _> =
                paths.into_iter().filter_map(|path| wakes.remove_entry(&path)).collect();
            let wiring = wirings.remove(name);
            if let Some(wiring) = &wiring {
                // One that is early in vain does nothing, so this may come before the exchange.
                present.seat.set_early(wiring.is_early() || present.seat.is_early());
            }
            if wiring.is_some() || !wakes.is_empty() {
                rewires.insert(name.clone(), Rewire { seat: Arc::clone(&present.seat), wiring, wakes });
            }
        }
        let names: Vec<String> =
            changed.keys().map(|module| survey.modules[*module].module.name.value.clone()).collect();
        let sources =
            changed.keys().flat_map(|module| survey.leads(configuration, *module).into_values().flatten());
        let writers: BTreeSet<String> = sources.filter_map(|lead| self.owner(&lead.path)).collect();
        let stages = self.stages(&survey);
        if let Err(module) = self.exchange_links(rewires, &writers, stages, shared) {
            self.undo(&standing, std::iter::empty());
            return Err(Unlinked::late(&module));
        }
        // Those that are left are of actuators.
        for (path, wakes) in wakes {
            let name = path.strip_suffix("/command").unwrap_or(&path);
            if let Some(actuator) = self.ground.actuators.get(name) {
                actuator.set_wakes(wakes);
            }
        }
        self.ground.board.place(placements);
        for (module, fields) in reserved {
            if let Some((params, _)) = self.ground.board.get(&format!("{module}/params")) {
                params.reserve(fields);
            }
        }
        for module in changed.keys() {
            let name = survey.modules[*module].module.name.value.as_str();
            if let Some(present) = self.present.get_mut(name) {
                present.leads = survey.leads(configuration, *module);
            }
        }
        self.listeners = new_listeners;
        Ok(names)
    }

    /// Whether links can be those of a survey: all handles can be had. Nothing of it stays.
    pub fn try_links(
        &mut self,
        configuration: &Configuration,
        survey: &Survey<'_>,
    ) -> Result<(), Vec<Diagnostic>> {
        let changed = self.changed(configuration, survey);
        if changed.is_empty() {
            return Ok(());
        }
        let standing = self.standing();
        let result = rewire(configuration, survey, &mut self.ground, &changed, &BTreeSet::new());
        let result = result.map(drop);
        self.undo(&standing, std::iter::empty());
        result
    }

    /// The ports of modules that are there whose links are other ones.
    pub fn changed(
        &self,
        configuration: &Configuration,
        survey: &Survey<'_>,
    ) -> BTreeMap<usize, BTreeSet<Wire>> {
        let mut changed = BTreeMap::new();
        for (m, surveyed) in survey.modules.iter().enumerate() {
            let Some(present) = self.present.get(&surveyed.module.name.value) else { continue };
            let new = survey.leads(configuration, m);
            let wires: BTreeSet<Wire> = present.leads.keys().chain(new.keys()).copied().collect();
            let wires: BTreeSet<Wire> =
                wires.into_iter().filter(|wire| present.leads.get(wire) != new.get(wire)).collect();
            if !wires.is_empty() {
                changed.insert(m, wires);
            }
        }
        changed
    }

    /// The paths whose readers are other ones.
    fn woken(&self, new: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<String> {
        let paths = self.listeners.keys().chain(new.keys());
        paths.filter(|path| self.listeners.get(*path) != new.get(*path)).cloned().collect()
    }

    /// The module that is there and whose name begins a path.
    pub fn owner(&self, path: &str) -> Option<String> {
        let owns =
            |name: &&String| path.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('/'));
        self.present.keys().filter(owns).max_by_key(|name| name.len()).cloned()
    }

    /// Exchanges all of it while none of the modules is in a step: those on the loop between two cycles, and those with
    /// threads are kept out of theirs, as are the writers of what is linked, so that what they wrote is whole.
    fn exchange_links(
        &self,
        rewires: BTreeMap<String, Rewire>,
        writers: &BTreeSet<String>,
        stages: Vec<Levels>,
        shared: &Arc<Shared>,
    ) -> Result<(), String> {
        let involved: BTreeSet<&String> = rewires.keys().chain(writers).collect();
        let seats = involved.into_iter().filter_map(|name| self.present.get(name));
        let (threaded, on_loop): (Vec<_>, Vec<_>) = seats.partition(|present| present.own_thread);
        let on_loop: Vec<Arc<Seat>> = on_loop.iter().map(|present| Arc::clone(&present.seat)).collect();
        let mut held: Vec<&Arc<Seat>> = Vec::new();
        let mut exchanged: Option<Exchanged> = None;
        let late = threaded.iter().find(|present| {
            let claimed = present.seat.claim_patiently();
            if claimed {
                held.push(&present.seat);
            }
            !claimed
        });
        if late.is_none() {
            let actuators = self.ground.actuators.values().cloned().collect();
            let threads = self.present.values().filter(|present| present.own_thread);
            let threads = threads.map(|present| Arc::clone(&present.seat)).collect();
            let work = move || exchange(rewires.into_values().collect(), &on_loop);
            exchanged = shared.compose_with(stages, threads, actuators, work);
        }
        for seat in held {
            seat.unclaim();
            // What is new is looked at now.
            seat.wake.notify(1);
        }
        match (late, exchanged) {
            (Some(present), _) => Err(present.seat.name.to_string()),
            (None, Some(Ok(unwired))) => {
                drop(unwired);
                Ok(())
            }
            (None, Some(Err(module))) => Err(module),
            (None, None) => Err("the main loop".into()),
        }
    }
}

/// Gives the modules what they read and wake from now on; nobody is in a step of theirs.
fn exchange(rewires: Vec<Rewire>, on_loop: &[Arc<Seat>]) -> Exchanged {
    if let Some(late) = on_loop.iter().find(|seat| !seat.is_idle() && !seat.readmit()) {
        return Err(late.name.to_string());
    }
    let mut unwired = Vec::new();
    for Rewire { seat, wiring, mut wakes } in rewires {
        // SAFETY: the seat is idle and belongs to the loop, or it is claimed.
        let runner = unsafe { seat.runner() };
        let old = wiring.map(|wiring| runner.rewire(wiring)).unwrap_or_default();
        let outputs = runner.outputs.iter_mut();
        let silenced = outputs.filter_map(|output| {
            let wakes = wakes.remove(output.property.path())?;
            Some(std::mem::replace(&mut output.wakes, wakes))
        });
        unwired.push((old, silenced.collect()));
    }
    Ok(unwired)
}
