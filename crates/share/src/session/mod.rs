//! Protocol between two agents, without sockets, clocks or threads.
//! Packets and the time go in, packets and events come out. Packets may be lost, doubled and reordered; memory stays
//! bounded for any input.
//!
//! Both sides greet until each has received the other's greeting. Then each has a control stream, reliable and in
//! order, for subscriptions, messages and questions, and a stream for every subscription that it serves. Fragments of a
//! stream are numbered; a receiver requests missing ones, and a sender without a confirmation announces the extent of
//! the stream. After a period of silence the connection and all of its streams end, and both greet again under other
//! numbers. A reader reports its newest value, so that its subscriptions continue from there.

mod clock;
mod connection;
mod control;
mod delivery;
mod event;
mod inbound;
mod knowledge;
mod options;
mod outbound;
mod sending;
mod subscription;
mod wire;

use std::collections::VecDeque;

pub use clock::Estimate;
pub use connection::Identity;
pub use control::SendError;
pub use delivery::DeliveryStatus;
pub use event::{Application, Event, Offer};
pub use knowledge::MAX_MESSAGE_SIZE as MAX_KNOWLEDGE_SIZE;
pub use options::{Compression, Content, Limits, Mode, Options};
pub use wire::{Encoding, Sample, Seen, VERSION, refusal};

use slate_blackboard::Url;
use slate_sorted::{SortedMap, SortedSet};

use clock::PeerClock;
use connection::{Greeting, SessionConnection};
use inbound::Inbound;
use knowledge::Knowledge;
use outbound::Outbound;
use subscription::{ReadStream, Serving};
use wire::{Fragment, Hello, Packet, PacketFrame, StreamReport};

/// Greeting period of an agent that is not connected, ns.
const GREETING_PERIOD: u64 = 50_000_000;

/// Greeting period after a refusal, ns.
const REFUSED_GREETING_PERIOD: u64 = 500_000_000;

/// Heartbeat period until the clock offset is known, ns.
const INITIAL_BEAT_PERIOD: u64 = 10_000_000;

/// Largest number of open questions of the other agent.
const MAX_OPEN_QUERIES: usize = 16;

/// Counters of a session, for diagnostics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Packets sent.
    pub packets_sent: u64,
    /// Bytes sent.
    pub bytes_sent: u64,
    /// Packets received, regardless of their content.
    pub packets_received: u64,
    /// Bytes received.
    pub bytes_received: u64,
    /// Malformed packets.
    pub malformed: u64,
    /// Packets of earlier connections.
    pub stale: u64,
    /// Number of connections.
    pub connections: u64,
}

/// Progress of a subscription of this agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Received values.
    pub received: u64,
    /// Lost values of a queue.
    pub lost: u64,
    /// Newest received value.
    pub seen: Option<Seen>,
}

/// Session: one agent's end of the connection to another one.
#[derive(Debug)]
pub struct Session {
    limits: Limits,
    connection: SessionConnection,
    /// Expected name of the other agent, if known.
    expected: Option<String>,
    clock: PeerClock,
    beat_at: u64,
    owes_beat: bool,
    control_out: Outbound,
    control_in: Inbound,
    /// Control messages waiting for the stream.
    control_queue: VecDeque<Vec<u8>>,
    control_queue_bytes: usize,
    knowledge: Knowledge,
    readings: SortedMap<u32, ReadStream>,
    servings: SortedMap<u32, Serving>,
    /// Subscription that is served first.
    cursor: u32,
    next_id: u32,
    next_ticket: u64,
    next_request: u32,
    /// Messages of this agent without a final answer, and whether they were accepted.
    tickets: SortedMap<u64, bool>,
    /// Unanswered questions of this agent, and whether they still wait for the answer.
    requests: SortedMap<u32, bool>,
    /// Open questions of the other agent.
    open_queries: SortedSet<u32>,
    /// Refusal to be sent in any state.
    refusal: Option<Vec<u8>>,
    refused: Option<String>,
    counters: Counters,
}

impl Session {
    /// Creates a session with another agent, which is not connected.
    /// `expected` is its name, if known.
    pub fn new(own: Identity, expected: Option<&str>, limits: Limits) -> Self {
        let (control_out, control_in) = control_streams(&limits);
        Self {
            limits,
            connection: SessionConnection::new(own),
            expected: expected.map(Into::into),
            clock: PeerClock::default(),
            beat_at: 0,
            owes_beat: false,
            control_out,
            control_in,
            control_queue: VecDeque::new(),
            control_queue_bytes: 0,
            knowledge: Knowledge::default(),
            readings: SortedMap::new(),
            servings: SortedMap::new(),
            cursor: 0,
            next_id: 1,
            next_ticket: 1,
            next_request: 1,
            tickets: SortedMap::new(),
            requests: SortedMap::new(),
            open_queries: SortedSet::new(),
            refusal: None,
            refused: None,
            counters: Counters::default(),
        }
    }

