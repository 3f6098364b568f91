//! Connection to another agent, with a sending and a receiving thread.
//! No other thread waits for these two.

use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use slate_blackboard::wake::Wake;
use slate_sorted::SortedMap;

use super::context::{PeerContext, impostor, lock};
use super::dialing::Dialing;
use super::state::PeerStates;
use super::{Peer, PeerEvent, RemoteProperty};
use crate::carrier::{Carrier, CarrierError, Link};
use crate::session::DeliveryStatus;

/// Longest wait of a thread until it checks for the end.
const POLL_PERIOD: Duration = Duration::from_millis(100);

/// Shortest interval between attempts to dial, and longest interval.
const MIN_DIAL_INTERVAL: Duration = Duration::from_millis(20);
const MAX_DIAL_INTERVAL: Duration = Duration::from_millis(500);

/// Timeout of a link until both agents know of each other, ns.
const GREETING_TIMEOUT: u64 = 2_000_000_000;

/// Time in which a link that can't send may still deliver received data.
const DRAIN_TIMEOUT: Duration = Duration::from_millis(20);

/// Lifetime of an unused link that this agent has dialed, ns.
const IDLE_TIMEOUT: u64 = 5_000_000_000;

/// Update period of the states on the board, ns.
const STATE_PERIOD: u64 = 100_000_000;

/// Connection to one other agent.
#[derive(Debug)]
pub(super) struct PeerConnection {
    pub agent: String,
    pub peer: Mutex<Peer>,
    /// Wake of the sending thread.
    pub wake: Arc<Wake>,
    dialing: Mutex<Dialing>,
    /// Flag of dialing in progress, which may take long.
    pub is_dialing: AtomicBool,
    /// Current link; locked before the agent by threads that need both.
    link: Mutex<CurrentLink>,
    changed: Condvar,
    pub waiting: Mutex<PendingReplies>,
    reason: Mutex<String>,
    /// Last error of dialing an absent agent; it is not reported.
    dial_error: Mutex<Option<String>>,
    /// Queue of events to report, and the lock of the thread that reports them.
    events: Mutex<VecDeque<PeerEvent>>,
    report_lock: Mutex<()>,
    ended: AtomicBool,
}

/// The link in use.
#[derive(Debug, Default)]
struct CurrentLink {
    link: Option<Arc<dyn Link>>,
    /// Endpoint at which this agent dialed; `None` if the other agent did.
    dialed: Option<String>,
    since: u64,
}

/// Requests that wait for an answer of the other agent.
#[derive(Debug, Default)]
pub(super) struct PendingReplies {
    pub answers: SortedMap<u64, Sender<DeliveryStatus>>,
    pub lists: SortedMap<u32, Sender<Result<Vec<RemoteProperty>, String>>>,
}

impl PeerConnection {
    pub fn new(peer: Peer, wake: Arc<Wake>) -> Self {
        Self {
            agent: peer.agent().into(),
            peer: Mutex::new(peer),
            wake,
            dialing: Mutex::default(),
            is_dialing: AtomicBool::new(false),
            link: Mutex::default(),
            changed: Condvar::new(),
            waiting: Mutex::default(),
            reason: Mutex::default(),
            dial_error: Mutex::default(),
            events: Mutex::default(),
            report_lock: Mutex::default(),
            ended: AtomicBool::new(false),
        }
    }

    pub fn end(&self) {
        self.ended.store(true, Ordering::SeqCst);
        if let Some(link) = &lock(&self.link).link {
            link.close();
        }
        self.changed.notify_all();
        self.wake.notify(1);
    }

    /// Sets the endpoint that is dialed whenever the agent is absent; none for `None`.
    pub fn dial_at(&self, endpoint: Option<&str>) {
        lock(&self.dialing).always = endpoint.map(Into::into);
        self.changed.notify_all();
    }

    /// Dials the agent for a query.
    pub fn dial_for_query(&self, endpoint: &str, now: u64) {
        lock(&self.dialing).dial_until(endpoint, now.saturating_add(IDLE_TIMEOUT));
        self.changed.notify_all();
    }

    /// Returns whether the other agent is dialed whenever it is absent.
    pub fn is_dialed(&self) -> bool {
        lock(&self.dialing).always.is_some()
    }

