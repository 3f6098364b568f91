//! Knowledge of a team over the network.

use std::sync::{Arc, Mutex};

use slate_module::Level;
use slate_runtime::sharing::{TeamCarrier, TeamExchange};
use slate_sorted::SortedSet;
use zenoh::bytes::Encoding;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};

use crate::error::NetworkError;
use crate::key::{agent_before, team_key, team_token_key};
use crate::shared::{NetworkShared, locked, refused};

/// Maximum size of a message, bytes.
const MAX_MESSAGE_SIZE: usize = 64 << 10;

/// Participation of an agent in its team over a network, until dropped.
/// The team repeats lost messages, so none of them waits.
pub struct NetworkTeam {
    peers: Arc<TeamPeers>,
    /// Dropped before the subscriptions.
    _token: LivelinessToken,
    _subscribers: [Subscriber<()>; 2],
}

/// Agents of the team that are on the network.
struct TeamPeers {
    shared: Arc<NetworkShared>,
    exchange: Arc<dyn TeamExchange>,
    present: Mutex<SortedSet<String>>,
}

/// Sends messages to other agents of the team.
struct TeamSender {
    session: Session,
    agent: String,
}

impl NetworkTeam {
    /// Takes part, if the settings say so.
    ///
    /// # Errors
    /// When the agent takes no part in a team, or Zenoh refuses it.
    pub fn start(shared: &Arc<NetworkShared>) -> Result<Option<Self>, NetworkError> {
        let place = shared.settings.team;
        if place.is_none() {
            return Ok(None);
        }
        let exchange = shared.surface.agent.composer().team().ok_or(NetworkError::Team { place })?;
        let (session, agent) = (&shared.session, shared.board().agent());
        let peers = Arc::new(TeamPeers { shared: Arc::clone(shared), exchange, present: Mutex::default() });
        let (receiver, observer) = (Arc::clone(&peers), Arc::clone(&peers));
        let messages = session.declare_subscriber(team_key("*", agent));
        let messages = messages.callback(move |sample| receiver.receive(&sample)).wait().map_err(refused)?;
        let tokens = session.liveliness().declare_subscriber(team_token_key("*")).history(true);
        let tokens = tokens.callback(move |sample| observer.note(&sample)).wait().map_err(refused)?;
        let sender = TeamSender { session: session.clone(), agent: agent.into() };
        peers.exchange.set_carrier(Some(Arc::new(sender)));
        // The token comes last: peers send as soon as it appears.
        let token = session.liveliness().declare_token(team_token_key(agent)).wait().map_err(refused)?;
        Ok(Some(Self { peers, _token: token, _subscribers: [messages, tokens] }))
    }
}

impl Drop for NetworkTeam {
    fn drop(&mut self) {
        self.peers.exchange.set_carrier(None);
        let present = std::mem::take(&mut *locked(&self.peers.present));
        present.iter().for_each(|agent| self.peers.exchange.part(agent));
    }
}

impl TeamPeers {
    /// Returns the peer that may send team messages by that key.
    fn peer<'k>(&self, key: &'k str, end: &str) -> Option<&'k str> {
        let agent = agent_before(key, end).filter(|agent| *agent != self.shared.board().agent())?;
        self.shared.settings.is_team_peer(agent).then_some(agent)
    }

    fn receive(&self, sample: &Sample) {
        let end = format!("@team/{}", self.shared.board().agent());
        if let Some(agent) = self.peer(sample.key_expr().as_str(), &end)
            && sample.kind() == SampleKind::Put
            && sample.payload().len() <= MAX_MESSAGE_SIZE
        {
            self.exchange.receive(agent, sample.payload().to_bytes().into_owned());
        }
    }

    /// Updates the team when an agent appears or vanishes.
    fn note(&self, sample: &Sample) {
        let Some(agent) = self.peer(sample.key_expr().as_str(), "@team") else { return };
        let is_present = sample.kind() == SampleKind::Put;
        let changed = match is_present {
            true => locked(&self.present).insert(agent.into()),
            false => locked(&self.present).remove(agent),
        };
        match is_present {
            true => self.exchange.meet(agent),
            false => self.exchange.part(agent),
        }
        if changed {
            let state = if is_present { "takes part in the team" } else { "has left the team" };
            self.shared.log(Level::Info, &format!("agent `{agent}` {state}"));
        }
    }
}

impl TeamCarrier for TeamSender {
    fn send(&self, robot: &str, message: &[u8]) -> bool {
        // Everything else precedes it, and a full link drops it.
        let put = self.session.put(team_key(&self.agent, robot), message.to_vec());
        let put = put.encoding(Encoding::APPLICATION_OCTET_STREAM).priority(Priority::DataLow);
        put.congestion_control(CongestionControl::Drop).wait().is_ok()
    }
}
