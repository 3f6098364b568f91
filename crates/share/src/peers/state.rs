//! What tools see of other agents: a property for each, and one for each subscription.

use std::collections::BTreeMap;
use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::{Access, Board, Property, Store};
use slate_module::{Bool, Text, interface};

use super::Peer;
use super::import::Status;

/// Another agent, as it is seen from here.
#[interface]
#[derive(PartialEq)]
pub struct PeerState {
    /// Whether it is there.
    pub connected: Bool,
    /// Another number after each of its starts; of the last one.
    pub instance: u64,
    /// Since when it is there, by this agent's clock.
    #[unit("ns")]
    pub since: u64,
    /// What its clock shows more than this agent's, off by half of the round trip at most.
    #[unit("ns")]
    pub offset: i64,
    /// How long a packet takes there and back.
    #[unit("ns")]
    pub round_trip: u64,
    /// How often it came.
    pub connections: u64,
    /// What was sent to it.
    #[unit("byte")]
    pub sent: u64,
    /// What was received from it.
    #[unit("byte")]
    pub received: u64,
    /// Packets from it that could not be read.
    pub malformed: u64,
    /// Where this agent dials it; empty when it came by itself.
    pub endpoint: Text<124>,
    /// Why it is not there, where that is known.
    pub reason: Text<252>,
}

/// A property of another agent that is read here.
#[interface]
#[derive(PartialEq)]
pub struct ReadState {
    /// Whether the other agent sends its values.
    pub served: Bool,
    /// Values that came.
    pub received: u64,
    /// Values of a queue that were written and will not come.
    pub lost: u64,
    /// Values that came and did not fit the mirror.
    pub unfit: u64,
    /// The number that the newest value has at its origin.
    pub sequence: u64,
    /// The generation that its writer has there.
    pub generation: u64,
    /// Why it is not served, where that is known.
    pub reason: Text<252>,
}

/// A property of this agent that another one reads.
#[interface]
#[derive(PartialEq)]
pub struct ServedState {
    /// Values that were sent.
    pub sent: u64,
    /// Values that wait to be sent.
    pub lag: u64,
    /// Fragments that were sent and are not confirmed.
    pub unconfirmed: u64,
}

/// The properties of one other agent.
#[derive(Debug)]
pub(super) struct PeerStates {
    board: Arc<Board>,
    prefix: String,
    shown: BTreeMap<String, ShownStates>,
}

#[derive(Debug)]
struct ShownStates {
    writer: Writer,
    last: Vec<u8>,
    seen: bool,
    /// What was made here, which may not be what is there at the end.
    property: Arc<Property>,
}

impl PeerStates {
    pub fn new(board: &Arc<Board>, agent: &str) -> Self {
        let prefix = format!("peers/{agent}");
        Self { board: Arc::clone(board), prefix, shown: BTreeMap::new() }
    }

    /// Shows how things are, as far as that has changed.
    pub fn update(&mut self, peer: &Peer, endpoint: &str, reason: &str, now: u64) {
        self.shown.values_mut().for_each(|shown| shown.seen = false);
        self.show(
            "link",
            "Another agent, as it is seen from here.",
            &peer_state(peer, endpoint, reason),
            now,
        );
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
            // A path that is no URL, or is taken, is not shown; nothing depends on it.
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
            // It was there a moment ago; if somebody was quicker, it is gone all the same.
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
