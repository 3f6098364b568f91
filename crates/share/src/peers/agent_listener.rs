//! Listener for other agents.

use std::io::{self, ErrorKind};
use std::net::{IpAddr, Ipv6Addr};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::connections::ConnectionTable;
use super::context::{PeerContext, impostor, lock};
use crate::carrier::{CarrierError, Link};
use crate::session::{Application, Event, Identity, Session, refusal};

/// Timeout of the greeting of an incoming link.
const GREETING_TIMEOUT: Duration = Duration::from_secs(2);

/// Largest number of links without a greeting; below, that of one machine.
/// The limits are those of one listener.
const MAX_PENDING_LINKS: usize = 32;
const MAX_PENDING_LINKS_PER_MACHINE: usize = 8;

/// Links without a greeting, oldest first.
/// If there are too many, the oldest is closed: silent ones make room for others.
#[derive(Debug, Default)]
struct Pending(Mutex<Vec<PendingLink>>);

/// Machine of the other end, if it may be another one, and the link.
type PendingLink = (Option<String>, Arc<dyn Link>);

impl Pending {
    fn add(&self, link: &Arc<dyn Link>) {
        let from = link.origin().map(|origin| network(&origin));
        let mut pending = lock(&self.0);
        let is_same_machine = |(other, _): &PendingLink| from.is_some() && *other == from;
        let oldest = if pending.iter().filter(|other| is_same_machine(other)).count()
            >= MAX_PENDING_LINKS_PER_MACHINE
        {
            pending.iter().position(is_same_machine)
        } else {
            (pending.len() >= MAX_PENDING_LINKS).then_some(0)
        };
        if let Some(oldest) = oldest {
            // This ends its thread.
            pending.remove(oldest).1.close();
        }
        pending.push((from, Arc::clone(link)));
    }

    /// Removes a link; returns false if it was closed before.
    fn remove(&self, link: &Arc<dyn Link>) -> bool {
        let mut pending = lock(&self.0);
        let at = pending.iter().position(|(_, other)| Arc::ptr_eq(other, link));
        at.map(|at| pending.remove(at)).is_some()
    }
}

/// Returns the network prefix that identifies one machine.
/// An IPv6 machine may choose the rest of its address, which must not count as several machines.
fn network(origin: &str) -> String {
    match origin.parse() {
        Ok(IpAddr::V6(address)) if address.to_ipv4_mapped().is_none() => {
            let [a, b, c, d, ..] = address.segments();
            Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0).to_string()
        }
        _ => origin.into(),
    }
}

/// Listens at an endpoint in a separate thread.
pub(super) fn start_listener(
    connections: &Arc<ConnectionTable>,
    endpoint: &str,
) -> Result<JoinHandle<()>, CarrierError> {
    let listener = connections.context.carrier(endpoint)?.listen(endpoint)?;
    let system = |error| CarrierError::System { endpoint: endpoint.into(), error };
    let shared = Arc::clone(connections);
    let agent_listener = Arc::new(AgentListener { endpoint: endpoint.into(), pending: Pending::default() });
    let accept = move || {
        while !shared.context.ended.load(Ordering::Acquire) {
            match listener.accept(Duration::from_millis(100)) {
                Ok(Some(link)) => accept_link(&shared, &agent_listener, link),
                Ok(None) => {}
                // The system has no more files, perhaps; later it may.
                Err(_) => thread::sleep(Duration::from_millis(100)),
            }
        }
    };
    thread::Builder::new().name("sharing".into()).spawn(accept).map_err(system)
}

struct AgentListener {
    endpoint: String,
    pending: Pending,
}

/// Waits for the greeting in a separate thread, so later links do not wait for it.
fn accept_link(connections: &Arc<ConnectionTable>, agent_listener: &Arc<AgentListener>, link: Arc<dyn Link>) {
    agent_listener.pending.add(&link);
    let (shared, listener, greeted) =
        (Arc::clone(connections), Arc::clone(agent_listener), Arc::clone(&link));
    let greet = move || greet(&shared, &listener, &greeted);
    if thread::Builder::new().name("greeting".into()).spawn(greet).is_err() {
        agent_listener.pending.remove(&link);
        link.close();
    }
}