    /// Returns the identity of this agent.
    pub fn own(&self) -> &Identity {
        &self.connection.own
    }

    /// Returns the limits of the session.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Returns the identity of the other agent while it is connected.
    pub fn other(&self) -> Option<&Identity> {
        self.connection.other.as_ref().filter(|_| self.connection.established).map(|other| &other.identity)
    }

    /// Returns the time of the connection, by this agent's clock, ns.
    pub fn since(&self) -> Option<u64> {
        self.connection.established.then_some(self.connection.since)
    }

    /// Returns the reason of the last refusal while the agents are not connected.
    pub fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    /// Returns the estimate of the other clock; `None` before the first exchange.
    pub fn estimate(&self) -> Option<Estimate> {
        self.clock.estimate()
    }

    /// Returns the counters of the session.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Returns the progress of a subscription of this agent.
    pub fn progress(&self, id: u32) -> Option<Progress> {
        let reading = self.readings.get(&id)?;
        Some(Progress { received: reading.received, lost: reading.lost, seen: reading.seen })
    }

    /// Returns the sent values and the unconfirmed fragments of a subscription.
    /// The subscription is one of the other agent.
    pub fn served(&self, id: u32) -> Option<(u64, usize)> {
        self.servings.get(&id).map(|serving| (serving.sent, serving.stream.in_flight()))
    }

    /// Sends a message of the team's knowledge: at most [`MAX_KNOWLEDGE_SIZE`] bytes.
    /// It may be lost. Returns false if it is lost already: the other agent is absent, or too much waits.
    pub fn send_knowledge(&mut self, message: &[u8]) -> bool {
        self.connection.established && self.knowledge.push(message)
    }

    /// Takes a packet that arrived at this agent's time `now`, ns.
    pub fn receive(&mut self, now: u64, packet: &[u8], application: &mut dyn Application) {
        self.counters.packets_received += 1;
        self.counters.bytes_received += packet.len() as u64;
        match wire::parse(packet) {
            Packet::Malformed => self.counters.malformed += 1,
            Packet::Refusal(reason) => self.receive_refusal(now, reason, application),
            Packet::OtherVersion(version) => {
                let own = &self.connection.own.agent;
                let reason = format!(
                    "agent `{own}` speaks version {VERSION} of the sharing protocol and got version {version}: \
                     let both agents run the same release"
                );
                self.refuse(now, reason, application);
            }
            Packet::Frames(head, frames) => self.receive_frames(now, head, frames, application),
        }
    }

    fn receive_refusal(&mut self, now: u64, reason: &str, application: &mut dyn Application) {
        // Anybody could have sent it, so it ends nothing.
        if self.connection.established {
            return;
        }
        self.connection.greet_at = now + REFUSED_GREETING_PERIOD;
        if self.refused.as_deref() != Some(reason) {
            let reason: String = reason.chars().take(512).collect();
            self.refused = Some(reason.clone());
            application.event(Event::Refused { reason });
        }
    }

    /// Refuses the sender of a packet.
    fn refuse(&mut self, now: u64, reason: String, application: &mut dyn Application) {
        self.refusal = Some(refusal(&reason));
        if !self.connection.established {
            self.connection.greet_at = now + REFUSED_GREETING_PERIOD;
        }
        if self.refused.as_ref() != Some(&reason) {
            self.refused = Some(reason.clone());
            application.event(Event::Refused { reason });
        }
    }

