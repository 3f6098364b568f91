//! Other links between modules that go on: they are checked as a whole, and exchanged between two cycles.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use slate_blackboard::wake::Wake;
use slate_blackboard::{Board, Placement, Property};

use super::build::{Made, Rewiring, rewire};
use super::composition::{Composition, Levels, listeners};
use super::unlinked::Unlinked;
use crate::configuration::{Configuration, Diagnostic, Report};
use crate::main_loop::{Seat, Shared};
use crate::runner::{Unwired, Wiring};
use slate_composition::{Complaints, Lead, Misfit, Survey, Wire, survey};

/// The links of a module, by its ports.
pub(super) type Leads = BTreeMap<Wire, Vec<Lead>>;

/// What changes of one module.
struct Rewire {
    seat: Arc<Seat>,
    wiring: Option<Wiring>,
    /// Whom its outputs wake, by path.
    wakes: BTreeMap<String, Vec<Arc<Wake>>>,
}

/// Parameters, and which of them tools must not set any more as they follow what.
type Reserved = (Arc<Property>, Vec<(String, String)>);

/// What came of an exchange: what is no longer needed, or a module that is in the way.
type Exchanged = Result<Vec<(Unwired, Vec<Vec<Arc<Wake>>>)>, String>;

/// Other links for modules that are there: all is made, and nothing is exchanged yet.
pub(super) struct Relinking {
    rewires: BTreeMap<String, Rewire>,
    /// The modules whose outputs are linked otherwise.
    writers: BTreeSet<String>,
    stages: Vec<Levels>,
    /// Whom actuators wake, by path.
    wakes: BTreeMap<String, Vec<Arc<Wake>>>,
    placements: Vec<Placement>,
    reserved: Vec<Reserved>,
    leads: BTreeMap<String, Leads>,
    listeners: BTreeMap<String, BTreeSet<String>>,
    misfits: BTreeMap<String, Misfit>,
}

impl Relinking {
    /// What is to stand at a path, unless that is what stands there.
    pub fn placement(&self, path: &str) -> Option<&Placement> {
        let at = |placement: &&Placement| match placement {
            Placement::Property(property) => property.path() == path,
            Placement::Alias { path: at, .. } => at == path,
        };
        self.placements.iter().rev().find(at)
    }

    /// Shows on the board what the modules read now.
    fn show(&mut self, board: &Board) {
        board.place(std::mem::take(&mut self.placements));
        std::mem::take(&mut self.reserved).into_iter().for_each(|(params, fields)| params.reserve(fields));
    }
}

impl Composition {
    /// Gives the modules the links of that configuration; instances, states and counters go on. Returns the modules that
    /// read something else now.
    pub fn relink(
        &mut self,
        configuration: &Arc<Configuration>,
        shared: &Arc<Shared>,
    ) -> Result<Vec<String>, Unlinked> {
        let standing = self.standing();
        let mut relinking = self.other_links(configuration, shared)?;
        let is_same = relinking.leads.is_empty() && relinking.listeners == self.listeners;
        if !is_same && let Err(module) = self.exchange_links(&mut relinking, shared) {
            self.undo(&standing, std::iter::empty());
            return Err(Unlinked::late(&module));
        }
        relinking.show(&self.ground.board);
        Ok(self.note_links(relinking))
    }

    /// Makes what the modules read by that configuration. Until it is exchanged, [`undo`](Composition::undo) takes back
    /// what of it can be seen.
    pub fn other_links(
        &mut self,
        configuration: &Configuration,
        shared: &Shared,
    ) -> Result<Relinking, Unlinked> {
        let mut complaints = Complaints::new(configuration);
        let survey = survey(configuration, &self.catalogue, &mut complaints);
        if !complaints.diagnostics.is_empty() {
            return Err(Report::from(complaints.diagnostics).into());
        }
        self.deepen(configuration, &survey, shared).map_err(|module| Unlinked::late(&module))?;
        let changed = self.changed(configuration, &survey);
        let listeners = listeners(&survey);
        let woken = self.woken(&listeners);
        let standing = self.standing();
        let made = Made::Later(self.ground.means.clock.now());
        let rewiring = rewire(configuration, &survey, &mut self.ground, &changed, &woken, made);
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
        let leads: BTreeMap<String, Leads> = changed
            .keys()
            .map(|module| {
                let name = survey.modules[*module].module.name.value.clone();
                (name, survey.leads(configuration, *module))
            })
            .collect();
        let sources = leads.values().flat_map(BTreeMap::values).flatten();
        let reserved = reserved.into_iter().filter_map(|(module, fields)| {
            let (params, _) = self.ground.board.get(&format!("{module}/params"))?;
            Some((params, fields))
        });
        Ok(Relinking {
            writers: sources.filter_map(|lead| self.owner(&lead.path)).collect(),
            stages: self.stages(&survey),
            reserved: reserved.collect(),
            misfits: survey.misfits,
            rewires,
            wakes,
            placements,
            leads,
            listeners,
        })
    }

