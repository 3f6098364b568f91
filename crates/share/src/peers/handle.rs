use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use slate_blackboard::Board;
use slate_blackboard::wake::Wake;
use slate_sorted::SortedMap;

use super::agent_listener::start_listener;
use super::carriers::KnownCarriers;
use super::connection::PeerConnection;
use super::connections::{ConnectionTable, RunningConnection, end_idle};
use super::context::{Clock, Notice, PeerContext, lock};
use super::refusals::Refusals;
use super::{RemoteProperty, Rights, Status, WantedProperty};
use crate::carrier::{Carrier, CarrierError};
use crate::session::{DeliveryStatus, Identity, Limits, SendError};

/// Settings of an agent's sharing.
#[derive(Clone)]
pub struct Setup {
    /// Identity of this agent.
    pub identity: Identity,
    /// Clock of this agent.
    pub clock: Clock,
    /// Clock of its values if it differs, as in a simulation.
    pub time: Option<Clock>,
    /// Limits of a session.
    pub limits: Limits,
    /// Endpoints that it listens at; empty if it only dials.
    pub listen: Vec<String>,
    /// Rights of other agents.
    pub rights: Rights,
    /// Carriers by the prefix of their endpoints, before the colon.
    /// `local` is always available, and so is `tls` where it was built, which carries nothing without certificates.
    pub carriers: SortedMap<String, Arc<dyn Carrier>>,
    /// Polling period of the properties that others read, ns.
    /// `None` if [`Notifier::notify`] is called after every tick.
    pub poll: Option<u64>,
    /// Wake for new values in mirrors and new messages; notified with 1.
    pub updated: Option<Arc<Wake>>,
    /// Callback for events.
    pub notice: Option<Notice>,
}

impl Setup {
    /// Creates settings of an agent that dials, with a polling period of 1 ms.
    pub fn new(identity: Identity, clock: Clock) -> Self {
        Self {
            identity,
            clock,
            time: None,
            limits: Limits::default(),
            listen: Vec::new(),
            rights: Rights::default(),
            carriers: SortedMap::new(),
            poll: Some(1_000_000),
            updated: None,
            notice: None,
        }
    }

    /// Adds an endpoint to listen at.
    #[must_use]
    pub fn listen(mut self, endpoint: &str) -> Self {
        self.listen.push(endpoint.into());
        self
    }
}

impl fmt::Debug for Setup {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Setup").field("identity", &self.identity).field("listen", &self.listen).finish()
    }
}

/// Connections of an agent to the other agents.
/// Dropping them ends the connections and removes the mirrors from the board.
pub struct Peers {
    connections: Arc<ConnectionTable>,
    listeners: Vec<JoinHandle<()>>,
}

impl fmt::Debug for Peers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Peers").field("identity", &self.connections.context.identity).finish_non_exhaustive()
    }
}

/// Error of a request to another agent.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// Unknown name of an agent.
    #[error("unknown agent `{agent}`; known: {}", .known.join(", "))]
    Unknown {
        /// Requested name.
        agent: String,
        /// Known agents.
        known: Vec<String>,
    },
    /// Property that can't be mirrored.
    #[error("slate://{agent}/{path}: {reason}")]
    Subscription {
        /// The other agent.
        agent: String,
        /// The property.
        path: String,
        /// Reason in words.
        reason: String,
    },
    /// Request that can't be sent.
    #[error("agent `{agent}`: {error}{}", reason_suffix(.reason))]
    Send {
        /// The other agent.
        agent: String,
        /// Error.
        error: SendError,
        /// Reason why the agent is absent, if known.
        reason: String,
    },
    /// Missing answer.
    #[error("agent `{agent}`: {reason}")]
    NoAnswer {
        /// The other agent.
        agent: String,
        /// Reason in words.
        reason: String,
    },
}

fn reason_suffix(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!(": {reason}") }
}

/// Handle that wakes the sending threads, so written values are sent at once.
/// The caller never blocks.
#[derive(Clone)]
pub struct Notifier(Arc<ConnectionTable>);

impl Notifier {
    /// Notifies of written values.
    /// Call it at the end of a tick, not for each value.
    pub fn notify(&self) {
        self.0.notify();
    }
}

impl fmt::Debug for Notifier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Notifier")
    }
}

