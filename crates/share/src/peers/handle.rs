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

/// How an agent shares.
#[derive(Clone)]
pub struct Setup {
    /// Who this agent is.
    pub identity: Identity,
    /// Its clock.
    pub clock: Clock,
    /// The clock that its values go by, if that is another one, as in a simulation.
    pub time: Option<Clock>,
    /// What a session takes at most.
    pub limits: Limits,
    /// Where it listens; nowhere when it only dials.
    pub listen: Vec<String>,
    /// What others may do.
    pub rights: Rights,
    /// The carriers by the beginnings of their endpoints, before the colon. `local` is there anyhow, and where it was
    /// built, so is `tls`, which carries nothing without certificates.
    pub carriers: BTreeMap<String, Arc<dyn Carrier>>,
    /// How often the properties that others read are looked at for new values, nanoseconds; nothing when
    /// [`Notifier::notify`] is called after every tick.
    pub poll: Option<u64>,
    /// Is notified (of 1) when mirrors were written or messages came.
    pub updated: Option<Arc<Wake>>,
    /// Is told what happens.
    pub notice: Option<Notice>,
}

impl Setup {
    /// An agent that dials, and whose properties are looked at every millisecond.
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

    /// It listens at an endpoint, beside others.
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

/// The other agents of an agent. Dropping this ends the connections, and takes the mirrors off the board.
pub struct Peers {
    lines: Arc<LineTable>,
    listeners: Vec<JoinHandle<()>>,
}

impl fmt::Debug for Peers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Peers").field("identity", &self.lines.context.identity).finish_non_exhaustive()
    }
}

/// Why another agent can't be asked for something.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// Nobody of that name is known.
    #[error("no agent `{agent}` is known; known are: {}", .known.join(", "))]
    Unknown {
        /// What was asked for.
        agent: String,
        /// Who is known.
        known: Vec<String>,
    },
    /// The property can't be mirrored.
    #[error("slate://{agent}/{path}: {reason}")]
    Subscription {
        /// The other agent.
        agent: String,
        /// The property.
        path: String,
        /// In words.
        reason: String,
    },
    /// It can't be sent.
    #[error("agent `{agent}`: {error}{}", because(.reason))]
    Send {
        /// The other agent.
        agent: String,
        /// What is wrong.
        error: SendError,
        /// Why the agent is not there, where that is known.
        reason: String,
    },
    /// The answer did not come.
    #[error("agent `{agent}`: {reason}")]
    NoAnswer {
        /// The other agent.
        agent: String,
        /// In words.
        reason: String,
    },
}

fn because(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!(": {reason}") }
}

/// Wakes the threads that send, so that what was written goes out at once. Whoever calls it waits for nobody.
#[derive(Clone)]
pub struct Notifier(Arc<LineTable>);

impl Notifier {
    /// Values were written: to be called at the end of a tick, not for each value.
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
    /// Begins to share what is on a board.
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

    /// Whether an endpoint can be dialled, as far as that can be told before.
    ///
    /// # Errors
    /// When it makes no sense, or is refused whoever is there.
    pub fn check(&self, endpoint: &str) -> Result<(), CarrierError> {
        self.lines.context.carrier(endpoint)?.check(endpoint)
    }

    /// Dials another agent, and again whenever it is gone.
    ///
    /// # Errors
    /// When the endpoint makes no sense, the agent may not connect, or no thread can be started.
    pub fn connect(&self, agent: &str, endpoint: &str) -> Result<(), CarrierError> {
        self.dial(agent, endpoint, |line| line.dial_at(Some(endpoint)))
    }

    /// Dials another agent for a question, and again for a few seconds if it is not there. A link that nobody needs any more
    /// ends after as long.
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

    /// Dials another agent no longer. If it is there, it stays connected for as long as one of the two needs that. If it is
    /// not, and nothing of it is subscribed to, it is not known any more.
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

    /// The other agents that are known, whether or not they are there.
    pub fn agents(&self) -> Vec<String> {
        self.lines.with_lines(|lines| lines.keys().cloned().collect())
    }

    /// Whether another agent is dialled whenever it is not there.
    pub fn is_dialled(&self, agent: &str) -> bool {
        self.lines.line(agent).is_some_and(|line| line.is_dialled())
    }

    /// Whether another agent is there.
    pub fn is_connected(&self, agent: &str) -> bool {
        self.lines.line(agent).is_some_and(|line| locked(&line.peer).session().other().is_some())
    }

    /// Why another agent went away or was not let in; empty when that is not known.
    pub fn reason(&self, agent: &str) -> String {
        self.lines.line(agent).map_or_else(String::new, |line| line.reason())
    }

    /// Reads a property of another agent, which may come later; its mirror is at `agents/<agent>/<path>`.
    ///
    /// # Errors
    /// When nobody of that name is known, or the mirror's path is taken.
    pub fn subscribe(&self, agent: &str, want: Want) -> Result<u32, PeerError> {
        let (line, path) = (self.line(agent)?, want.path.clone());
        let subscribed = locked(&line.peer).subscribe(want);
        line.wake.notify(1);
        subscribed.map_err(|reason| PeerError::Subscription { agent: agent.into(), path, reason })
    }

    /// Ends what [`subscribe`](Peers::subscribe) began.
    pub fn unsubscribe(&self, agent: &str, id: u32) {
        if let Some(line) = self.lines.line(agent) {
            locked(&line.peer).unsubscribe(id);
            line.wake.notify(1);
        }
    }

    /// How a subscription stands; nothing when there is none of that number.
    pub fn status(&self, agent: &str, id: u32) -> Option<Status> {
        locked(&self.lines.line(agent)?.peer).status(id).cloned()
    }

    /// Sends a message to a mailbox of another agent, of an interface with that schema and with `items` tail items. Its
    /// answers come out of what is returned: at first that it was accepted, and then how it ended.
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

    /// Tells another agent something of the team's knowledge, which arrives as a
    /// [`Happening::Told`](super::Happening::Told) or not at all; false when it is lost already.
    pub fn tell(&self, agent: &str, message: &[u8]) -> bool {
        let Some(line) = self.lines.line(agent) else { return false };
        let told = locked(&line.peer).tell(message);
        line.wake.notify(1);
        told
    }

    /// Asks another agent which properties it has of those paths, and for their newest values if those are wanted.
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

    /// Wakes the threads that send.
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
