//! Inspection of other agents for tools.

use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use slate_blackboard::nearest_names;
use slate_runtime::directory::agents;
use slate_runtime::sharing::{Inspection, RemoteProperty};
use slate_sorted::{SortedMap, SortedSet};

use crate::peers::Peers;

/// Polling period for the arrival of an agent that was not dialed before.
const CONNECT_POLL_PERIOD: Duration = Duration::from_millis(5);

/// Inspector of other agents: link targets, configured agents and incoming ones.
#[derive(Debug)]
pub(super) struct Inspector {
    /// Weak reference to the peers.
    peers: Weak<Peers>,
    endpoints: SortedMap<String, String>,
}

impl Inspector {
    pub fn new(peers: &Arc<Peers>, endpoints: SortedMap<String, String>) -> Self {
        Self { peers: Arc::downgrade(peers), endpoints }
    }

    /// Dials an agent that only the configuration names, or that runs on this machine.
    /// The error says that no agent of that name is known.
    fn dial(&self, peers: &Peers, agent: &str) -> Result<(), String> {
        if peers.is_dialed(agent) {
            return Ok(());
        }
        let usual = || agents().iter().any(|here| here == agent).then(|| format!("local:{agent}"));
        if let Some(endpoint) = self.endpoints.get(agent).cloned().or_else(usual) {
            return peers.dial_for_query(agent, &endpoint).map_err(|error| error.to_string());
        }
        let known = peers.agents();
        if known.iter().any(|known| known == agent) {
            return Ok(());
        }
        let names: SortedSet<&str> = known.iter().chain(self.endpoints.keys()).map(String::as_str).collect();
        let near = nearest_names(agent, names.iter().copied());
        let others = match (names.is_empty(), near.is_empty()) {
            (true, _) => "none is known".to_owned(),
            (_, false) => format!("nearest: {}", near.join(", ")),
            _ => format!("known: {}", names.into_iter().collect::<Vec<_>>().join(", ")),
        };
        Err(format!("this agent knows no agent `{agent}`; {others}"))
    }
}

impl Inspection for Inspector {
    #[allow(clippy::disallowed_methods, reason = "tools wait on the wall clock")]
    fn list(
        &self,
        agent: &str,
        pattern: &str,
        values: bool,
        limit: Duration,
    ) -> Result<Vec<RemoteProperty>, String> {
        let start = Instant::now();
        let peers = self.peers.upgrade().ok_or("the agent ends")?;
        self.dial(&peers, agent)?;
        while !peers.is_connected(agent) && start.elapsed() < limit {
            std::thread::sleep(CONNECT_POLL_PERIOD);
        }
        let left = limit.saturating_sub(start.elapsed());
        peers.list(agent, pattern, values, left).map_err(|error| error.to_string())
    }
}
