//! Thread between an agent and its peers.
//! It makes the subscriptions that links need, and reports their status to the agent.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use slate_blackboard::nearest_names;
use slate_module::Level;
use slate_runtime::directory::agents;
use slate_runtime::sharing::{DemandState, RemoteDemand, RemotePath, Site};
use slate_sorted::{SortedMap, SortedSet};

use super::outbox::Outbox;
use super::reading::RemoteReading;
use super::subscriptions::Subscriptions;
use super::{CHANGE_BIT, Demands, SharingRequests, UPDATE_BIT, Warning};
use crate::peers::{Peers, lock};

/// Polling period while an answer is pending, and polling period otherwise.
const ACTIVE_POLL_PERIOD: Duration = Duration::from_millis(10);
const IDLE_POLL_PERIOD: Duration = Duration::from_millis(200);
/// Polling period of the list of agents on this machine.
const AGENT_LIST_PERIOD: Duration = Duration::from_secs(2);
/// Period of the check for conditions that will prevent links, such as expiry.
const WARNING_PERIOD: Duration = Duration::from_secs(3600);
/// Polling period for answers to messages.
const REPLY_POLL_PERIOD: Duration = Duration::from_millis(2);

pub(super) struct Bridge {
    subscriptions: Subscriptions,
    site: Site,
    readings: SortedMap<RemotePath, RemoteReading>,
    outboxes: SortedMap<RemotePath, Outbox>,
    /// Endpoint that each agent is dialed at, or the reason against it.
    dialed: SortedMap<String, Result<String, String>>,
    /// Check for conditions that will prevent links, and the time of its last run, ns.
    warning: Option<Warning>,
    warned: u64,
    /// Suggestions for unknown agents, and the time of each look-up, ns.
    suggestions: SortedMap<String, (u64, String)>,
}

impl Bridge {
    pub fn new(peers: Arc<Peers>, site: Site, warning: Option<Warning>) -> Self {
        Self {
            subscriptions: Subscriptions::new(peers),
            site,
            readings: SortedMap::new(),
            outboxes: SortedMap::new(),
            dialed: SortedMap::new(),
            warning,
            warned: 0,
            suggestions: SortedMap::new(),
        }
    }

    pub fn run(&mut self, requests: &SharingRequests) {
        let mut polled = 0;
        while !requests.ended.load(Ordering::Acquire) {
            let demands = lock(&requests.demands).take();
            if let Some(demands) = demands {
                self.set_demands(demands);
                polled = 0;
            }
            let now = (self.site.steady)();
            let settled = self.readings.values().all(RemoteReading::is_settled);
            let pause = if settled { IDLE_POLL_PERIOD } else { ACTIVE_POLL_PERIOD };
            if now.saturating_sub(polled) >= pause.as_nanos() as u64 || polled == 0 {
                polled = now.max(1);
                self.update_status(now);
                self.warn(now);
            }
            let mut waits = false;
            for outbox in self.outboxes.values_mut() {
                waits |= outbox.forward(&self.subscriptions.peers, &self.site, now);
            }
            let bits = requests.wake.wait_timeout(if waits { REPLY_POLL_PERIOD } else { pause });
            if bits & UPDATE_BIT != 0 {
                self.site.host.news();
            }
            if bits & CHANGE_BIT != 0 {
                polled = 0;
            }
        }
    }

    /// Updates subscriptions and mailboxes to the requested ones.
    fn set_demands(&mut self, demands: Demands) {
        // Those of one property share a subscription, which begins anew when one of them wants something else.
        let changed = self
            .readings
            .iter()
            .filter(|(path, reading)| demands.get(*path).is_some_and(|demand| *demand != reading.demand));
        let changed: SortedSet<(String, String)> =
            changed.map(|(path, reading)| (path.agent.clone(), reading.property().to_owned())).collect();
        let subscriptions = &mut self.subscriptions;
        self.readings.retain(|path, reading| {
            let stays = demands.contains_key(path)
                && !changed.contains(&(path.agent.clone(), reading.property().to_owned()));
            if !stays {
                reading.end(subscriptions);
                if demands.contains_key(path) {
                    // A removed property must not be read any more; its successor is reported as another one.
                    let reason = "it is subscribed to anew, as links want something else of it".into();
                    reading.report(&self.site.host, DemandState::Absent { reason });
                }
            }
            stays
        });
        self.outboxes.retain(|path, _| demands.get(path) == Some(&RemoteDemand::Messages));
        self.forget(&demands);
        for (path, demand) in demands {
            self.dial(&path.agent);
            match demand {
                RemoteDemand::Messages => {
                    self.outboxes.entry(path.clone()).or_insert_with(|| Outbox::new(path));
                }
                RemoteDemand::Values { .. } => {
                    self.readings.entry(path.clone()).or_insert_with(|| RemoteReading::new(path, demand));
                }
            }
        }
    }

