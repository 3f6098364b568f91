//! Links that a module blocks; they are made when it has returned.

use std::sync::Arc;
use std::time::Duration;

use slate_module::Level;
use slate_sorted::{SortedMap, SortedSet};

use super::Composition;
use crate::agent::assembly::Unlinked;
use crate::sharing::RemotePath;
use slate_composition::{DiagnosticCollector, LinkedConfiguration, survey};
use slate_configuration::{Configuration, Report};
use slate_engine::main_loop::SharedLoop;

/// Polling interval for the return of the module that blocks links.
const POLL_PERIOD: Duration = Duration::from_millis(20);

/// Callback that makes blocked links.
pub(in crate::agent) trait LinkRetry: Send + Sync {
    /// Tries blocked links again; false if none is left, or the agent has ended.
    fn retry(&self) -> bool;
}

/// Links that differ from the configuration.
#[derive(Default)]
pub(in crate::agent) struct WaitingLinks {
    /// Error of the links that are not made.
    /// They are tried again with the next change of the configuration, and when the module that blocks them has
    /// returned.
    pub unlinked: Option<Unlinked>,
    /// True while a thread waits for that module.
    is_trying: bool,
    /// Callback of that thread.
    pub retry: Option<Arc<dyn LinkRetry>>,
}

impl WaitingLinks {
    /// Starts the thread, which ends when no blocked link is left.
    fn try_again(&mut self, shared: &SharedLoop) {
        let Some(retry) = self.retry.clone().filter(|_| !self.is_trying) else { return };
        let work = move || {
            loop {
                std::thread::sleep(POLL_PERIOD);
                if !retry.retry() {
                    return;
                }
            }
        };
        match std::thread::Builder::new().name("links".into()).spawn(work) {
            Ok(_) => self.is_trying = true,
            Err(error) => {
                let text = format!("links wait for the next change, as no thread can be started: {error}");
                shared.logger.log(shared.clock.now(), Level::Error, &text);
            }
        }
    }
}

impl Composition {
    /// Links the modules according to a configuration, now or later.
    /// If a module blocks the links, they are made when it has returned. Returns the modules whose sources changed.
    pub fn settle_links(&mut self, configuration: &Configuration, shared: &Arc<SharedLoop>) -> Vec<String> {
        let before = self.waiting.unlinked.take();
        match self.assembly.relink(configuration, &self.catalogue, shared) {
            Ok(modules) => modules,
            Err(unlinked) => {
                let text = unlinked.report.to_string();
                if before.is_none_or(|before| before.report.to_string() != text) {
                    let text = format!("links could not be changed: {text}");
                    shared.logger.log(shared.clock.now(), Level::Error, &text);
                }
                if unlinked.late.is_some() {
                    self.waiting.try_again(shared);
                }
                self.waiting.unlinked = Some(unlinked);
                Vec::new()
            }
        }
    }

    /// Tries blocked links again; returns the modules whose sources changed.
    /// `None` if no blocked link is left.
    pub fn retry_links(&mut self, shared: &Arc<SharedLoop>) -> Option<Vec<String>> {
        let late = self.waiting.unlinked.as_ref().and_then(|unlinked| unlinked.late.clone());
        let Some(late) = late else {
            self.waiting.is_trying = false;
            return None;
        };
        if self.assembly.is_late(&late) {
            return Some(Vec::new());
        }
        let configuration = Arc::clone(&self.configuration);
        let modules = self.settle_links(&configuration, shared);
        self.note_readers();
        Some(modules)
    }

    /// Finds the threads that wait for values of other agents.
    pub fn note_readers(&mut self) {
        self.remotes.note_readers(&mut self.assembly);
    }

    /// Notes that a property of another agent is on the board.
    /// Returns true if links lead to another property now.
    pub fn remote_found(&mut self, path: &RemotePath, property: &str) -> bool {
        self.remotes.found(&mut self.catalogue, &self.assembly.resources.board, path, property)
    }

    /// Returns the ports whose links differ from the configuration, with reasons.
    /// The ports are named by modules and names.
    pub fn unmade(&self) -> SortedMap<String, String> {
        let Some(unlinked) = &self.waiting.unlinked else { return SortedMap::new() };
        let configuration = &self.configuration;
        let mut diagnostics = DiagnosticCollector::new(configuration);
        let survey = survey(configuration, &self.catalogue, &mut diagnostics);
        let changed = self.assembly.changed(configuration, &survey);
        let ports = changed.iter().flat_map(|(module, link_ends)| {
            link_ends.iter().map(|link_end| survey.end_path(*module, *link_end))
        });
        ports.map(|port| (port, unlinked.reason())).collect()
    }

    /// Returns a configuration with the agent's loaded modules and inferred links.
    /// The loaded modules are those loaded by hand. Ports without a setting any more get their inferred links again.
    pub fn with_inferred_links(&self, configuration: &Configuration) -> LinkedConfiguration {
        let configuration = configuration.with_loaded_of(&self.configuration);
        LinkedConfiguration::after(&configuration, &self.configuration, &self.catalogue)
    }

    /// Refuses a configuration whose links can't be made now.
    /// This is the case if a module that has not returned blocks them.
    pub fn check_returned(&self, configuration: &Configuration) -> Result<(), Report> {
        let linked = self.with_inferred_links(configuration);
        let configuration = &**linked.configuration();
        let mut diagnostics = DiagnosticCollector::new(configuration);
        let survey = survey(configuration, &self.catalogue, &mut diagnostics);
        let changed = self.assembly.changed(configuration, &survey);
        let links_by_port =
            changed.keys().flat_map(|module| survey.link_signatures(configuration, *module).into_values());
        let writers = links_by_port.flatten().filter_map(|lead| self.assembly.owner(&lead.path));
        let readers = changed.keys().map(|module| survey.modules[*module].module.name.value.clone());
        let involved: SortedSet<String> = readers.chain(writers).collect();
        let loaded = &self.assembly.modules;
        let late = involved.iter().find(|name| loaded.get(*name).is_some_and(|loaded| loaded.cell.is_late()));
        late.map_or(Ok(()), |late| Err(Unlinked::late(late).report))
    }
}
