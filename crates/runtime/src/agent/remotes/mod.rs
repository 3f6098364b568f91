//! Demand of links from other agents, and its state.

mod demands;

use std::sync::PoisonError;

use slate_blackboard::Board;
use slate_sorted::{SortedMap, SortedSet};

use super::assembly::Assembly;
use crate::sharing::{DemandState, Readers, RemoteDemand, RemotePath, Sharing};
use slate_composition::{Catalogue, LinkMismatch, RemoteProperty, remote_path};
use slate_configuration::{Configuration, Link};

/// Relation of the agent to other agents.
#[derive(Default)]
pub(super) struct Remotes {
    /// Transport of values; `None` if the program has none.
    pub sharing: Option<Box<dyn Sharing>>,
    pub started: bool,
    pub demands: SortedMap<RemotePath, RemoteDemand>,
    pub demand_states: SortedMap<RemotePath, DemandState>,
    /// Properties of which links name a field, or the whole.
    /// They stay known while the other agent is absent.
    pub properties: SortedMap<RemotePath, String>,
    /// Reported misfits of links with the properties of other agents.
    reported: SortedMap<String, LinkMismatch>,
    pub readers: Readers,
    epoch: u64,
}

impl Remotes {
    pub fn new(sharing: Option<Box<dyn Sharing>>) -> Self {
        Self { sharing, ..Self::default() }
    }

    /// Returns the reason for which a link to another agent carries nothing, if so.
    pub fn trouble(
        &self,
        configuration: &Configuration,
        link: &Link,
        mismatches: &SortedMap<String, LinkMismatch>,
    ) -> Option<String> {
        let path = remote_path(configuration, link)?;
        if let Some(mismatch) = mismatches.get(&link.to.value) {
            return Some(format!("{} ({})", mismatch.message, mismatch.help));
        }
        match self.demand_states.get(&path) {
            Some(DemandState::Served { .. }) => None,
            Some(DemandState::Absent { reason } | DemandState::Silent { reason, .. }) => Some(reason.clone()),
            None => Some("the other agent has not answered".into()),
        }
    }

    /// Returns the demand of a configuration's links from other agents.
    pub fn demanded(
        &self,
        configuration: &Configuration,
        assembly: &Assembly,
    ) -> SortedMap<RemotePath, RemoteDemand> {
        demands::demands(configuration, &self.properties, &assembly.modules)
    }

    /// Notes that a property of another agent is on the board.
    /// Returns true if links lead to another property now.
    pub fn found(
        &mut self,
        catalogue: &mut Catalogue,
        board: &Board,
        path: &RemotePath,
        property: &str,
    ) -> bool {
        if catalogue.remote.get(path).is_some_and(|known| known.path == property) {
            return false;
        }
        let place = RemotePath { path: property.into(), ..path.clone() }.mirror_path();
        let Some((found, field)) = board.get(&place) else { return false };
        if !field.is_empty() {
            return false;
        }
        self.epoch += 1;
        let (descriptor, epoch) = (found.descriptor(), self.epoch);
        let found = RemoteProperty { path: property.into(), descriptor, part: found.part(), epoch };
        catalogue.remote.insert(path.clone(), found);
        true
    }

    /// Finds the threads that wait for values of other agents.
    pub fn note_readers(&self, assembly: &mut Assembly) {
        let own = |path: &&String| path.starts_with("agents/") || path.starts_with("team/");
        let names: SortedSet<String> = assembly
            .listeners
            .iter()
            .filter(|(path, _)| own(path))
            .flat_map(|(_, names)| names.clone())
            .collect();
        let loaded = &assembly.modules;
        let threaded =
            names.into_iter().filter(|name| loaded.get(name).is_some_and(|loaded| loaded.own_thread));
        let threaded: Vec<String> = threaded.collect();
        let wakes = threaded.iter().map(|name| assembly.resources.signals(name).wake).collect();
        *self.readers.lock().unwrap_or_else(PoisonError::into_inner) = wakes;
    }

    /// Returns messages on links with misfits that were not reported yet.
    /// Such links don't fit the properties of other agents.
    pub fn news(&mut self, mismatches: &SortedMap<String, LinkMismatch>) -> Vec<String> {
        let new = mismatches.iter().filter(|(to, mismatch)| self.reported.get(*to) != Some(*mismatch));
        let text = |(to, mismatch): (&String, &LinkMismatch)| {
            format!("{to} waits: {} ({})", mismatch.message, mismatch.help)
        };
        let news = new.map(text).collect();
        self.reported.clone_from(mismatches);
        news
    }
}