    /// Returns the endpoint to dial at time `now`.
    fn endpoint(&self, now: u64) -> Option<String> {
        lock(&self.dialing).endpoint(now)
    }

    /// Returns whether the connection is unused.
    /// The other agent connected by itself, and has left.
    pub fn is_idle(&self, now: u64) -> bool {
        self.endpoint(now).is_none() && self.current().is_none() && lock(&self.peer).is_idle()
    }

    fn has_ended(&self) -> bool {
        self.ended.load(Ordering::SeqCst)
    }

    fn current(&self) -> Option<Arc<dyn Link>> {
        lock(&self.link).link.clone()
    }

    /// Takes a link that the other agent has dialed, with the received greeting.
    /// The error is the reason of a refusal.
    pub fn adopt(
        &self,
        context: &PeerContext,
        link: Arc<dyn Link>,
        instance: u64,
        packet: &[u8],
    ) -> Result<(), Option<String>> {
        let now = context.now();
        let mut current = lock(&self.link);
        if self.has_ended() {
            // It was idle; another attempt gets a new connection.
            return Err(None);
        }
        let mut peer = lock(&self.peer);
        if let Some(old) = &current.link {
            let other = peer.session().other().map(|other| other.instance);
            if other.is_some_and(|other| other != instance) {
                return Err(Some(crate::session::duplicate(&context.identity.agent, &self.agent)));
            }
            // When both dial at once, both keep the link of the one whose name comes first.
            if current.dialed.is_some() && context.identity.agent < self.agent {
                return Err(None);
            }
            old.close();
            peer.disconnect(now, "it is connected anew");
        }
        peer.set_clock_offset(context.clock_offset());
        peer.receive(now, packet, link.memory());
        *current = CurrentLink { link: Some(link), dialed: None, since: now };
        drop((peer, current));
        self.changed.notify_all();
        self.wake.notify(1);
        Ok(())
    }

    /// Closes a link, and clears it if it is the current one.
    fn drop_link(&self, context: &PeerContext, link: &Arc<dyn Link>, reason: &str) {
        let mut never_greeted = false;
        let mut current = lock(&self.link);
        if current.link.as_ref().is_some_and(|current| Arc::ptr_eq(current, link)) {
            *current = CurrentLink::default();
            let mut peer = lock(&self.peer);
            never_greeted = peer.session().other().is_none() && peer.session().refused().is_none();
            peer.disconnect(context.now(), reason);
        }
        // Only now, or the other thread would find it closed, and give another reason.
        link.close();
        drop(current);
        if never_greeted {
            self.record_refusal(context, reason.into());
        }
        self.changed.notify_all();
        self.wake.notify(1);
    }

    /// Runs the sending thread; `end_idle` ends connections that are not needed.
    pub fn send(&self, context: &PeerContext, end_idle: &dyn Fn()) {
        let mut states = PeerStates::new(&context.board, &self.agent);
        let mut states_at = 0;
        let mut used_at = 0;
        let mut packet = Vec::new();
        let mut unsent = false;
        let mut last: Option<Arc<dyn Link>> = None;
        while !self.has_ended() {
            let link = self.current();
            let same = match (&last, &link) {
                (Some(last), Some(link)) => Arc::ptr_eq(last, link),
                (None, None) => true,
                _ => false,
            };
            if !same {
                unsent = false;
                last.clone_from(&link);
            }
            // First what waits: the rest costs time, and can be done while it is on its way.
            let mut room = true;
            if let Some(link) = &link {
                match self.send_all(context, link, &mut packet, &mut unsent) {
                    Ok(sent) => room = sent,
                    Err(error) => {
                        // Earlier packets may contain the reason: the other thread reads them, and then drops the link.
                        self.wake.wait_timeout(DRAIN_TIMEOUT);
                        self.drop_link(context, link, &format!("the link broke: {error}"));
                        continue;
                    }
                }
            }
            // The link is locked before the agent.
            let shows = context.now() >= states_at;
            let dialed = if shows { self.dialed(context.now()) } else { String::new() };
            let mut peer = lock(&self.peer);
            let now = context.now();
            // Earlier events are handled; if it is lost now, it is silent.
            self.collect_events(&mut peer);
            peer.tick(now);
            let disconnected = self.collect_events(&mut peer);
            if used_at == 0 || link.is_none() || peer.is_used() {
                used_at = now;
            }
            if shows {
                states_at = now + STATE_PERIOD;
                states.update(&peer, &dialed, &self.explanation(), now);
            }
            let polls = context.poll.filter(|_| peer.serves()).map_or(u64::MAX, |poll| now + poll);
            let deadline = peer.deadline(now).min(states_at).min(polls);
            drop(peer);
            self.report_events(context);
            match &link {
                None => {
                    // This connection may have become idle.
                    end_idle();
                    self.wake.wait_timeout(POLL_PERIOD);
                }
                Some(link) if now - used_at > IDLE_TIMEOUT && self.is_unwanted(now) => {
                    self.drop_link(context, link, "it was unused");
                }
                // The link is silent; a new one may work.
                Some(link) if disconnected => self.drop_link(context, link, "it is silent"),
                Some(link) if !room => {
                    if link.wait_for_room(Duration::from_millis(5)).is_err() {
                        self.drop_link(context, link, "the link broke");
                    }
                }
                Some(_) => {
                    let left = deadline.saturating_sub(context.now());
                    if left > 0 {
                        self.wake.wait_timeout(Duration::from_nanos(left).min(POLL_PERIOD));
                    }
                }
            }
        }
    }

