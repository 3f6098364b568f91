//! New links between running modules.
//! They are checked as a whole, and exchanged between two cycles.

use std::sync::Arc;

use slate_blackboard::wake::Wake;
use slate_blackboard::{Board, Placement, Property};
use slate_sorted::{SortedMap, SortedSet};

use super::module::LinksByPort;
use super::{Assembly, Levels, Unlinked, listeners};
use crate::agent::build::{BuildMoment, Rewiring, rewire};
use slate_composition::{Catalogue, DiagnosticCollector, LinkMismatch, survey};
use slate_configuration::{Configuration, Report};
use slate_engine::main_loop::{RunnerCell, SharedLoop};
use slate_engine::runner::{ReplacedHandles, Wiring};

/// Change of one module's links.
struct Rewire {
    cell: Arc<RunnerCell>,
    wiring: Option<Wiring>,
    /// The threads that its outputs wake, by path.
    wakes: SortedMap<String, Vec<Arc<Wake>>>,
}

/// Parameters that tools must not set, each with the source that it follows.
type Reserved = (Arc<Property>, Vec<(String, String)>);

/// Result of an exchange: the replaced links, or a module that blocks it.
type LinkExchange = Result<Vec<(ReplacedHandles, Vec<Vec<Arc<Wake>>>)>, String>;

/// New links for present modules: prepared, but not exchanged yet.
pub(in crate::agent) struct Relinking {
    rewires: SortedMap<String, Rewire>,
    /// Modules whose outputs have changed links.
    writers: SortedSet<String>,
    stages: Vec<Levels>,
    /// The threads that actuators wake, by path.
    wakes: SortedMap<String, Vec<Arc<Wake>>>,
    placements: Vec<Placement>,
    reserved: Vec<Reserved>,
    links_by_port: SortedMap<String, LinksByPort>,
    listeners: SortedMap<String, SortedSet<String>>,
    mismatches: SortedMap<String, LinkMismatch>,
}

impl Relinking {
    /// Prepares the links of a configuration.
    /// Until the exchange, [`HostResources::undo`](crate::agent::build::HostResources::undo) reverts all visible
    /// effects.
    pub fn prepare(
        assembly: &mut Assembly,
        configuration: &Configuration,
        catalogue: &Catalogue,
        shared: &SharedLoop,
    ) -> Result<Self, Unlinked> {
        let mut diagnostics = DiagnosticCollector::new(configuration);
        let survey = survey(configuration, catalogue, &mut diagnostics);
        if !diagnostics.diagnostics.is_empty() {
            return Err(Report::from(diagnostics.diagnostics).into());
        }
        assembly.deepen(configuration, &survey, shared).map_err(|module| Unlinked::late(&module))?;
        let changed = assembly.changed(configuration, &survey);
        let listeners = listeners(&survey);
        let woken = woken(&assembly.listeners, &listeners);
        let mark = assembly.resources.mark();
        let made = BuildMoment::Later(assembly.resources.service_context.clock.now());
        let rewiring = rewire(configuration, &survey, &mut assembly.resources, &changed, &woken, made);
        let Rewiring { wirings, mut wakes, placements, reserved } = rewiring.map_err(|diagnostics| {
            assembly.resources.undo(&mark, []);
            Report::from(diagnostics)
        })?;
        let rewires = rewires(assembly, wirings, &mut wakes);
        let links_by_port: SortedMap<String, LinksByPort> = changed
            .keys()
            .map(|module| {
                let name = survey.modules[*module].module.name.value.clone();
                (name, survey.link_signatures(configuration, *module))
            })
            .collect();
        let sources = links_by_port.values().flat_map(SortedMap::values).flatten();
        let reserved = reserved.into_iter().filter_map(|(module, fields)| {
            let (params, _) = assembly.resources.board.get(&format!("{module}/params"))?;
            Some((params, fields))
        });
        Ok(Self {
            writers: sources.filter_map(|lead| assembly.owner(&lead.path)).collect(),
            stages: assembly.stages(&survey),
            reserved: reserved.collect(),
            mismatches: survey.mismatches,
            rewires,
            wakes,
            placements,
            links_by_port,
            listeners,
        })
    }

    /// Returns true if a module's sources or its woken threads differ from now.
    pub fn is_other_than(&self, assembly: &Assembly) -> bool {
        !self.links_by_port.is_empty() || self.listeners != assembly.listeners
    }

    /// Returns the new placement at a path; `None` if it stays.
    pub fn placement(&self, path: &str) -> Option<&Placement> {
        let at = |placement: &&Placement| match placement {
            Placement::Property(property) => property.path() == path,
            Placement::Alias { path: at, .. } => at == path,
        };
        self.placements.iter().rev().find(at)
    }

    /// Places the modules' new sources on the board.
    pub fn show(&mut self, board: &Board) {
        board.place(std::mem::take(&mut self.placements));
        std::mem::take(&mut self.reserved).into_iter().for_each(|(params, fields)| params.reserve(fields));
    }

    /// Stores the new links in the assembly; returns the modules whose sources changed.
    pub fn note(self, assembly: &mut Assembly) -> Vec<String> {
        let Self { wakes, links_by_port, listeners, mismatches, .. } = self;
        for (path, wakes) in wakes {
            let name = path.strip_suffix("/command").unwrap_or(&path);
            if let Some(actuator) = assembly.resources.actuators.get(name) {
                actuator.set_wakes(wakes);
            }
        }
        let names = links_by_port.keys().cloned().collect();
        for (name, links_by_port) in links_by_port {
            if let Some(loaded) = assembly.modules.get_mut(&name) {
                loaded.links_by_port = links_by_port;
            }
        }
        (assembly.listeners, assembly.mismatches) = (listeners, mismatches);
        names
    }

