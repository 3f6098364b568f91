//! Knowledge of a team over the network.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

use slate_module::Level;
use slate_runtime::sharing::{TeamCarrier, TeamExchange};
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
const LONGEST: usize = 64 << 10;

/// Participation of an agent in its team over a network, until dropped.
/// The team repeats lost messages, so none of them waits.
pub struct NetworkTeam {
    mates: Arc<TeamMates>,
    /// Goes before the subscriptions.
    _token: LivelinessToken,
    _subscribers: [Subscriber<()>; 2],
}

/// Agents of the team that are on the network.
struct TeamMates {
    shared: Arc<NetworkShared>,
    exchange: Arc<dyn TeamExchange>,
    present: Mutex<BTreeSet<String>>,
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
        let mates = Arc::new(TeamMates { shared: Arc::clone(shared), exchange, present: Mutex::default() });
        let (hearing, watching) = (Arc::clone(&mates), Arc::clone(&mates));
        let messages = session.declare_subscriber(team_key("*", agent));
        let messages = messages.callback(move |sample| hearing.hear(&sample)).wait().map_err(refused)?;
        let tokens = session.liveliness().declare_subscriber(team_token_key("*")).history(true);
        let tokens = tokens.callback(move |sample| watching.note(&sample)).wait().map_err(refused)?;
        let sender = TeamSender { session: session.clone(), agent: agent.into() };
        mates.exchange.set_carrier(Some(Arc::new(sender)));
        // Last, so that the messages of others arrive when it appears.
        let token = session.liveliness().declare_token(team_token_key(agent)).wait().map_err(refused)?;
        Ok(Some(Self { mates, _token: token, _subscribers: [messages, tokens] }))
    }
}

impl Drop for NetworkTeam {
    fn drop(&mut self) {
        self.mates.exchange.set_carrier(None);
        let present = std::mem::take(&mut *locked(&self.mates.present));
        present.iter().for_each(|agent| self.mates.exchange.part(agent));
    }
}

impl TeamMates {
    /// Returns the agent that may send team messages by that key.
    fn mate<'k>(&self, key: &'k str, end: &str) -> Option<&'k str> {
        let agent = agent_before(key, end).filter(|agent| *agent != self.shared.board().agent())?;
        self.shared.settings.is_team_mate(agent).then_some(agent)
    }

    fn hear(&self, sample: &Sample) {
        let end = format!("@team/{}", self.shared.board().agent());
        if let Some(agent) = self.mate(sample.key_expr().as_str(), &end)
            && sample.kind() == SampleKind::Put
            && sample.payload().len() <= LONGEST
        {
            self.exchange.hear(agent, sample.payload().to_bytes().into_owned());
        }
    }

    /// Updates the team when an agent has come or gone.
    fn note(&self, sample: &Sample) {
        let Some(agent) = self.mate(sample.key_expr().as_str(), "@team") else { return };
        let is_here = sample.kind() == SampleKind::Put;
        let changed = match is_here {
            true => locked(&self.present).insert(agent.into()),
            false => locked(&self.present).remove(agent),
        };
        match is_here {
            true => self.exchange.meet(agent),
            false => self.exchange.part(agent),
        }
        if changed {
            let state = if is_here { "takes part in the team" } else { "has left the team" };
            self.shared.log(Level::Info, &format!("agent `{agent}` {state}"));
        }
    }
}

impl TeamCarrier for TeamSender {
    fn tell(&self, robot: &str, message: &[u8]) -> bool {
        // Behind everything else; a full link drops it.
        let put = self.session.put(team_key(&self.agent, robot), message.to_vec());
        let put = put.encoding(Encoding::APPLICATION_OCTET_STREAM).priority(Priority::DataLow);
        put.congestion_control(CongestionControl::Drop).wait().is_ok()
    }
}