    /// Stops dialing agents that no link needs any more.
    fn forget(&mut self, demands: &Demands) {
        let is_wanted = |agent: &String| demands.keys().any(|path| path.agent == *agent);
        // Agents of the team also exchange its knowledge.
        let is_mate = |agent: &String| self.site.knowledge.is_some() && self.site.agents.contains_key(agent);
        for (agent, _) in self.dialed.extract_if(|agent, _| !is_wanted(agent)) {
            self.suggestions.remove(&agent);
            if !is_mate(&agent) {
                self.subscriptions.peers.forget(&agent);
            }
        }
    }

    fn dial(&mut self, agent: &str) {
        if !self.dialed.contains_key(agent) {
            let usual = || format!("local:{agent}");
            let endpoint = self.site.agents.get(agent).cloned().unwrap_or_else(usual);
            let dialed =
                self.subscriptions.peers.connect(agent, &endpoint).map_err(|error| error.to_string());
            self.dialed.insert(agent.into(), dialed.map(|()| endpoint));
        }
    }

    /// Updates the status of all links and reports changes to the agent.
    fn update_status(&mut self, now: u64) {
        let agents: SortedSet<String> = self.dialed.keys().cloned().collect();
        let absences: SortedMap<String, String> = agents
            .into_iter()
            .filter_map(|agent| Some((agent.clone(), self.absence(&agent, now)?)))
            .collect();
        for (path, reading) in &mut self.readings {
            let absence = absences.get(&path.agent).cloned();
            reading.update_status(&mut self.subscriptions, &self.site.host, absence, now);
        }
        for (path, outbox) in &mut self.outboxes {
            let absence = absences.get(&path.agent).cloned();
            outbox.report_status(&self.site.host, absence);
        }
    }

    /// Logs conditions that will prevent links, once per period.
    fn warn(&mut self, now: u64) {
        let Some(warning) = &self.warning else { return };
        if self.warned == 0 || now.saturating_sub(self.warned) >= WARNING_PERIOD.as_nanos() as u64 {
            self.warned = now.max(1);
            if let Some(text) = warning() {
                self.site.host.log(Level::Warn, &text);
            }
        }
    }

    /// Returns the reason why an agent is absent; `None` if it is connected.
    fn absence(&mut self, agent: &str, now: u64) -> Option<String> {
        if self.subscriptions.peers.is_connected(agent) {
            self.suggestions.remove(agent);
            return None;
        }
        let at = match self.dialed.get(agent) {
            Some(Ok(endpoint)) => format!("agent `{agent}` is not reachable at {endpoint}"),
            Some(Err(error)) => return Some(error.clone()),
            None => format!("agent `{agent}` is not reachable"),
        };
        let reason = self.subscriptions.peers.reason(agent);
        let suggestions = self.suggestions(agent, now);
        Some(if reason.is_empty() { at + &suggestions } else { format!("{at}: {reason}{suggestions}") })
    }

    /// Suggests agents for a link to one that the configuration does not mention.
    fn suggestions(&mut self, agent: &str, now: u64) -> String {
        if self.site.agents.contains_key(agent) {
            return String::new();
        }
        if let Some((at, suggestions)) = self.suggestions.get(agent)
            && now.saturating_sub(*at) < AGENT_LIST_PERIOD.as_nanos() as u64
        {
            return suggestions.clone();
        }
        let own = self.site.board.agent();
        let running = agents();
        if running.iter().any(|running| running == agent) {
            return String::new();
        }
        let known: SortedSet<String> = running.into_iter().chain(self.site.agents.keys().cloned()).collect();
        let others = known.iter().map(String::as_str).filter(|known| *known != own && *known != agent);
        let suggestions = match nearest_names(agent, others).join(", ") {
            suggestions if suggestions.is_empty() => suggestions,
            suggestions => format!("; nearest: {suggestions}"),
        };
        self.suggestions.insert(agent.into(), (now, suggestions.clone()));
        suggestions
    }
}