    /// Sends all pending packets; false if the link has no room.
    fn send_all(
        &self,
        context: &PeerContext,
        link: &Arc<dyn Link>,
        packet: &mut Vec<u8>,
        unsent: &mut bool,
    ) -> io::Result<bool> {
        loop {
            if !*unsent {
                let mut peer = lock(&self.peer);
                peer.set_clock_offset(context.clock_offset());
                if !peer.outgoing(context.now(), link.largest(), packet, link.memory()) {
                    return Ok(true);
                }
            }
            *unsent = !link.send(packet)?;
            if *unsent {
                return Ok(false);
            }
        }
    }

    /// Runs the receiving thread, which dials, too.
    pub fn receive(&self, context: &PeerContext) {
        let mut packet = Vec::new();
        let mut pause = MIN_DIAL_INTERVAL;
        while !self.has_ended() {
            let Some(link) = self.current() else {
                self.dial(context, &mut pause);
                continue;
            };
            packet.resize(link.largest() + 1, 0);
            match link.receive(&mut packet, POLL_PERIOD) {
                Ok(Some(length)) => {
                    let mut peer = lock(&self.peer);
                    let now = context.now();
                    peer.set_clock_offset(context.clock_offset());
                    peer.receive(now, &packet[..length], link.memory());
                    if peer.take_updated()
                        && let Some(updated) = &context.updated
                    {
                        updated.notify(1);
                    }
                    if peer.session().other().is_some() {
                        pause = MIN_DIAL_INTERVAL;
                    }
                    self.collect_events(&mut peer);
                    let answers = peer.deadline(now) <= now;
                    drop(peer);
                    if answers {
                        self.wake.notify(1);
                    }
                    self.report_events(context);
                }
                Ok(None) => self.check_greeting(context, &link),
                Err(error) => {
                    self.drop_link(context, &link, &format!("the link broke: {error}"));
                    self.pause(&mut pause);
                }
            }
        }
    }

    /// Returns the endpoint that this agent dials or has dialed.
    /// Empty if the other agent dialed.
    fn dialed(&self, now: u64) -> String {
        let current = lock(&self.link);
        match &current.link {
            Some(_) => current.dialed.clone().unwrap_or_default(),
            None => self.endpoint(now).unwrap_or_default(),
        }
    }

    /// Returns whether this agent has dialed the link and would not do so again.
    fn is_unwanted(&self, now: u64) -> bool {
        lock(&self.link).dialed.is_some() && self.endpoint(now).is_none()
    }

    /// Drops a link over which the other agent does not greet in time.
    fn check_greeting(&self, context: &PeerContext, link: &Arc<dyn Link>) {
        let since = lock(&self.link).since;
        let apart = lock(&self.peer).session().other().is_none();
        if apart && context.now().saturating_sub(since) > GREETING_TIMEOUT {
            self.drop_link(context, link, "it does not greet");
        }
    }

