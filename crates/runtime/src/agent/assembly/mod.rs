//! Assembly of an agent: its modules and the links between them.

mod arrival;
mod deepening;
mod module;
mod owners;
mod relinking;
mod unlinked;

use std::sync::Arc;

use slate_blackboard::interface::Value;
use slate_sorted::{SortedMap, SortedSet};

use super::build::{BuildMoment, HostResources, rewire};
pub(super) use arrival::ModuleStates;
pub(super) use module::LoadedModule;
use owners::LoopOwners;
pub(super) use relinking::Relinking;
use slate_composition::{Catalogue, LinkEnd, LinkMismatch, Survey};
use slate_configuration::{Configuration, Diagnostic};
pub(super) use slate_engine::main_loop::Levels;
use slate_engine::main_loop::{RunnerCell, SharedLoop};
use slate_module::Description;
pub(super) use unlinked::Unlinked;

/// Realization of a composition: its modules and their links.
pub(super) struct Assembly {
    pub resources: HostResources,
    /// Modules by name.
    pub modules: SortedMap<String, LoadedModule>,
    /// Modules that read a path.
    pub listeners: SortedMap<String, SortedSet<String>>,
    /// Links that do not fit the properties of other agents, at the last survey.
    pub mismatches: SortedMap<String, LinkMismatch>,
    /// Descriptions of modules that have left, to check their settings by.
    /// Their code is not available meanwhile.
    pub last_known: SortedMap<String, Description>,
    owners: LoopOwners,
}

impl Assembly {
    /// Makes an assembly without modules.
    pub fn new(resources: HostResources) -> Self {
        Self {
            resources,
            modules: SortedMap::new(),
            listeners: SortedMap::new(),
            mismatches: SortedMap::new(),
            last_known: SortedMap::new(),
            owners: LoopOwners::default(),
        }
    }

    /// Returns the present modules that the loop runs, stage by stage.
    pub fn stages(&self, survey: &Survey<'_>) -> Vec<Levels> {
        let on_loop = |level: &Vec<usize>| {
            let names = level.iter().map(|index| survey.modules[*index].module.name.value.as_str());
            names
                .map(|name| &self.modules[name])
                .filter(|loaded| !loaded.own_thread || loaded.cell.is_turn_signaled())
                .map(|loaded| Arc::clone(&loaded.cell))
                .collect()
        };
        survey.order.iter().map(|levels| levels.iter().map(on_loop).collect()).collect()
    }

    /// The modules that have threads of their own.
    fn threaded(&self) -> Vec<Arc<RunnerCell>> {
        let threaded = self.modules.values().filter(|loaded| loaded.own_thread);
        threaded.map(|loaded| Arc::clone(&loaded.cell)).collect()
    }

    /// Starts the threads of modules that have their own.
    pub fn start_threads(&self, shared: &Arc<SharedLoop>) -> std::io::Result<()> {
        let mut threads = shared.threads();
        self.threaded().iter().try_for_each(|cell| threads.start(shared, cell))
    }

    /// Sets the stages that the loop runs, from its next cycle on.
    /// Sets the present threads and actuators with them.
    pub fn compose(&mut self, stages: Vec<Levels>, shared: &Arc<SharedLoop>) {
        self.resources.service_context.actuators.set(self.resources.actuators.clone());
        shared.compose(stages, self.threaded(), self.resources.actuators.values().cloned().collect());
        let Self { owners, modules, resources, .. } = self;
        owners.connect(modules, &resources.service_context, shared);
    }

    /// Works as [`compose`](Assembly::compose), between two cycles, with more work.
    /// `None` if the loop is lost.
    fn compose_with<R: Send + 'static, E: Send + 'static>(
        &self,
        stages: Vec<Levels>,
        shared: &SharedLoop,
        work: impl FnOnce() -> Result<R, E> + Send + 'static,
    ) -> Option<Result<R, E>> {
        let actuators = self.resources.actuators.values().cloned().collect();
        shared.compose_with(stages, self.threaded(), actuators, work)
    }