    /// Takes note of links that hold now, and returns the modules that read something else.
    pub fn note_links(&mut self, relinking: Relinking) -> Vec<String> {
        let Relinking { wakes, leads, listeners, misfits, .. } = relinking;
        for (path, wakes) in wakes {
            let name = path.strip_suffix("/command").unwrap_or(&path);
            if let Some(actuator) = self.ground.actuators.get(name) {
                actuator.set_wakes(wakes);
            }
        }
        let names = leads.keys().cloned().collect();
        for (name, leads) in leads {
            if let Some(present) = self.present.get_mut(&name) {
                present.leads = leads;
            }
        }
        (self.listeners, self.remotes.misfits) = (listeners, misfits);
        names
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
        let nobody = BTreeSet::new();
        let result = rewire(configuration, survey, &mut self.ground, &changed, &nobody, Made::OnTrial);
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
    fn exchange_links(&self, relinking: &mut Relinking, shared: &Arc<Shared>) -> Result<(), String> {
        let involved: BTreeSet<&String> = relinking.rewires.keys().chain(&relinking.writers).collect();
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
            let rewires = std::mem::take(&mut relinking.rewires);
            let stages = std::mem::take(&mut relinking.stages);
            let work = move || exchange(rewires.into_values().collect(), &on_loop);
            exchanged = self.compose_with(stages, shared, work);
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

    /// Exchanges all of it between two cycles, with what else is done in the same moment: `judge` before it, which
    /// changes nothing when it fails, and `work` after it. The modules with threads are held by who calls this. Nothing
    /// when the loop was lost.
    pub fn exchange_links_with<J, R: Send + 'static, E: Send + 'static>(
        &self,
        mut relinking: Relinking,
        shared: &Arc<Shared>,
        judge: impl FnOnce(&Shared) -> Result<J, E> + Send + 'static,
        work: impl FnOnce(&Shared, J) -> R + Send + 'static,
    ) -> Option<Result<(R, Relinking), E>> {
        let (board, own) = (Arc::clone(&self.ground.board), Arc::clone(shared));
        let rewires: Vec<_> = std::mem::take(&mut relinking.rewires).into_values().collect();
        let stages = std::mem::take(&mut relinking.stages);
        let all = move || {
            let judged = judge(&own)?;
            // Nobody is in a step, as was found a moment ago.
            let unwired = exchange(rewires, &[]);
            relinking.show(&board);
            let done = work(&own, judged);
            Ok((unwired, done, relinking))
        };
        // What is no longer needed is dropped here and not on the loop.
        self.compose_with(stages, shared, all).map(|done| done.map(|(_, done, relinking)| (done, relinking)))
    }

    fn compose_with<R: Send + 'static, E: Send + 'static>(
        &self,
        stages: Vec<Levels>,
        shared: &Shared,
        work: impl FnOnce() -> Result<R, E> + Send + 'static,
    ) -> Option<Result<R, E>> {
        let actuators = self.ground.actuators.values().cloned().collect();
        let threads = self.present.values().filter(|present| present.own_thread);
        let threads = threads.map(|present| Arc::clone(&present.seat)).collect();
        shared.compose_with(stages, threads, actuators, work)
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
        let outputs = runner.outputs.ports.iter_mut();
        let silenced = outputs.filter_map(|output| {
            let wakes = wakes.remove(output.property.path())?;
            Some(std::mem::replace(&mut output.wakes, wakes))
        });
        unwired.push((old, silenced.collect()));
    }
    Ok(unwired)
}
