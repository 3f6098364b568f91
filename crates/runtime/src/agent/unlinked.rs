//! Links that a module is in the way of: they are made when it has returned.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use slate_module::Level;

use super::composer::{Composer, WeakComposer};
use super::composition::Composition;
use crate::configuration::{Configuration, Diagnostic, Report};
use crate::main_loop::Shared;
use slate_composition::{Complaints, survey};

/// How often it is looked whether the module has returned.
const LOOK: Duration = Duration::from_millis(20);

/// Why the links are not those of the configuration.
pub(super) struct Unlinked {
    pub report: Report,
    /// What has not returned, if that is all: a module, or the main loop.
    late: Option<String>,
}

impl From<Report> for Unlinked {
    fn from(report: Report) -> Self {
        Self { report, late: None }
    }
}

impl Unlinked {
    pub fn late(name: &str) -> Self {
        let message = format!("`{name}` has not returned from its last call, so no link can change now");
        let help = "try again when it has; `slate module list` shows how it is";
        Self { report: Diagnostic::without_place(message, Some(help.into())).into(), late: Some(name.into()) }
    }

    /// Why a link is not made yet.
    fn reason(&self) -> String {
        match &self.late {
            Some(name) => format!("`{name}` has not returned from its last call"),
            None => self.report.to_string(),
        }
    }
}

impl Composition {
    /// Gives the modules the links of that configuration, or does it when the one that is in the way has returned. Returns
    /// the modules that read something else now.
    pub fn settle_links(&mut self, configuration: &Arc<Configuration>, shared: &Arc<Shared>) -> Vec<String> {
        let before = self.unlinked.take();
        match self.relink(configuration, shared) {
            Ok(modules) => modules,
            Err(unlinked) => {
                let text = unlinked.report.to_string();
                if before.is_none_or(|before| before.report.to_string() != text) {
                    let text = format!("links could not be changed: {text}");
                    shared.logger.log(shared.clock.now(), Level::Error, &text);
                }
                if unlinked.late.is_some() {
                    self.try_again(shared);
                }
                self.unlinked = Some(unlinked);
                Vec::new()
            }
        }
    }

    /// The thread ends when there is nothing more to be tried.
    fn try_again(&mut self, shared: &Shared) {
        if self.is_trying {
            return;
        }
        let composer = self.own.clone();
        let thread = std::thread::Builder::new().name("links".into()).spawn(move || try_again(&composer));
        match thread {
            Ok(_) => self.is_trying = true,
            Err(error) => {
                let text = format!("links wait for the next change, as no thread can be started: {error}");
                shared.logger.log(shared.clock.now(), Level::Error, &text);
            }
        }
    }

    /// Whether what was in the way still is.
    fn is_in_the_way(&self, name: &str) -> bool {
        match self.present.get(name) {
            Some(present) => present.seat.is_late(),
            None => self.present.values().any(|present| present.seat.is_late()),
        }
    }

    /// Why the ports are not linked as the configuration says, by their modules and names.
    pub fn unmade(&self) -> BTreeMap<String, String> {
        let Some(unlinked) = &self.unlinked else { return BTreeMap::new() };
        let configuration = &self.configuration;
        let mut complaints = Complaints::new(configuration);
        let survey = survey(configuration, &self.catalogue, &mut complaints);
        let changed = self.changed(configuration, &survey);
        let ports = changed
            .iter()
            .flat_map(|(module, wires)| wires.iter().map(|wire| survey.wire_path(*module, *wire)));
        ports.map(|port| (port, unlinked.reason())).collect()
    }

    /// Refuses a configuration whose links can't be made now, as a module is in the way.
    fn check_returned(&self, configuration: &Configuration) -> Result<(), Report> {
        let configuration = configuration.with_loaded_of(&self.configuration);
        let mut complaints = Complaints::new(&configuration);
        let survey = survey(&configuration, &self.catalogue, &mut complaints);
        let changed = self.changed(&configuration, &survey);
        let leads = changed.keys().flat_map(|module| survey.leads(&configuration, *module).into_values());
        let writers = leads.flatten().filter_map(|lead| self.owner(&lead.path));
        let readers = changed.keys().map(|module| survey.modules[*module].module.name.value.clone());
        let involved: BTreeSet<String> = readers.chain(writers).collect();
        let late = involved
            .iter()
            .find(|name| self.present.get(*name).is_some_and(|present| present.seat.is_late()));
        late.map_or(Ok(()), |late| Err(Unlinked::late(late).report))
    }
}

impl Composer {
    /// As [`Composition::check_returned`].
    pub(crate) fn check_returned(&self, configuration: &Configuration) -> Result<(), Report> {
        self.composition().check_returned(configuration)
    }
}

fn try_again(composer: &WeakComposer) {
    loop {
        std::thread::sleep(LOOK);
        let Some(composer) = composer.upgrade() else { return };
        let mut composition = composer.composition();
        let late = composition.unlinked.as_ref().and_then(|unlinked| unlinked.late.clone());
        let Some(late) = late else {
            composition.is_trying = false;
            return;
        };
        if !composition.is_in_the_way(&late) {
            let configuration = Arc::clone(&composition.configuration);
            let modules = composition.settle_links(&configuration, &composer.shared);
            composition.note_readers();
            composer.tell_links(&modules);
        }
    }
}
