//! Links to other agents: their demand, and its state as agents come and go.

use std::sync::Arc;

use slate_module::Level;

use super::composition::Composition;
use super::handle::{AgentHandle, WeakHandle};
use super::remotes::Remotes;
use crate::sharing::{
    About, Inspection, RemotePath, SharingAgent, SharingError, SharingHost, Site, Standing, TeamExchange,
    Want, clocks,
};
use slate_engine::runner::ModuleCondition;

/// Relation of an agent to other agents.
pub(super) struct RemoteLinks<'c> {
    agent: &'c AgentHandle,
}

impl<'c> RemoteLinks<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Sends the links' demand to the sharing; the first call starts it.
    pub fn share(&self) -> Result<(), SharingError> {
        let mut composition = self.agent.composition();
        if !composition.remotes.started {
            let wants = composition.remotes.wanted(&composition.configuration, &composition.assembly);
            let share = composition.configuration.share();
            if share.is_none() && wants.is_empty() {
                return Ok(());
            }
            let [time, steady] = clocks(&self.agent.shared.clock);
            let named = share.map(|share| share.agents.iter());
            let site = Site {
                board: Arc::clone(self.agent.board()),
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
                wake: Arc::clone(&composition.assembly.resources.sharing_wake),
                host: SharingHost::new(
                    Arc::new(self.agent.downgrade()),
                    Arc::clone(&self.agent.shared.hooks.after_tick),
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

    /// Updates the demand of the links.
    fn want(&self, composition: &mut Composition) {
        let wants = composition.remotes.wanted(&composition.configuration, &composition.assembly);
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

    /// Notes a new state of the remote end of links.
    pub fn remote_stands(&self, path: &RemotePath, standing: Standing) {
        let mut composition = self.agent.composition();
        let Some(want) = composition.remotes.wants.get(path) else { return };
        if composition.remotes.standing.get(path) == Some(&standing) {
            return;
        }
        let is_values = matches!(want, Want::Values { .. });
        match &standing {
            Standing::Served { .. } => self.agent.log(Level::Info, &format!("{path} is there")),
            Standing::Absent { reason } | Standing::Silent { reason, .. } => {
                self.agent.log(Level::Warn, &format!("{path} is not there: {reason}"));
            }
        }
        if is_values {
            let health = composition.assembly.resources.signals(&path.to_string()).health;
            health.set(match &standing {
                Standing::Served { .. } => ModuleCondition::WORKING,
                Standing::Absent { .. } | Standing::Silent { .. } => ModuleCondition::UNLOADED,
            });
            let changed = match &standing {
                Standing::Absent { .. } => composition.catalogue.remote.remove(path).is_some(),
                Standing::Served { property } | Standing::Silent { property, .. } => {
                    composition.remote_found(path, property)
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

    /// Names of the agents with an endpoint in the configuration.
    pub fn named_agents(&self) -> Vec<String> {
        let composition = self.agent.composition();
        let share = composition.configuration.share();
        share.map(|share| share.agents.keys().cloned().collect()).unwrap_or_default()
    }

    /// Inspection of other agents; `None` if this agent shares nothing.
    pub fn inspection(&self) -> Option<Arc<dyn Inspection>> {
        self.agent.composition().remotes.sharing.as_ref()?.inspection()
    }

    /// The agent's part in its team's knowledge; `None` if it takes no part.
    pub fn team(&self) -> Option<Arc<dyn TeamExchange>> {
        self.agent.composition().remotes.sharing.as_ref()?.team()
    }

    /// Present time of the sharing's monotonic clock, ns.
    pub fn steady_now(&self) -> u64 {
        clocks(&self.agent.shared.clock)[1]()
    }

    fn relink_remote(&self, composition: &mut Composition) {
        let configuration = Arc::clone(&composition.configuration);
        composition.settle_links(&configuration, &self.agent.shared);
    }

    fn tell_misfits(&self, composition: &mut Composition) {
        let Composition { remotes, assembly, .. } = composition;
        for text in remotes.news(&assembly.misfits) {
            self.agent.log(Level::Error, &text);
        }
    }

    /// Ends the sharing; its threads may be waiting for this composer.
    pub fn end_sharing(&self) {
        let sharing = self.agent.composition().remotes.sharing.take();
        drop(sharing);
    }
}

impl SharingAgent for WeakHandle {
    fn remote_stands(&self, path: &RemotePath, standing: Standing) {
        if let Some(agent) = self.upgrade() {
            RemoteLinks::new(&agent).remote_stands(path, standing);
        }
    }

    fn log(&self, level: Level, text: &str) {
        if let Some(agent) = self.upgrade() {
            agent.log(level, text);
        }
    }
}