/// Waits for the first packet; returns its length.
#[allow(clippy::disallowed_methods, reason = "the host limits the wait for a network")]
fn receive_first(link: &dyn Link, packet: &mut [u8]) -> io::Result<Option<usize>> {
    let start = Instant::now();
    loop {
        let left = GREETING_TIMEOUT.saturating_sub(start.elapsed());
        // A carrier may return early without a packet.
        match link.receive(packet, left)? {
            None if !left.is_zero() => {}
            length => return Ok(length),
        }
    }
}

fn greet(connections: &Arc<ConnectionTable>, agent_listener: &AgentListener, link: &Arc<dyn Link>) {
    let context = &connections.context;
    let mut packet = vec![0; link.largest() + 1];
    let length = receive_first(link.as_ref(), &mut packet);
    let from = |name: Option<&str>| match (name, link.origin()) {
        (Some(agent), Some(origin)) => format!("agent `{agent}`, {origin} at {}", agent_listener.endpoint),
        (Some(agent), None) => format!("agent `{agent}`"),
        (None, origin) => {
            format!("{} at {}", origin.unwrap_or_else(|| "an unknown peer".into()), agent_listener.endpoint)
        }
    };
    let refuse = |reason: &str| {
        // The link may be authenticated even if its greeting is invalid.
        context.report_rejection("", &from(link.authenticated()), reason);
        link.close();
    };
    let in_time = agent_listener.pending.remove(link);
    let length = match length {
        _ if !in_time => return refuse("too many others connected before its greeting"),
        Ok(Some(length)) => length,
        Ok(None) => return refuse(&format!("no greeting within {} s", GREETING_TIMEOUT.as_secs())),
        Err(error) if error.kind() == ErrorKind::PermissionDenied => return refuse(&error.to_string()),
        // The other end closed the link.
        Err(_) => return link.close(),
    };
    let packet = &packet[..length];
    let Some(identity) =
        Session::greeting(packet).filter(|identity| identity.agent != context.identity.agent)
    else {
        let (reason, answer) = rejection(context, packet);
        if let Some(answer) = answer {
            // The closed link also reports the refusal if this is not received.
            let _ = link.send(&answer);
        }
        return refuse(&reason);
    };
    let agent = &identity.agent;
    let denied = impostor(link.as_ref(), agent)
        .or_else(|| context.rights.of(&context.identity.agent, agent).err())
        .map_or_else(|| admit(connections, link, &identity, packet), |reason| Err(Some(reason)));
    if let Err(reason) = denied {
        if let Some(reason) = reason {
            context.report_rejection(agent, &from(Some(agent)), &reason);
            // As above.
            let _ = link.send(&refusal(&reason));
        }
        link.close();
    }
}

/// Hands the link to the connection of that agent.
/// The error is the reason of a refusal, `None` if the other agent need not know it.
fn admit(
    connections: &Arc<ConnectionTable>,
    link: &Arc<dyn Link>,
    identity: &Identity,
    packet: &[u8],
) -> Result<(), Option<String>> {
    let connection = connections.connection_to(&identity.agent).map_err(|error| Some(error.to_string()))?;
    connection.adopt(&connections.context, Arc::clone(link), identity.instance, packet)
}

/// Returns the reason against a stranger, and the answer to send, if any.
/// A stranger has another version, this agent's name, or sent no greeting.
fn rejection(context: &PeerContext, packet: &[u8]) -> (String, Option<Vec<u8>>) {
    let mut session = Session::new(context.identity.clone(), None, context.limits);
    let (now, mut answer) = (context.now(), Vec::new());
    session.receive(now, packet, &mut NoApplication);
    match session.refused().map(ToOwned::to_owned) {
        Some(reason) => {
            let answers = session.outgoing(now, packet.len(), &mut answer, &mut NoApplication);
            (reason, answers.then_some(answer))
        }
        None => ("the first packet is no greeting".into(), None),
    }
}

/// Application that serves nothing and takes nothing.
struct NoApplication;

impl Application for NoApplication {
    fn event(&mut self, _: Event) {}
}