    fn receive_frames(
        &mut self,
        now: u64,
        head: wire::PacketHead,
        mut rest: &[u8],
        application: &mut dyn Application,
    ) {
        while !rest.is_empty() {
            let Ok((frame, left)) = postcard::take_from_bytes::<PacketFrame<'_>>(rest) else {
                self.counters.malformed += 1;
                return;
            };
            rest = left;
            if let PacketFrame::Hello(hello) = &frame {
                if !self.receive_hello(now, head, hello, application) {
                    return;
                }
            } else if !self.connection.is_ours(head) {
                self.counters.stale += 1;
                return;
            }
            if self.connection.is_ours(head) {
                // It answers what this agent has sent, so it is there now.
                self.connection.last_received = now;
                if !self.connection.established {
                    self.establish(now, application);
                }
            }
            let fine = match frame {
                PacketFrame::Hello(_) => true,
                PacketFrame::Beat(beat) => {
                    self.receive_beat(now, beat);
                    true
                }
                PacketFrame::Fragment(fragment) => self.receive_fragment(now, &fragment, application),
                PacketFrame::Announcement(announcement) => {
                    self.receive_announcement(now, &announcement, application)
                }
                PacketFrame::StreamReport(report) => self.receive_report(now, &report),
                PacketFrame::Knowledge(piece) => match self.knowledge.receive(&piece) {
                    Some(Some(bytes)) => {
                        application.event(Event::Knowledge { bytes });
                        true
                    }
                    received => received.is_some(),
                },
            };
            if !fine {
                self.counters.malformed += 1;
                return;
            }
        }
    }

    /// Takes a greeting; returns whether the rest of the packet is to be read.
    fn receive_hello(
        &mut self,
        now: u64,
        head: wire::PacketHead,
        hello: &Hello<'_>,
        application: &mut dyn Application,
    ) -> bool {
        let (own, agent) = (self.connection.own.agent.clone(), hello.agent);
        if !is_agent(agent) {
            self.counters.malformed += 1;
            return false;
        }
        if agent == own {
            // Itself, when its endpoint leads back to it.
            let reason = format!("an agent `{agent}` already exists: give each agent a name of its own");
            self.refuse(now, reason, application);
            return false;
        }
        if let Some(expected) = self.expected.as_deref().filter(|expected| *expected != agent) {
            let reason = format!("agent `{own}` expects agent `{expected}` here, not `{agent}`");
            self.refuse(now, reason, application);
            return false;
        }
        let identity = Identity { agent: agent.into(), instance: hello.instance };
        match self.connection.greet(head.from, identity, hello.attempt) {
            Greeting::Known => {
                if self.connection.established {
                    // It would not greet if it knew.
                    self.owes_beat = true;
                }
                true
            }
            Greeting::New => {
                self.connection.greet_at = now;
                true
            }
            Greeting::Stale => {
                self.counters.stale += 1;
                false
            }
            Greeting::Reconnect => {
                self.disconnect(now, "it began anew", application);
                self.connection.greet(
                    head.from,
                    Identity { agent: agent.into(), instance: hello.instance },
                    hello.attempt,
                );
                false
            }
            Greeting::Duplicate => {
                // Of an agent that was killed nothing is heard, and then the next of its name is welcome.
                let reason = duplicate(&own, agent);
                self.refusal = Some(refusal(&reason));
                false
            }
        }
    }

    fn establish(&mut self, now: u64, application: &mut dyn Application) {
        let Some(other) = self.connection.other.as_ref().map(|other| other.identity.clone()) else { return };
        self.connection.established = true;
        self.connection.since = now;
        self.owes_beat = true;
        self.refused = None;
        self.counters.connections += 1;
        let Identity { agent, instance } = other;
        application.event(Event::Connected { agent, instance });
    }

    fn receive_beat(&mut self, now: u64, beat: wire::Beat) {
        let (had_received, was_known) = (self.clock.has_received(), self.clock.estimate().is_some());
        self.clock.receive(now, beat);
        let is_known = self.clock.estimate().is_some();
        // The other agent learns the difference of the clocks from the answer.
        self.owes_beat |= !had_received || is_known && !was_known;
        if is_known && !was_known {
            // Not before, as the time of a value would be that of another clock.
            let ids: Vec<u32> = self.readings.keys().copied().collect();
            ids.into_iter().for_each(|id| self.send_subscription(id));
        }
    }

    /// Returns the sender's identity if a packet is a greeting.
    /// For the search of the session that it belongs to.
    pub fn greeting(packet: &[u8]) -> Option<Identity> {
        let Packet::Frames(_, frames) = wire::parse(packet) else { return None };
        match postcard::take_from_bytes::<PacketFrame<'_>>(frames) {
            Ok((PacketFrame::Hello(hello), _)) if is_agent(hello.agent) => {
                Some(Identity { agent: hello.agent.into(), instance: hello.instance })
            }
            _ => None,
        }
    }

    /// Ends the connection when the host knows that it is cut; both greet again.
    pub fn disconnect(&mut self, now: u64, reason: &str, application: &mut dyn Application) {
        let was_together = self.connection.established;
        self.connection.end(now);
        self.clock = PeerClock::default();
        (self.control_out, self.control_in) = control_streams(&self.limits);
        self.control_queue.clear();
        self.control_queue_bytes = 0;
        self.knowledge = Knowledge::default();
        self.open_queries.clear();
        self.readings.values_mut().for_each(|reading| reading.end(&self.limits));
        for id in std::mem::take(&mut self.servings).into_keys() {
            application.event(Event::Unsubscribed { id });
        }
        for ticket in std::mem::take(&mut self.tickets).into_keys() {
            application.event(Event::Answered { ticket, answer: DeliveryStatus::Vanished });
        }
        let requests = std::mem::take(&mut self.requests);
        for (request, _) in requests.into_iter().filter(|(_, is_wanted)| *is_wanted) {
            let reason = "the other agent went away".into();
            application.event(Event::Failed { request, reason });
        }
        if was_together {
            application.event(Event::Disconnected { reason: reason.into() });
        }
    }

    /// Advances the time; a silent agent is disconnected.
    pub fn tick(&mut self, now: u64, application: &mut dyn Application) {
        let silence = now.saturating_sub(self.connection.last_received);
        if self.connection.established && silence > self.limits.silence {
            let milliseconds = self.limits.silence / 1_000_000;
            self.disconnect(now, &format!("nothing was heard of it for {milliseconds} ms"), application);
        }
    }

    fn receive_fragment(
        &mut self,
        now: u64,
        fragment: &Fragment<'_>,
        application: &mut dyn Application,
    ) -> bool {
        if fragment.count == 1 && fragment.stream != 0 && !self.readings.contains_key(&fragment.stream) {
            // The subscription has ended.
            if let Some((sample, _, content)) = Sample::read(fragment.bytes.0) {
                discard(&sample, content, application);
            }
        }
        if fragment.stream == 0 {
            return self.with_control(now, application, |stream, deliver| stream.receive(fragment, deliver));
        }
        self.with_reading(fragment.stream, application, |stream, deliver| stream.receive(fragment, deliver))
    }

    fn receive_announcement(
        &mut self,
        now: u64,
        announcement: &wire::Announcement,
        application: &mut dyn Application,
    ) -> bool {
        if announcement.stream == 0 {
            return self
                .with_control(now, application, |stream, deliver| stream.announce(announcement, deliver));
        }
        let fine = self.with_reading(announcement.stream, application, |stream, deliver| {
            stream.announce(announcement, deliver)
        });
        if let Some(reading) = self.readings.get_mut(&announcement.stream) {
            reading.receive_announcement(announcement);
        }
        fine
    }

    /// Passes values that a stream delivers to the application.
    fn with_reading(
        &mut self,
        id: u32,
        application: &mut dyn Application,
        call: impl FnOnce(&mut Inbound, &mut dyn FnMut(&[u8])) -> bool,
    ) -> bool {
        // It may have been ended while this was on its way.
        let Some(reading) = self.readings.get_mut(&id) else { return true };
        let limit = self.limits.value;
        let mut stream = std::mem::replace(&mut reading.stream, Inbound::idle());
        let mut valid = true;
        let fine = call(&mut stream, &mut |item| match Sample::read(item) {
            Some((sample, epoch, content)) if sample.length as usize <= limit => {
                if reading.take_newer(&sample, epoch) {
                    application.sample(id, &sample, std::mem::take(&mut reading.skipped), content);
                } else {
                    discard(&sample, content, application);
                }
            }
            _ => valid = false,
        });
        reading.stream = stream;
        fine && valid
    }

    fn receive_report(&mut self, now: u64, report: &StreamReport) -> bool {
        if report.stream == 0 {
            self.control_out.report(report, now);
        } else if let Some(serving) = self.servings.get_mut(&report.stream) {
            serving.stream.report(report, now);
        }
        true
    }
}

fn discard(sample: &Sample, content: &[u8], application: &mut dyn Application) {
    if sample.encoding == Encoding::Placed {
        application.discard(sample, content);
    }
}

/// Returns whether a text is a valid name of an agent: a part of a path.
fn is_agent(name: &str) -> bool {
    name.len() <= 255 && !name.contains('/') && Url::parse(name).is_ok()
}

/// Returns the reason for the refusal of a second agent with the same name.
pub(crate) fn duplicate(own: &str, agent: &str) -> String {
    format!("agent `{own}` is connected to an agent `{agent}` already: give each agent a name of its own")
}

fn control_streams(limits: &Limits) -> (Outbound, Inbound) {
    let inbound = Inbound::new(Content::All, true, limits.value + 4096, limits.window);
    (Outbound::new(Content::All, true, limits.window), inbound)
}