    /// Exchanges all links while none of the involved modules is in a step.
    /// Modules on the loop are between two cycles then. Those with threads are kept out of their steps, as are the
    /// writers of the linked properties, so that their values are complete. Fails with the name of the module that
    /// blocks it.
    pub fn exchange(&mut self, assembly: &Assembly, shared: &Arc<SharedLoop>) -> Result<(), String> {
        let involved: SortedSet<&String> = self.rewires.keys().chain(&self.writers).collect();
        let cells = involved.into_iter().filter_map(|name| assembly.modules.get(name));
        let (threaded, on_loop): (Vec<_>, Vec<_>) = cells.partition(|loaded| loaded.own_thread);
        let on_loop: Vec<Arc<RunnerCell>> = on_loop.iter().map(|loaded| Arc::clone(&loaded.cell)).collect();
        let mut held: Vec<&Arc<RunnerCell>> = Vec::new();
        let mut exchanged: Option<LinkExchange> = None;
        let late = threaded.iter().find(|loaded| {
            let claimed = loaded.cell.claim_when_idle();
            if claimed {
                held.push(&loaded.cell);
            }
            !claimed
        });
        if late.is_none() {
            let rewires = std::mem::take(&mut self.rewires);
            let stages = std::mem::take(&mut self.stages);
            let work = move || exchange(rewires.into_values().collect(), &on_loop);
            exchanged = assembly.compose_with(stages, shared, work);
        }
        for cell in held {
            cell.release();
            // New values are checked now.
            cell.wake.notify(1);
        }
        match (late, exchanged) {
            (Some(loaded), _) => Err(loaded.cell.name.to_string()),
            (None, Some(Ok(unwired))) => {
                drop(unwired);
                Ok(())
            }
            (None, Some(Err(module))) => Err(module),
            (None, None) => Err("the main loop".into()),
        }
    }

    /// Exchanges all links between two cycles, together with further work.
    /// `judge` runs before it, and changes nothing when it fails; `work` runs after it. The caller holds the modules
    /// with threads. `None` if the loop is lost.
    pub fn exchange_with<J, R: Send + 'static, E: Send + 'static>(
        mut self,
        assembly: &Assembly,
        shared: &Arc<SharedLoop>,
        judge: impl FnOnce(&SharedLoop) -> Result<J, E> + Send + 'static,
        work: impl FnOnce(&SharedLoop, J) -> R + Send + 'static,
    ) -> Option<Result<(R, Self), E>> {
        let (board, own) = (Arc::clone(&assembly.resources.board), Arc::clone(shared));
        let rewires: Vec<_> = std::mem::take(&mut self.rewires).into_values().collect();
        let stages = std::mem::take(&mut self.stages);
        let all = move || {
            let checked = judge(&own)?;
            // No module is in a step, as just checked.
            let unwired = exchange(rewires, &[]);
            self.show(&board);
            let done = work(&own, checked);
            Ok((unwired, done, self))
        };
        // Unused parts are dropped here and not on the loop.
        let done = assembly.compose_with(stages, shared, all);
        done.map(|done| done.map(|(_, done, relinking)| (done, relinking)))
    }
}

/// Returns the paths whose readers have changed.
fn woken(
    old: &SortedMap<String, SortedSet<String>>,
    new: &SortedMap<String, SortedSet<String>>,
) -> SortedSet<String> {
    let paths = old.keys().chain(new.keys());
    paths.filter(|path| old.get(*path) != new.get(*path)).cloned().collect()
}

/// Returns the change of each module's links.
/// Wakes that belong to no module remain in `wakes`.
fn rewires(
    assembly: &Assembly,
    mut wirings: SortedMap<String, Wiring>,
    wakes: &mut SortedMap<String, Vec<Arc<Wake>>>,
) -> SortedMap<String, Rewire> {
    let mut rewires = SortedMap::new();
    for (name, loaded) in &assembly.modules {
        let own = |path: &&String| path.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('/'));
        let paths: Vec<String> = wakes.keys().filter(own).cloned().collect();
        let wakes: SortedMap<_, _> = paths.into_iter().filter_map(|path| wakes.remove_entry(&path)).collect();
        let wiring = wirings.remove(name);
        if let Some(wiring) = &wiring {
            // One that is early in vain does nothing, so this may come before the exchange.
            loaded.cell.set_reads_previous(wiring.reads_previous() || loaded.cell.reads_previous());
        }
        if wiring.is_some() || !wakes.is_empty() {
            rewires.insert(name.clone(), Rewire { cell: Arc::clone(&loaded.cell), wiring, wakes });
        }
    }
    rewires
}

/// Exchanges the modules' sources and woken threads.
/// No module is in a step meanwhile.
fn exchange(rewires: Vec<Rewire>, on_loop: &[Arc<RunnerCell>]) -> LinkExchange {
    if let Some(late) = on_loop.iter().find(|cell| !cell.is_idle() && !cell.reclaim()) {
        return Err(late.name.to_string());
    }
    let mut unwired = Vec::new();
    for Rewire { cell, wiring, mut wakes } in rewires {
        // SAFETY: the cell is idle and belongs to the loop, or it is claimed.
        let runner = unsafe { cell.runner() };
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
