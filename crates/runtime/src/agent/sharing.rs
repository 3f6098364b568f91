//! What links want of other agents, and what becomes of that while they come and go.

mod wants;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, PoisonError};

use slate_module::Level;

use super::composer::Composer;
use super::composition::Composition;
use crate::configuration::{Configuration, Link, Report};
use crate::runner::ModuleCondition;
use crate::sharing::{
    About, Inspection, Readers, RemotePath, Sharing, SharingError, SharingHost, Site, Standing, Want, clocks,
};
use slate_composition::RemoteProperty;
use slate_composition::{Misfit, remote_path};

/// How the agent stands with others.
#[derive(Default)]
pub(super) struct Remotes {
    /// What carries values; nothing when the program has nothing of that kind.
    pub sharing: Option<Box<dyn Sharing>>,
    started: bool,
    wants: BTreeMap<RemotePath, Want>,
    standing: BTreeMap<RemotePath, Standing>,
    /// The properties of which links name fields, or all: they stay known while the other agent is away.
    properties: BTreeMap<RemotePath, String>,
    /// The links that don't fit what is there, as of the last survey, and those that were told.
    pub misfits: BTreeMap<String, Misfit>,
    told: BTreeMap<String, Misfit>,
    readers: Readers,
    epoch: u64,
}

impl Remotes {
    pub fn new(sharing: Option<Box<dyn Sharing>>) -> Self {
        Self { sharing, ..Self::default() }
    }

    /// Why a link brings nothing, if it leads to another agent and does not.
    pub fn trouble(&self, configuration: &Configuration, link: &Link) -> Option<String> {
        let path = remote_path(configuration, link)?;
        if let Some(misfit) = self.misfits.get(&link.to.value) {
            return Some(format!("{} ({})", misfit.message, misfit.help));
        }
        match self.standing.get(&path) {
            Some(Standing::Served { .. }) => None,
            Some(Standing::Absent { reason } | Standing::Silent { reason, .. }) => Some(reason.clone()),
            None => Some("the other agent has not answered".into()),
        }
    }
}

impl Composer {
    /// What is stated has to be there, unless its module is of a plugin that is not loaded.
    pub(super) fn check_facts(&self, configuration: &Configuration) -> Result<(), Report> {
        let composition = self.composition();
        let facts = configuration.share().and_then(|share| share.knowledge.as_ref());
        for (topic, path) in facts.iter().flat_map(|knowledge| &knowledge.facts) {
            let waits = configuration.modules().iter().any(|module| {
                let name = module.name.value.as_str();
                let is_its = path.value.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'));
                is_its && !composition.present.contains_key(name)
            });
            if let Err(error) = self.board().find(&path.value)
                && !waits
            {
                let message = format!("what this robot states about `{topic}`: {error}");
                let help = "name the output of a block that states facts: \"block/output\"".to_owned();
                return Err(configuration.diagnostic(path.span, message, Some(help)).into());
            }
        }
        Ok(())
    }

    /// Tells whoever shares what the links want, and starts it when that is the first.
    pub(super) fn share(&self) -> Result<(), SharingError> {
        let mut composition = self.composition();
        if !composition.remotes.started {
            let wants = wants::wants(&composition);
            let share = composition.configuration.share();
            if share.is_none() && wants.is_empty() {
                return Ok(());
            }
            let [time, steady] = clocks(&self.shared.clock);
            let named = share.map(|share| share.agents.iter());
            let site = Site {
                board: Arc::clone(self.board()),
                listen: share
                    .map(|share| share.listen.iter().map(|at| at.value.clone()).collect())
                    .unwrap_or_default(),
                security: share.and_then(|share| share.security.clone()),
                agents: named
                    .into_iter()
                    .flatten()
                    .map(|(name, at)| (name.clone(), at.value.clone()))
                    .collect(),
                knowledge: share.and_then(|share| share.knowledge.clone()),
                time,
                steady,
                wake: Arc::clone(&composition.ground.sharing_wake),
                host: SharingHost::new(
                    Arc::new(self.downgrade()),
                    Arc::clone(&self.shared.hooks.after_tick),
                    Arc::clone(&composition.remotes.readers),
                ),
            };
            let Some(sharing) = composition.remotes.sharing.as_mut() else {
                return Err(SharingError {
                    message: "this program was built without anything that carries values between agents"
                        .into(),
                    help: None,
                    about: About::Sharing,
                });
            };
            sharing.start(site)?;
            composition.remotes.started = true;
        }
        self.want(&mut composition);
        composition.note_readers();
        self.tell_misfits(&mut composition);
        Ok(())
    }

    /// Says what the links want now.
    fn want(&self, composition: &mut Composition) {
        let wants = wants::wants(composition);
        if wants == composition.remotes.wants {
            return;
        }
        // What is wanted otherwise is put on the board anew.
        let before = composition.catalogue.remote.len();
        composition.catalogue.remote = std::mem::take(&mut composition.catalogue.remote)
            .into_iter()
            .filter(|(path, _)| wants.get(path) == composition.remotes.wants.get(path))
            .collect();
        let Remotes { standing, properties, wants: earlier, .. } = &mut composition.remotes;
        standing.retain(|path, _| wants.get(path) == earlier.get(path));
        properties.retain(|path, _| wants.contains_key(path));
        if composition.catalogue.remote.len() < before {
            self.relink_remote(composition);
        }
        composition.remotes.wants.clone_from(&wants);
        if let Some(sharing) = composition.remotes.sharing.as_mut() {
            sharing.want(wants);
        }
    }

