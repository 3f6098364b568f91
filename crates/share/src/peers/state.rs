//! States of other agents for tools: one property per agent and per subscription.

use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::{Access, Board, Property, Store};
use slate_module::{Bool, Text, interface};
use slate_sorted::SortedMap;

use super::Peer;
use super::import::Status;

/// State of another agent.
#[interface]
#[derive(PartialEq)]
pub struct PeerState {
    /// Connection state; true while it is connected.
    pub connected: Bool,
    /// Number unique to its last start.
    pub instance: u64,
    /// Time of the connection, by this agent's clock.
    #[unit("ns")]
    pub since: u64,
    /// Offset of its clock to this agent's.
    /// The error is half of the round trip at most.
    #[unit("ns")]
    pub offset: i64,
    /// Round-trip time of a packet.
    #[unit("ns")]
    pub round_trip: u64,
    /// Number of its connections.
    pub connections: u64,
    /// Bytes sent to it.
    #[unit("byte")]
    pub sent: u64,
    /// Bytes received from it.
    #[unit("byte")]
    pub received: u64,
    /// Packets from it that were malformed.
    pub malformed: u64,
    /// Endpoint at which this agent dials it; empty if it connected by itself.
    pub endpoint: Text<124>,
    /// Reason why it is absent, if known.
    pub reason: Text<252>,
}

/// State of a subscription of this agent.
#[interface]
#[derive(PartialEq)]
pub struct ReadState {
    /// Service state; true while the other agent sends its values.
    pub served: Bool,
    /// Received values.
    pub received: u64,
    /// Lost values of a queue.
    pub lost: u64,
    /// Received values that did not fit the mirror.
    pub unfit: u64,
    /// Number of the newest value at its origin.
    pub sequence: u64,
    /// Generation of its writer there.
    pub generation: u64,
    /// Reason why it is not served, if known.
    pub reason: Text<252>,
}

/// State of a subscription of another agent.
#[interface]
#[derive(PartialEq)]
pub struct ServedState {
    /// Sent values.
    pub sent: u64,
    /// Values waiting to be sent.
    pub lag: u64,
    /// Fragments sent and not confirmed.
    pub unconfirmed: u64,
}

/// Properties of one other agent's state.
#[derive(Debug)]
pub(super) struct PeerStates {
    board: Arc<Board>,
    prefix: String,
    shown: SortedMap<String, ShownStates>,
}

#[derive(Debug)]
struct ShownStates {
    writer: Writer,
    last: Vec<u8>,
    seen: bool,
    /// Property created here.
    /// At the end another one may be at its path.
    property: Arc<Property>,
}

impl PeerStates {
    pub fn new(board: &Arc<Board>, agent: &str) -> Self {
        let prefix = format!("peers/{agent}");
        Self { board: Arc::clone(board), prefix, shown: SortedMap::new() }
    }

    /// Publishes states that have changed.
    pub fn update(&mut self, peer: &Peer, endpoint: &str, reason: &str, now: u64) {
        self.shown.values_mut().for_each(|shown| shown.seen = false);
        self.show("link", "Another agent, seen from this one.", &peer_state(peer, endpoint, reason), now);
        for (id, import) in &peer.exchange.imports {
            let progress = peer.session.progress(*id);
            let seen = progress.and_then(|progress| progress.seen);
            let reason = match &import.status {
                Status::Waiting(reason) | Status::Refused(reason) => Text::new(reason),
                Status::Unanswered | Status::Served => Text::new(""),
            };
            let state = ReadState {
                served: (import.status == Status::Served).into(),
                received: progress.map_or(0, |progress| progress.received),
                lost: progress.map_or(0, |progress| progress.lost),
                unfit: import.unfit,
                sequence: seen.map_or(0, |seen| seen.sequence),
                generation: seen.map_or(0, |seen| seen.generation),
                reason,
            };
            let path = format!("reads/{}", import.want.path);
            self.show(&path, "A property of another agent that is read here.", &state, now);
        }
        for (id, export) in &peer.exchange.exports {
            let (sent, unconfirmed) = peer.session.served(*id).unwrap_or((0, 0));
            let state = ServedState { sent, lag: peer.lag(*id), unconfirmed: unconfirmed as u64 };
            let path = format!("serves/{}", export.path);
            self.show(&path, "A property of this agent that another one reads.", &state, now);
        }
        let gone: Vec<_> =
            self.shown.iter().filter(|(_, shown)| !shown.seen).map(|(path, _)| path.clone()).collect();
        gone.iter().for_each(|path| self.hide(path));
    }

    fn show<T: Interface + Copy>(&mut self, name: &str, doc: &str, state: &T, now: u64) {
        let path = format!("{}/{name}", self.prefix);
        if !self.shown.contains_key(&path) {
            let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 8, queues: 1, window: 4 } };
            // A path that is not a URL, or is taken, is not shown; nothing depends on it.
            let Ok(property) = self.board.add_channel(&path, doc, T::DESCRIPTOR, store, Access::Output)
            else {
                return;
            };
            let Some(Ok(writer)) = property.channel().map(|channel| channel.writer()) else { return };
            self.shown.insert(path.clone(), ShownStates { writer, last: Vec::new(), seen: true, property });
        }
        let Some(shown) = self.shown.get_mut(&path) else { return };
        shown.seen = true;
        let mut state = *state;
        let view = View::of(&mut state);
        if shown.last != view.bytes() && shown.writer.write(view.bytes(), 0, now).is_ok() {
            shown.last = view.bytes().to_vec();
        }
    }

    fn hide(&mut self, path: &str) {
        if let Some(shown) = self.shown.remove(path)
            && self.board.get(path).is_some_and(|(found, _)| Arc::ptr_eq(&found, &shown.property))
        {
            // It was just found; another thread may have removed it.
            let _ = self.board.remove(path);
        }
    }
}

impl Drop for PeerStates {
    fn drop(&mut self) {
        let paths: Vec<_> = self.shown.keys().cloned().collect();
        paths.iter().for_each(|path| self.hide(path));
    }
}

fn peer_state(peer: &Peer, endpoint: &str, reason: &str) -> PeerState {
    let session = peer.session();
    let (counters, estimate) = (session.counters(), session.estimate());
    PeerState {
        connected: session.other().is_some().into(),
        instance: session.other().map_or(0, |other| other.instance),
        since: session.since().unwrap_or(0),
        offset: estimate.map_or(0, |estimate| estimate.offset),
        round_trip: estimate.map_or(0, |estimate| estimate.round_trip),
        connections: counters.connections,
        sent: counters.bytes_sent,
        received: counters.bytes_received,
        malformed: counters.malformed,
        endpoint: Text::new(endpoint),
        reason: Text::new(if session.other().is_some() { "" } else { reason }),
    }
}
