use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use slate_blackboard::Board;
use slate_blackboard::wake::Wake;

use super::carriers::KnownCarriers;
use super::context::{Clock, Notice, PeerContext, locked};
use super::line::PeerLine;
use super::lines::{LineTable, ServedLine, end_idle};
use super::listener::open_listener;
use super::refusals::Refusals;
use super::{RemoteProperty, Rights, Status, Want};
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
    pub carriers: BTreeMap<String, Arc<dyn Carrier>>,
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
            carriers: BTreeMap::new(),
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
    lines: Arc<LineTable>,
    listeners: Vec<JoinHandle<()>>,
}

impl fmt::Debug for Peers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Peers").field("identity", &self.lines.context.identity).finish_non_exhaustive()
    }
}

/// Error of a request to another agent.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// Unknown name of an agent.
    #[error("no agent `{agent}` is known; known are: {}", .known.join(", "))]
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
    #[error("agent `{agent}`: {error}{}", because(.reason))]
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

fn because(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!(": {reason}") }
}

/// Handle that wakes the sending threads, so written values are sent at once.
/// The caller never blocks.
#[derive(Clone)]
pub struct Notifier(Arc<LineTable>);

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
        let mut peers = Self { lines: Arc::new(LineTable::new(context)), listeners: Vec::new() };
        for endpoint in &setup.listen {
            let listener = open_listener(&peers.lines, endpoint)?;
            peers.listeners.push(listener);
        }
        Ok(peers)
    }

    /// Checks that an endpoint can be dialled, without a connection.
    ///
    /// # Errors
    /// If it is malformed, or always refused.
    pub fn check(&self, endpoint: &str) -> Result<(), CarrierError> {
        self.lines.context.carrier(endpoint)?.check(endpoint)
    }

    /// Dials another agent, repeatedly while it is absent.
    ///
    /// # Errors
    /// When the endpoint makes no sense, the agent may not connect, or no thread can be started.
    pub fn connect(&self, agent: &str, endpoint: &str) -> Result<(), CarrierError> {
        self.dial(agent, endpoint, |line| line.dial_at(Some(endpoint)))
    }

    /// Dials another agent for a query.
    /// If it is absent, dialling is repeated for a few seconds. An unused link ends after the same time.
    ///
    /// # Errors
    /// As those of [`connect`](Peers::connect).
    pub fn visit(&self, agent: &str, endpoint: &str) -> Result<(), CarrierError> {
        self.dial(agent, endpoint, |line| line.visit(endpoint, self.lines.context.now()))
    }

    fn dial(&self, agent: &str, endpoint: &str, how: impl FnOnce(&PeerLine)) -> Result<(), CarrierError> {
        self.lines.context.carrier(endpoint)?;
        let rights = &self.lines.context.rights;
        rights
            .of(&self.lines.context.identity.agent, agent)
            .map_err(|reason| CarrierError::Unsafe { endpoint: endpoint.into(), reason })?;
        let system = |error| CarrierError::System { endpoint: endpoint.into(), error };
        // Within the lock, as a line that dials nobody is idle.
        self.lines.with_lines(|lines| self.lines.line_in(lines, agent, how)).map(drop).map_err(system)
    }

    /// Stops dialling another agent.
    /// A present agent stays connected for as long as one of the two needs that. An absent one without subscriptions is
    /// forgotten.
    pub fn forget(&self, agent: &str) {
        let ended = self.lines.with_lines(|lines| {
            if let Some(served) = lines.get(agent) {
                served.line.dial_at(None);
            }
            end_idle(lines, self.lines.context.now())
        });
        // It takes what it shows off the board, before another one of that name comes; the other may be dialling.
        ended.into_iter().for_each(|served| drop(served.sends.join()));
    }

    /// Returns the known other agents, whether connected or not.
    pub fn agents(&self) -> Vec<String> {
        self.lines.with_lines(|lines| lines.keys().cloned().collect())
    }

    /// Returns whether another agent is dialled whenever it is absent.
    pub fn is_dialled(&self, agent: &str) -> bool {
        self.lines.line(agent).is_some_and(|line| line.is_dialled())
    }

    /// Returns whether another agent is connected.
    pub fn is_connected(&self, agent: &str) -> bool {
        self.lines.line(agent).is_some_and(|line| locked(&line.peer).session().other().is_some())
    }

    /// Returns the reason why another agent left or was refused; empty if unknown.
    pub fn reason(&self, agent: &str) -> String {
        self.lines.line(agent).map_or_else(String::new, |line| line.reason())
    }

    /// Subscribes to a property of another agent, which may appear later.
    /// Its mirror is at `agents/<agent>/<path>`.
    ///
    /// # Errors
    /// If no agent of that name is known, or the mirror's path is taken.
    pub fn subscribe(&self, agent: &str, want: Want) -> Result<u32, PeerError> {
        let (line, path) = (self.line(agent)?, want.path.clone());
        let subscribed = locked(&line.peer).subscribe(want);
        line.wake.notify(1);
        subscribed.map_err(|reason| PeerError::Subscription { agent: agent.into(), path, reason })
    }

    /// Ends a subscription of [`subscribe`](Peers::subscribe).
    pub fn unsubscribe(&self, agent: &str, id: u32) {
        if let Some(line) = self.lines.line(agent) {
            locked(&line.peer).unsubscribe(id);
            line.wake.notify(1);
        }
    }

    /// Returns the status of a subscription; `None` for an unknown number.
    pub fn status(&self, agent: &str, id: u32) -> Option<Status> {
        locked(&self.lines.line(agent)?.peer).status(id).cloned()
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
        let line = self.line(agent)?;
        let (sender, receiver) = mpsc::channel();
        let mut peer = locked(&line.peer);
        let ticket = peer.send(path, schema, items, bytes).map_err(|error| not_sent(&line, error))?;
        locked(&line.waiting).answers.insert(ticket, sender);
        drop(peer);
        line.wake.notify(1);
        Ok(receiver)
    }

    /// Sends a message of the team's knowledge to another agent.
    /// It arrives as a [`Happening::Told`](super::Happening::Told) or not at all; false if it is lost already.
    pub fn tell(&self, agent: &str, message: &[u8]) -> bool {
        let Some(line) = self.lines.line(agent) else { return false };
        let told = locked(&line.peer).tell(message);
        line.wake.notify(1);
        told
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
        let line = self.line(agent)?;
        let (sender, receiver) = mpsc::channel();
        let mut peer = locked(&line.peer);
        let request = peer.ask(pattern, values).map_err(|error| not_sent(&line, error))?;
        locked(&line.waiting).lists.insert(request, sender);
        drop(peer);
        line.wake.notify(1);
        let no_answer = |reason| PeerError::NoAnswer { agent: agent.into(), reason };
        match receiver.recv_timeout(limit) {
            Ok(answer) => answer.map_err(no_answer),
            Err(_) => {
                locked(&line.peer).give_up(request);
                locked(&line.waiting).lists.remove(&request);
                Err(no_answer(format!("it has not answered within {} ms", limit.as_millis())))
            }
        }
    }

    /// Returns a handle that wakes the sending threads.
    pub fn notifier(&self) -> Notifier {
        Notifier(Arc::clone(&self.lines))
    }

    fn line(&self, agent: &str) -> Result<Arc<PeerLine>, PeerError> {
        self.lines.line(agent).ok_or_else(|| PeerError::Unknown { agent: agent.into(), known: self.agents() })
    }
}

fn not_sent(line: &PeerLine, error: SendError) -> PeerError {
    PeerError::Send { agent: line.agent.clone(), error, reason: line.explanation() }
}

impl Drop for Peers {
    fn drop(&mut self) {
        self.lines.context.ended.store(true, Ordering::Release);
        let lines = self.lines.with_lines(std::mem::take);
        lines.values().for_each(|served| served.line.end());
        for ServedLine { line, sends, receives } in lines.into_values() {
            // One that panicked has ended, too.
            drop(sends.join());
            // One that looks for somebody far away does so for seconds, and then finds that nobody waits for it.
            if !line.is_dialling.load(Ordering::SeqCst) {
                drop(receives.join());
            }
            locked(&line.peer).take_down();
        }
        self.listeners.drain(..).for_each(|listener| drop(listener.join()));
    }
}