    /// Something that links lead to stands otherwise.
    pub(crate) fn remote_stands(&self, path: &RemotePath, standing: Standing) {
        let mut composition = self.composition();
        let Some(want) = composition.remotes.wants.get(path) else { return };
        if composition.remotes.standing.get(path) == Some(&standing) {
            return;
        }
        let is_values = matches!(want, Want::Values { .. });
        match &standing {
            Standing::Served { .. } => self.log(Level::Info, &format!("{path} is there")),
            Standing::Absent { reason } | Standing::Silent { reason, .. } => {
                self.log(Level::Warn, &format!("{path} is not there: {reason}"));
            }
        }
        if is_values {
            let health = composition.ground.post(&path.to_string()).health;
            health.set(match &standing {
                Standing::Served { .. } => ModuleCondition::WORKING,
                Standing::Absent { .. } | Standing::Silent { .. } => ModuleCondition::UNLOADED,
            });
            let changed = match &standing {
                Standing::Absent { .. } => composition.catalogue.remote.remove(path).is_some(),
                Standing::Served { property } | Standing::Silent { property, .. } => {
                    composition.found(path, property)
                }
            };
            if changed {
                self.relink_remote(&mut composition);
                composition.note_readers();
            }
        }
        let property = match &standing {
            Standing::Served { property } if is_values => Some(property.clone()),
            _ => None,
        };
        composition.remotes.standing.insert(path.clone(), standing);
        if let Some(property) = property
            && composition.remotes.properties.insert(path.clone(), property.clone()) != Some(property)
        {
            // Others may read fields of the same property, and want more of it.
            self.want(&mut composition);
        }
        self.tell_misfits(&mut composition);
    }

    /// The agents of which the configuration says where they are.
    pub(crate) fn named_agents(&self) -> Vec<String> {
        let composition = self.composition();
        let share = composition.configuration.share();
        share.map(|share| share.agents.keys().cloned().collect()).unwrap_or_default()
    }

    /// What looks into other agents; nothing when this one shares nothing.
    pub(crate) fn inspection(&self) -> Option<Arc<dyn Inspection>> {
        self.composition().remotes.sharing.as_ref()?.inspection()
    }

    /// The time of the clock by which the agent shares.
    pub(crate) fn steady_now(&self) -> u64 {
        clocks(&self.shared.clock)[1]()
    }

    fn relink_remote(&self, composition: &mut Composition) {
        let configuration = Arc::clone(&composition.configuration);
        composition.settle_links(&configuration, &self.shared);
    }

    fn tell_misfits(&self, composition: &mut Composition) {
        let Composition { remotes, .. } = composition;
        for (to, misfit) in &remotes.misfits {
            if remotes.told.get(to) != Some(misfit) {
                let text = format!("{to} waits: {} ({})", misfit.message, misfit.help);
                self.log(Level::Error, &text);
            }
        }
        remotes.told.clone_from(&remotes.misfits);
    }

    /// Ends what shares; its threads may be waiting for this composer.
    pub(super) fn end_sharing(&self) {
        let sharing = self.composition().remotes.sharing.take();
        drop(sharing);
    }
}

impl Composition {
    /// A property of another agent is on the board; says whether links lead to another one now.
    fn found(&mut self, path: &RemotePath, property: &str) -> bool {
        if self.catalogue.remote.get(path).is_some_and(|known| known.path == property) {
            return false;
        }
        let place = RemotePath { path: property.into(), ..path.clone() }.place();
        let Some((found, field)) = self.ground.board.get(&place) else { return false };
        if !field.is_empty() {
            return false;
        }
        self.remotes.epoch += 1;
        let (descriptor, epoch) = (found.descriptor(), self.remotes.epoch);
        let found = RemoteProperty { path: property.into(), descriptor, epoch };
        self.catalogue.remote.insert(path.clone(), found);
        true
    }

    /// Finds the threads that wait for values of other agents.
    pub fn note_readers(&mut self) {
        let own = |path: &&String| path.starts_with("agents/") || path.starts_with("team/");
        let names: BTreeSet<String> = self
            .listeners
            .iter()
            .filter(|(path, _)| own(path))
            .flat_map(|(_, names)| names.clone())
            .collect();
        let threaded =
            names.into_iter().filter(|name| self.present.get(name).is_some_and(|present| present.own_thread));
        let threaded: Vec<String> = threaded.collect();
        let wakes = threaded.iter().map(|name| self.ground.post(name).wake).collect();
        *self.remotes.readers.lock().unwrap_or_else(PoisonError::into_inner) = wakes;
    }
}

/// A configuration that names what this program can't do.
pub(super) fn refused(configuration: &Configuration, error: SharingError) -> Report {
    let SharingError { message, help, about } = error;
    let Some(share) = configuration.share() else {
        return crate::configuration::Diagnostic::without_place(message, help).into();
    };
    let credentials = share.security.as_ref().and_then(|security| security.credentials.as_ref());
    let listen =
        share.listen.iter().find(|at| matches!(&about, About::Listen(endpoint) if *endpoint == at.value));
    let place = match &about {
        About::Sharing | About::Listen(_) => listen.map(|at| at.span),
        About::Agent(name) => share.agents.get(name).map(|at| at.span),
        About::Security => share.security.as_ref().map(|security| security.place),
        About::Certificate => credentials.map(|credentials| credentials.certificate.span),
        About::Key => credentials.map(|credentials| credentials.key.span),
        About::Authority => credentials.map(|credentials| credentials.authority.span),
    };
    // An agent is found under its own name when no endpoint is written, and then there is no place to show.
    let usual = configuration.value("share.listen").is_none();
    let is_shown = |place: &_| !usual || share.listen.iter().all(|at| at.span != *place);
    match place.or_else(|| share.listen.first().map(|at| at.span)).filter(is_shown) {
        Some(place) => configuration.diagnostic(place, message, help).into(),
        None => crate::configuration::Diagnostic::without_place(message, help).into(),
    }
}