impl Peers {
    /// Starts sharing the properties of a board.
    ///
    /// # Errors
    /// When an endpoint can't be listened at.
    pub fn start(board: &Arc<Board>, setup: Setup) -> Result<Self, CarrierError> {
        let context = PeerContext {
            board: Arc::clone(board),
            identity: setup.identity,
            clock: setup.clock,
            time: setup.time,
            limits: setup.limits,
            rights: setup.rights,
            carriers: KnownCarriers::new(setup.carriers),
            poll: setup.poll,
            updated: setup.updated,
            notice: setup.notice,
            refusals: Mutex::new(Refusals::new(board)),
            ended: AtomicBool::new(false),
        };
        // If one can't be opened, dropping this closes those before.
        let mut peers = Self { connections: Arc::new(ConnectionTable::new(context)), listeners: Vec::new() };
        for endpoint in &setup.listen {
            let agent_listener = start_listener(&peers.connections, endpoint)?;
            peers.listeners.push(agent_listener);
        }
        Ok(peers)
    }

    /// Checks that an endpoint can be dialed, without a connection.
    ///
    /// # Errors
    /// If it is malformed, or always refused.
    pub fn check(&self, endpoint: &str) -> Result<(), CarrierError> {
        self.connections.context.carrier(endpoint)?.check(endpoint)
    }

    /// Dials another agent, repeatedly while it is absent.
    ///
    /// # Errors
    /// When the endpoint makes no sense, the agent may not connect, or no thread can be started.
    pub fn connect(&self, agent: &str, endpoint: &str) -> Result<(), CarrierError> {
        self.dial(agent, endpoint, |connection| connection.dial_at(Some(endpoint)))
    }

    /// Dials another agent for a query.
    /// If it is absent, dialing is repeated for a few seconds. An unused link ends after the same time.
    ///
    /// # Errors
    /// As those of [`connect`](Peers::connect).
    pub fn dial_for_query(&self, agent: &str, endpoint: &str) -> Result<(), CarrierError> {
        self.dial(agent, endpoint, |connection| {
            connection.dial_for_query(endpoint, self.connections.context.now());
        })
    }

    fn dial(
        &self,
        agent: &str,
        endpoint: &str,
        configure: impl FnOnce(&PeerConnection),
    ) -> Result<(), CarrierError> {
        self.connections.context.carrier(endpoint)?;
        let rights = &self.connections.context.rights;
        rights
            .of(&self.connections.context.identity.agent, agent)
            .map_err(|reason| CarrierError::Unsafe { endpoint: endpoint.into(), reason })?;
        let system = |error| CarrierError::System { endpoint: endpoint.into(), error };
        // Within the lock, as a connection without a peer to dial is idle.
        self.connections
            .with_connections(|connections| self.connections.connection_in(connections, agent, configure))
            .map(drop)
            .map_err(system)
    }

    /// Stops dialing another agent.
    /// A present agent stays connected for as long as one of the two needs that. An absent one without subscriptions is
    /// forgotten.
    pub fn forget(&self, agent: &str) {
        let ended = self.connections.with_connections(|connections| {
            if let Some(running) = connections.get(agent) {
                running.connection.dial_at(None);
            }
            end_idle(connections, self.connections.context.now())
        });
        // Removes its mirrors from the board before a new connection of that name; the other thread may be dialing.
        ended.into_iter().for_each(|running| drop(running.sends.join()));
    }

    /// Returns the known other agents, whether connected or not.
    pub fn agents(&self) -> Vec<String> {
        self.connections.with_connections(|connections| connections.keys().cloned().collect())
    }

    /// Returns whether another agent is dialed whenever it is absent.
    pub fn is_dialed(&self, agent: &str) -> bool {
        self.connections.connection(agent).is_some_and(|connection| connection.is_dialed())
    }

    /// Returns whether another agent is connected.
    pub fn is_connected(&self, agent: &str) -> bool {
        self.connections
            .connection(agent)
            .is_some_and(|connection| lock(&connection.peer).session().other().is_some())
    }

    /// Returns the reason why another agent left or was refused; empty if unknown.
    pub fn reason(&self, agent: &str) -> String {
        self.connections.connection(agent).map_or_else(String::new, |connection| connection.reason())
    }

    /// Subscribes to a property of another agent, which may appear later.
    /// Its mirror is at `agents/<agent>/<path>`.
    ///
    /// # Errors
    /// If no agent of that name is known, or the mirror's path is taken.
    pub fn subscribe(&self, agent: &str, want: WantedProperty) -> Result<u32, PeerError> {
        let (connection, path) = (self.connection(agent)?, want.path.clone());
        let subscribed = lock(&connection.peer).subscribe(want);
        connection.wake.notify(1);
        subscribed.map_err(|reason| PeerError::Subscription { agent: agent.into(), path, reason })
    }