    /// Returns the present module whose name begins a path.
    pub fn owner(&self, path: &str) -> Option<String> {
        let owns =
            |name: &&String| path.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('/'));
        self.modules.keys().filter(owns).max_by_key(|name| name.len()).cloned()
    }

    /// Returns true if a link carries messages, from an outbox to an inbox.
    pub fn sends(&self, to: &str, from: &str) -> bool {
        let modules = || self.modules.iter().map(|(name, loaded)| (name.as_str(), &*loaded.description));
        slate_composition::sends(modules, to, from)
    }

    /// The default of a module's parameter.
    pub fn default_of(&self, module: &str, parameter: &str) -> Option<Value> {
        let parameters = &self.modules.get(module)?.description.parameters;
        parameters.iter().find(|known| known.name == parameter).map(|known| known.default.clone())
    }

    /// Returns true while a module, or the main loop, has not returned.
    pub fn is_late(&self, name: &str) -> bool {
        match self.modules.get(name) {
            Some(loaded) => loaded.cell.is_late(),
            None => self.modules.values().any(|loaded| loaded.cell.is_late()),
        }
    }

    /// Returns the ports of present modules whose links have changed.
    pub fn changed(
        &self,
        configuration: &Configuration,
        survey: &Survey<'_>,
    ) -> SortedMap<usize, SortedSet<LinkEnd>> {
        let mut changed = SortedMap::new();
        for (m, surveyed) in survey.modules.iter().enumerate() {
            let Some(loaded) = self.modules.get(&surveyed.module.name.value) else { continue };
            let new = survey.link_signatures(configuration, m);
            let link_ends: SortedSet<LinkEnd> =
                loaded.links_by_port.keys().chain(new.keys()).copied().collect();
            let link_ends: SortedSet<LinkEnd> = link_ends
                .into_iter()
                .filter(|link_end| loaded.links_by_port.get(link_end) != new.get(link_end))
                .collect();
            if !link_ends.is_empty() {
                changed.insert(m, link_ends);
            }
        }
        changed
    }

    /// Links the modules according to a configuration.
    /// Instances, states and counters are kept. Returns the modules whose sources changed.
    pub fn relink(
        &mut self,
        configuration: &Configuration,
        catalogue: &Catalogue,
        shared: &Arc<SharedLoop>,
    ) -> Result<Vec<String>, Unlinked> {
        let mark = self.resources.mark();
        let mut relinking = Relinking::prepare(self, configuration, catalogue, shared)?;
        if relinking.is_other_than(self)
            && let Err(module) = relinking.exchange(self, shared)
        {
            self.resources.undo(&mark, []);
            return Err(Unlinked::late(&module));
        }
        relinking.show(&self.resources.board);
        Ok(relinking.note(self))
    }

    /// Checks that the links of a survey can be made.
    /// All handles must be available; nothing is changed.
    pub fn try_links(
        &mut self,
        configuration: &Configuration,
        survey: &Survey<'_>,
    ) -> Result<(), Vec<Diagnostic>> {
        let changed = self.changed(configuration, survey);
        if changed.is_empty() {
            return Ok(());
        }
        let mark = self.resources.mark();
        let nobody = SortedSet::new();
        let result =
            rewire(configuration, survey, &mut self.resources, &changed, &nobody, BuildMoment::OnTrial);
        let result = result.map(drop);
        self.resources.undo(&mark, []);
        result
    }
}

/// The modules that read a path.
pub(super) fn listeners(survey: &Survey<'_>) -> SortedMap<String, SortedSet<String>> {
    let owned = |names: &Vec<&str>| names.iter().map(|name| (*name).to_owned()).collect();
    survey.listeners.iter().map(|(path, names)| (path.clone(), owned(names))).collect()
}