    fn dial(&self, context: &PeerContext, pause: &mut Duration) {
        let Some(endpoint) = self.endpoint(context.now()) else { return self.pause(pause) };
        // A thread that ends the connection sees this flag, or this thread sees the end.
        self.is_dialing.store(true, Ordering::SeqCst);
        let dial = |carrier: &Arc<dyn Carrier>| match self.has_ended() {
            true => Err(CarrierError::Nobody { endpoint: endpoint.clone() }),
            false => carrier.dial(&endpoint),
        };
        let dialed = context.carrier(&endpoint).and_then(dial);
        self.is_dialing.store(false, Ordering::SeqCst);
        match dialed {
            // The connection has ended meanwhile.
            Ok(link) if self.has_ended() => link.close(),
            Ok(link) => {
                if let Some(reason) = impostor(link.as_ref(), &self.agent) {
                    link.close();
                    self.record_refusal(context, reason);
                    return self.pause(pause);
                }
                let mut current = lock(&self.link);
                if current.link.is_none() {
                    *current = CurrentLink { link: Some(link), dialed: Some(endpoint), since: context.now() };
                }
                drop(current);
                self.wake.notify(1);
            }
            Err(error) => {
                match error {
                    // The agent may not have started yet.
                    CarrierError::Nobody { .. } => *lock(&self.dial_error) = Some(error.to_string()),
                    _ => self.record_refusal(context, error.to_string()),
                }
                self.pause(pause);
            }
        }
    }

    /// Records the reason for a missing link; it is reported when it changes.
    fn record_refusal(&self, context: &PeerContext, reason: String) {
        *lock(&self.dial_error) = None;
        let before = std::mem::replace(&mut *lock(&self.reason), reason.clone());
        if before != reason {
            lock(&self.events).push_back(PeerEvent::Refused { reason });
            self.report_events(context);
        }
    }

    /// Waits before the next attempt, unless the other agent has dialed.
    fn pause(&self, pause: &mut Duration) {
        let current = lock(&self.link);
        if current.link.is_none() && !self.has_ended() {
            // An early wake-up only causes another attempt.
            drop(self.changed.wait_timeout(current, *pause).unwrap_or_else(PoisonError::into_inner));
        }
        *pause = (*pause * 2).min(MAX_DIAL_INTERVAL);
    }

    /// Passes answers to their requests, and queues the other events for the host.
    /// Returns whether the other agent left.
    fn collect_events(&self, peer: &mut Peer) -> bool {
        let mut disconnected = false;
        for event in peer.unread_events() {
            match &event {
                PeerEvent::Connected { .. } => {
                    lock(&self.reason).clear();
                    *lock(&self.dial_error) = None;
                }
                PeerEvent::Disconnected { reason } | PeerEvent::Refused { reason } => {
                    disconnected |= matches!(event, PeerEvent::Disconnected { .. });
                    lock(&self.reason).clone_from(reason);
                }
                PeerEvent::Unserved { .. } | PeerEvent::Knowledge { .. } | PeerEvent::Rejected { .. } => {}
                PeerEvent::Answered { ticket, answer } => {
                    let mut waiting = lock(&self.waiting);
                    if let Some(sender) = waiting.answers.get(ticket) {
                        // The requester may have timed out.
                        let _ = sender.send(*answer);
                    }
                    if answer.is_final() {
                        waiting.answers.remove(ticket);
                    }
                }
                PeerEvent::Listed { request, answer } => {
                    if let Some(sender) = lock(&self.waiting).lists.remove(request) {
                        // As above.
                        let _ = sender.send(answer.clone());
                    }
                }
            }
            lock(&self.events).push_back(event);
        }
        disconnected
    }

    /// Reports queued events to the host, in order regardless of the thread.
    /// The other agent is not locked meanwhile, so the host may send requests at once.
    fn report_events(&self, context: &PeerContext) {
        let report_lock = lock(&self.report_lock);
        let next = || lock(&self.events).pop_front();
        while let Some(event) = next() {
            if let Some(notice) = &context.notice {
                notice(&self.agent, &event);
            }
        }
        drop(report_lock);
    }

    /// Returns the reason why the other agent left or was refused, if known.
    pub fn reason(&self) -> String {
        lock(&self.reason).clone()
    }

    /// Returns the reason why it is absent now.
    pub fn explanation(&self) -> String {
        lock(&self.dial_error).clone().unwrap_or_else(|| self.reason())
    }
}