    /// Ends a subscription of [`subscribe`](Peers::subscribe).
    pub fn unsubscribe(&self, agent: &str, id: u32) {
        if let Some(connection) = self.connections.connection(agent) {
            lock(&connection.peer).unsubscribe(id);
            connection.wake.notify(1);
        }
    }

    /// Returns the status of a subscription; `None` for an unknown number.
    pub fn status(&self, agent: &str, id: u32) -> Option<Status> {
        lock(&self.connections.connection(agent)?.peer).status(id).cloned()
    }

    /// Sends a message to a mailbox of another agent.
    /// `schema` is that of its interface, `items` the number of its tail items. The receiver yields the answers: first
    /// that it was accepted, then its final status.
    ///
    /// # Errors
    /// When the agent is not there, or too much waits for it: the message is not sent then.
    pub fn send(
        &self,
        agent: &str,
        path: &str,
        schema: u64,
        items: usize,
        bytes: &[u8],
    ) -> Result<Receiver<DeliveryStatus>, PeerError> {
        let connection = self.connection(agent)?;
        let (sender, receiver) = mpsc::channel();
        let mut peer = lock(&connection.peer);
        let ticket = peer.send(path, schema, items, bytes).map_err(|error| send_error(&connection, error))?;
        lock(&connection.waiting).answers.insert(ticket, sender);
        drop(peer);
        connection.wake.notify(1);
        Ok(receiver)
    }

    /// Sends a message of the team's knowledge to another agent.
    /// It arrives as a [`PeerEvent::Knowledge`](super::PeerEvent::Knowledge) or not at all.
    /// Returns false if it is lost already.
    pub fn send_knowledge(&self, agent: &str, message: &[u8]) -> bool {
        let Some(connection) = self.connections.connection(agent) else { return false };
        let sent = lock(&connection.peer).send_knowledge(message);
        connection.wake.notify(1);
        sent
    }

    /// Lists the properties of another agent that match a pattern.
    /// With `values`, their newest values are included.
    ///
    /// # Errors
    /// When the agent is not there, or does not answer within `limit`.
    pub fn list(
        &self,
        agent: &str,
        pattern: &str,
        values: bool,
        limit: Duration,
    ) -> Result<Vec<RemoteProperty>, PeerError> {
        let connection = self.connection(agent)?;
        let (sender, receiver) = mpsc::channel();
        let mut peer = lock(&connection.peer);
        let request = peer.query(pattern, values).map_err(|error| send_error(&connection, error))?;
        lock(&connection.waiting).lists.insert(request, sender);
        drop(peer);
        connection.wake.notify(1);
        let no_answer = |reason| PeerError::NoAnswer { agent: agent.into(), reason };
        match receiver.recv_timeout(limit) {
            Ok(answer) => answer.map_err(no_answer),
            Err(_) => {
                lock(&connection.peer).cancel_query(request);
                lock(&connection.waiting).lists.remove(&request);
                Err(no_answer(format!("it has not answered within {} ms", limit.as_millis())))
            }
        }
    }

    /// Returns a handle that wakes the sending threads.
    pub fn notifier(&self) -> Notifier {
        Notifier(Arc::clone(&self.connections))
    }

    fn connection(&self, agent: &str) -> Result<Arc<PeerConnection>, PeerError> {
        self.connections
            .connection(agent)
            .ok_or_else(|| PeerError::Unknown { agent: agent.into(), known: self.agents() })
    }
}

fn send_error(connection: &PeerConnection, error: SendError) -> PeerError {
    PeerError::Send { agent: connection.agent.clone(), error, reason: connection.explanation() }
}

impl Drop for Peers {
    fn drop(&mut self) {
        self.connections.context.ended.store(true, Ordering::Release);
        let connections = self.connections.with_connections(std::mem::take);
        connections.values().for_each(|running| running.connection.end());
        for RunningConnection { connection, sends, receives } in connections.into_values() {
            // A thread that panicked has ended, too.
            drop(sends.join());
            // A search for a remote agent takes seconds; the caller may have given up then.
            if !connection.is_dialing.load(Ordering::SeqCst) {
                drop(receives.join());
            }
            lock(&connection.peer).remove_mirrors();
        }
        self.listeners.drain(..).for_each(|agent_listener| drop(agent_listener.join()));
    }
}
