//! Links to other agents: their demand, and its state as agents come and go.

use std::sync::Arc;

use slate_module::Level;

use super::composition::Composition;
use super::handle::{AgentHandle, WeakHandle};
use super::remotes::Remotes;
use crate::sharing::{
    About, DemandState, Inspection, RemoteDemand, RemotePath, SharingAgent, SharingError, SharingHost, Site,
    TeamExchange, clocks,
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
            let demands = composition.remotes.demanded(&composition.configuration, &composition.assembly);
            let share = composition.configuration.share();
            if share.is_none() && demands.is_empty() {
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
        self.update_demands(&mut composition);
        composition.note_readers();
        self.log_mismatches(&mut composition);
        Ok(())
    }

    /// Updates the demand of the links.
    fn update_demands(&self, composition: &mut Composition) {
        let demands = composition.remotes.demanded(&composition.configuration, &composition.assembly);
        if demands == composition.remotes.demands {
            return;
        }
        // Properties with changed demands are created anew.
        let before = composition.catalogue.remote.len();
        composition.catalogue.remote = std::mem::take(&mut composition.catalogue.remote)
            .into_iter()
            .filter(|(path, _)| demands.get(path) == composition.remotes.demands.get(path))
            .collect();
        let Remotes { demand_states, properties, demands: earlier, .. } = &mut composition.remotes;
        demand_states.retain(|path, _| demands.get(path) == earlier.get(path));
        properties.retain(|path, _| demands.contains_key(path));
        if composition.catalogue.remote.len() < before {
            self.relink_remote(composition);
        }
        composition.remotes.demands.clone_from(&demands);
        if let Some(sharing) = composition.remotes.sharing.as_mut() {
            sharing.set_demands(demands);
        }
    }

    /// Notes a new state of the remote end of links.
    pub fn set_demand_state(&self, path: &RemotePath, state: DemandState) {
        let mut composition = self.agent.composition();
        let Some(demand) = composition.remotes.demands.get(path) else { return };
        if composition.remotes.demand_states.get(path) == Some(&state) {
            return;
        }
        let is_values = matches!(demand, RemoteDemand::Values { .. });
        match &state {
            DemandState::Served { .. } => self.agent.log(Level::Info, &format!("{path} is there")),
            DemandState::Absent { reason } | DemandState::Silent { reason, .. } => {
                self.agent.log(Level::Warn, &format!("{path} is unavailable: {reason}"));
            }
        }
        if is_values {
            let health = composition.assembly.resources.signals(&path.to_string()).health;
            health.set(match &state {
                DemandState::Served { .. } => ModuleCondition::WORKING,
                DemandState::Absent { .. } | DemandState::Silent { .. } => ModuleCondition::UNLOADED,
            });
            let changed = match &state {
                DemandState::Absent { .. } => composition.catalogue.remote.remove(path).is_some(),
                DemandState::Served { property } | DemandState::Silent { property, .. } => {
                    composition.remote_found(path, property)
                }
            };
            if changed {
                self.relink_remote(&mut composition);
                composition.note_readers();
            }
        }
        let property = match &state {
            DemandState::Served { property } if is_values => Some(property.clone()),
            _ => None,
        };
        composition.remotes.demand_states.insert(path.clone(), state);
        if let Some(property) = property
            && composition.remotes.properties.insert(path.clone(), property.clone()) != Some(property)
        {
            // Others may read fields of the same property, and want more of it.
            self.update_demands(&mut composition);
        }
        self.log_mismatches(&mut composition);
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

    fn log_mismatches(&self, composition: &mut Composition) {
        let Composition { remotes, assembly, .. } = composition;
        for text in remotes.news(&assembly.mismatches) {
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
    fn set_demand_state(&self, path: &RemotePath, state: DemandState) {
        if let Some(agent) = self.upgrade() {
            RemoteLinks::new(&agent).set_demand_state(path, state);
        }
    }

    fn log(&self, level: Level, text: &str) {
        if let Some(agent) = self.upgrade() {
            agent.log(level, text);
        }
    }
}
