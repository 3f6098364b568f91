//! Arrival and departure of modules.

use std::sync::Arc;

use slate_module::{Description, Level};
use slate_sorted::{SortedMap, SortedSet};

use super::{Assembly, LoadedModule};
use crate::agent::build::{ResourceMark, build};
use slate_composition::{RESERVED, Survey};
use slate_configuration::{Configuration, Report};
use slate_engine::main_loop::{RunnerCell, SharedLoop};

/// States of modules by name; errors for those that could not be saved.
pub(in crate::agent) type ModuleStates = SortedMap<String, Result<Vec<u8>, String>>;

/// New modules.
pub(in crate::agent) struct Arrivals {
    pub names: Vec<String>,
    /// Modules that received a state, or the reason for which it did not fit.
    pub restored: SortedMap<String, Result<(), String>>,
    /// Paths and actuators before the arrival.
    before: ResourceMark,
}

impl Assembly {
    /// Makes the missing modules of a survey, with their states.
    /// If one of them can't be made, all of them are removed.
    pub fn admit(
        &mut self,
        configuration: &Configuration,
        survey: &Survey<'_>,
        states: &ModuleStates,
    ) -> Result<Arrivals, Report> {
        let name = |index: &usize| survey.modules[*index].module.name.value.as_str();
        let arriving: Vec<usize> =
            (0..survey.modules.len()).filter(|index| !self.modules.contains_key(name(index))).collect();
        let before = self.resources.mark();
        let built = build(configuration, survey, &mut self.resources, &arriving);
        let mut runners = built.map_err(|diagnostics| {
            self.resources.undo(&before, arriving.iter().map(name));
            Report::from(diagnostics)
        })?;
        let mut restored = SortedMap::new();
        for runner in &mut runners {
            let Some(Ok(state)) = states.get(&*runner.name) else { continue };
            restored.insert(runner.name.to_string(), runner.restore(state));
        }
        for (index, runner) in arriving.iter().zip(runners) {
            let surveyed = &survey.modules[*index];
            let isolation = runner.supervised.as_ref().map(|supervised| Arc::clone(&supervised.isolation));
            let loaded = LoadedModule {
                cell: Arc::new(RunnerCell::new(runner)),
                kind: surveyed.kind.clone(),
                description: Arc::new(surveyed.description.clone()),
                own_thread: self.resources.has_own_thread(surveyed),
                isolation,
                links_by_port: survey.link_signatures(configuration, *index),
            };
            self.modules.insert(name(index).to_owned(), loaded);
        }
        Ok(Arrivals {
            names: arriving.iter().map(|index| name(index).to_owned()).collect(),
            restored,
            before,
        })
    }

    /// Removes the modules that a survey lacks, and returns them.
    pub fn take_leaving(&mut self, survey: &Survey<'_>) -> SortedMap<String, LoadedModule> {
        let stays: SortedSet<&str> =
            survey.modules.iter().map(|surveyed| surveyed.module.name.value.as_str()).collect();
        let (staying, leaving) = std::mem::take(&mut self.modules)
            .into_iter()
            .partition(|(name, _)| stays.contains(name.as_str()));
        self.modules = staying;
        leaving
    }

    /// Arms the new actuators; a latched stop keeps them disarmed.
    pub fn arm(&self, arrivals: &Arrivals) {
        let actuators = self.resources.actuators.values();
        actuators.filter(|actuator| !arrivals.before.has_actuator(actuator.name())).for_each(|actuator| {
            actuator.arm();
        });
    }

    /// Starts the threads of new modules of a running agent.
    pub fn start_arrived(&self, arrivals: &Arrivals, shared: &Arc<SharedLoop>) {
        for name in &arrivals.names {
            let loaded = &self.modules[name];
            if loaded.own_thread
                && shared.run.is_running()
                && let Err(error) = shared.threads().start(shared, &loaded.cell)
            {
                let text = format!("the thread of {name} can't be started: {error}");
                shared.logger.log(shared.clock.now(), Level::Error, &text);
            }
        }
    }

    /// Ends removed modules; returns their states if `keep` is true.
    pub fn dispose(
        &mut self,
        leaving: SortedMap<String, LoadedModule>,
        shared: &SharedLoop,
        keep: bool,
    ) -> ModuleStates {
        let ended = leaving.into_iter().map(|(name, loaded)| {
            self.last_known.insert(name.clone(), Description::clone(&loaded.description));
            let state = loaded.dispose(&name, &mut self.resources, shared, keep);
            (name, state)
        });
        ended.collect()
    }

    /// Removes the properties of modules that have left from the board.
    /// Properties with other readers stay.
    pub fn forget(&mut self, absent: &SortedSet<&str>, left: &SortedMap<String, Result<Vec<u8>, String>>) {
        for name in left.keys() {
            for path in self.resources.paths() {
                let own = path.strip_prefix(name.as_str()).and_then(|rest| rest.strip_prefix('/'));
                let is_of_another = self.modules.keys().any(|other| path.starts_with(&format!("{other}/")));
                if own.is_none() || is_of_another || absent.contains(path.as_str()) {
                    continue;
                }
                // The state of a module that has left says so.
                if own != Some(RESERVED[2]) {
                    // Nothing else removes it.
                    let _ = self.resources.board.remove(&path);
                }
            }
        }
    }
}
