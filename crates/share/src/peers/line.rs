//! Connection to another agent, with a sending and a receiving thread.
//! No other thread waits for these two.

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use slate_blackboard::wake::Wake;

use super::context::{PeerContext, impostor, locked};
use super::dialling::Dialling;
use super::state::PeerStates;
use super::{Happening, Peer, RemoteProperty};
use crate::carrier::{Carrier, CarrierError, Link};
use crate::session::DeliveryStatus;

/// Longest wait of a thread until it checks for the end.
const LOOK: Duration = Duration::from_millis(100);

/// Shortest interval between attempts to dial, and longest interval.
const SOON: Duration = Duration::from_millis(20);
const LATER: Duration = Duration::from_millis(500);

/// Timeout of a link until both agents know of each other, ns.
const GREETING: u64 = 2_000_000_000;

/// Time in which a link that can't send may still deliver received data.
const LAST_WORDS: Duration = Duration::from_millis(20);

/// Lifetime of an unused link that this agent has dialled, ns.
const UNUSED: u64 = 5_000_000_000;

/// Update period of the states on the board, ns.
const STATES: u64 = 100_000_000;

/// Connection to one other agent.
#[derive(Debug)]
pub(super) struct PeerLine {
    pub agent: String,
    pub peer: Mutex<Peer>,
    /// Wake of the sending thread.
    pub wake: Arc<Wake>,
    dialling: Mutex<Dialling>,
    /// Flag of dialling in progress, which may take long.
    pub is_dialling: AtomicBool,
    /// Current link; locked before the agent by threads that need both.
    link: Mutex<CurrentLink>,
    changed: Condvar,
    pub waiting: Mutex<PendingReplies>,
    reason: Mutex<String>,
    /// Last error of dialling an absent agent; it is not reported.
    nobody: Mutex<Option<String>>,
    /// Queue of events to report, and the lock of the thread that reports them.
    untold: Mutex<VecDeque<Happening>>,
    telling: Mutex<()>,
    ended: AtomicBool,
}

/// The link in use.
#[derive(Debug, Default)]
struct CurrentLink {
    link: Option<Arc<dyn Link>>,
    /// Endpoint at which this agent dialled; `None` if the other agent did.
    dialled: Option<String>,
    since: u64,
}

/// Requests that wait for an answer of the other agent.
#[derive(Debug, Default)]
pub(super) struct PendingReplies {
    pub answers: BTreeMap<u64, Sender<DeliveryStatus>>,
    pub lists: BTreeMap<u32, Sender<Result<Vec<RemoteProperty>, String>>>,
}

impl PeerLine {
    pub fn new(peer: Peer, wake: Arc<Wake>) -> Self {
        Self {
            agent: peer.agent().into(),
            peer: Mutex::new(peer),
            wake,
            dialling: Mutex::default(),
            is_dialling: AtomicBool::new(false),
            link: Mutex::default(),
            changed: Condvar::new(),
            waiting: Mutex::default(),
            reason: Mutex::default(),
            nobody: Mutex::default(),
            untold: Mutex::default(),
            telling: Mutex::default(),
            ended: AtomicBool::new(false),
        }
    }

    pub fn end(&self) {
        self.ended.store(true, Ordering::SeqCst);
        if let Some(link) = &locked(&self.link).link {
            link.close();
        }
        self.changed.notify_all();
        self.wake.notify(1);
    }

    /// Sets the endpoint that is dialled whenever the agent is absent; none for `None`.
    pub fn dial_at(&self, endpoint: Option<&str>) {
        locked(&self.dialling).always = endpoint.map(Into::into);
        self.changed.notify_all();
    }

    /// Dials the agent for a query.
    pub fn visit(&self, endpoint: &str, now: u64) {
        locked(&self.dialling).visit(endpoint, now.saturating_add(UNUSED));
        self.changed.notify_all();
    }

    /// Returns whether the other agent is dialled whenever it is absent.
    pub fn is_dialled(&self) -> bool {
        locked(&self.dialling).always.is_some()
    }

    /// Returns the endpoint to dial at time `now`.
    fn endpoint(&self, now: u64) -> Option<String> {
        locked(&self.dialling).endpoint(now)
    }

    /// Returns whether the line is unused.
    /// The other agent connected by itself, and has left.
    pub fn is_idle(&self, now: u64) -> bool {
        self.endpoint(now).is_none() && self.current().is_none() && locked(&self.peer).is_idle()
    }

    fn has_ended(&self) -> bool {
        self.ended.load(Ordering::SeqCst)
    }

    fn current(&self) -> Option<Arc<dyn Link>> {
        locked(&self.link).link.clone()
    }

    /// Takes a link that the other agent has dialled, with the received greeting.
    /// The error is the reason of a refusal.
    pub fn adopt(
        &self,
        context: &PeerContext,
        link: Arc<dyn Link>,
        instance: u64,
        packet: &[u8],
    ) -> Result<(), Option<String>> {
        let now = context.now();
        let mut current = locked(&self.link);
        if self.has_ended() {
            // It was idle a moment ago; whoever dials again finds another one.
            return Err(None);
        }
        let mut peer = locked(&self.peer);
        if let Some(old) = &current.link {
            let other = peer.session().other().map(|other| other.instance);
            if other.is_some_and(|other| other != instance) {
                return Err(Some(crate::session::duplicate(&context.identity.agent, &self.agent)));
            }
            // When both dial at once, both keep the link of the one whose name comes first.
            if current.dialled.is_some() && context.identity.agent < self.agent {
                return Err(None);
            }
            old.close();
            peer.disconnect(now, "it is connected anew");
        }
        peer.set_lead(context.lead());
        peer.receive(now, packet, link.memory());
        *current = CurrentLink { link: Some(link), dialled: None, since: now };
        drop((peer, current));
        self.changed.notify_all();
        self.wake.notify(1);
        Ok(())
    }

    /// Closes a link, and clears it if it is the current one.
    fn drop_link(&self, context: &PeerContext, link: &Arc<dyn Link>, reason: &str) {
        let mut unheard = false;
        let mut current = locked(&self.link);
        if current.link.as_ref().is_some_and(|current| Arc::ptr_eq(current, link)) {
            *current = CurrentLink::default();
            let mut peer = locked(&self.peer);
            unheard = peer.session().other().is_none() && peer.session().refused().is_none();
            peer.disconnect(context.now(), reason);
        }
        // Only now, or the other thread would find it closed, and give another reason.
        link.close();
        drop(current);
        if unheard {
            self.is_refused(context, reason.into());
        }
        self.changed.notify_all();
        self.wake.notify(1);
    }

    /// Runs the sending thread; `end_idle` ends lines that are not needed.
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
                        // What came before may say why: the other thread takes it, and then it drops the link.
                        self.wake.wait_timeout(LAST_WORDS);
                        self.drop_link(context, link, &format!("the link broke: {error}"));
                        continue;
                    }
                }
            }
            // The link is locked before the agent.
            let shows = context.now() >= states_at;
            let dialled = if shows { self.dialled(context.now()) } else { String::new() };
            let mut peer = locked(&self.peer);
            let now = context.now();
            // What happened until now has been dealt with; if it is gone now, that is because it is silent.
            self.report(&mut peer);
            peer.tick(now);
            let gone = self.report(&mut peer);
            if used_at == 0 || link.is_none() || peer.is_used() {
                used_at = now;
            }
            if shows {
                states_at = now + STATES;
                states.update(&peer, &dialled, &self.explanation(), now);
            }
            let polls = context.poll.filter(|_| peer.serves()).map_or(u64::MAX, |poll| now + poll);
            let deadline = peer.deadline(now).min(states_at).min(polls);
            drop(peer);
            self.tell(context);
            match &link {
                None => {
                    // It may be one that was needed until now.
                    end_idle();
                    self.wake.wait_timeout(LOOK);
                }
                Some(link) if now - used_at > UNUSED && self.is_unwanted(now) => {
                    self.drop_link(context, link, "nobody needed it");
                }
                // Nothing is heard over it, so a new one may be better.
                Some(link) if gone => self.drop_link(context, link, "it is silent"),
                Some(link) if !room => {
                    if link.wait_for_room(Duration::from_millis(5)).is_err() {
                        self.drop_link(context, link, "the link broke");
                    }
                }
                Some(_) => {
                    let left = deadline.saturating_sub(context.now());
                    if left > 0 {
                        self.wake.wait_timeout(Duration::from_nanos(left).min(LOOK));
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
                let mut peer = locked(&self.peer);
                peer.set_lead(context.lead());
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
        let mut pause = SOON;
        while !self.has_ended() {
            let Some(link) = self.current() else {
                self.dial(context, &mut pause);
                continue;
            };
            packet.resize(link.largest() + 1, 0);
            match link.receive(&mut packet, LOOK) {
                Ok(Some(length)) => {
                    let mut peer = locked(&self.peer);
                    let now = context.now();
                    peer.set_lead(context.lead());
                    peer.receive(now, &packet[..length], link.memory());
                    if peer.take_shown()
                        && let Some(updated) = &context.updated
                    {
                        updated.notify(1);
                    }
                    if peer.session().other().is_some() {
                        pause = SOON;
                    }
                    self.report(&mut peer);
                    let answers = peer.deadline(now) <= now;
                    drop(peer);
                    if answers {
                        self.wake.notify(1);
                    }
                    self.tell(context);
                }
                Ok(None) => self.give_up(context, &link),
                Err(error) => {
                    self.drop_link(context, &link, &format!("the link broke: {error}"));
                    self.pause(&mut pause);
                }
            }
        }
    }

    /// Returns the endpoint that this agent dials or has dialled.
    /// Empty if the other agent dialled.
    fn dialled(&self, now: u64) -> String {
        let current = locked(&self.link);
        match &current.link {
            Some(_) => current.dialled.clone().unwrap_or_default(),
            None => self.endpoint(now).unwrap_or_default(),
        }
    }

    /// Returns whether this agent has dialled the link and would not do so again.
    fn is_unwanted(&self, now: u64) -> bool {
        locked(&self.link).dialled.is_some() && self.endpoint(now).is_none()
    }

    /// Drops a link over which the other agent does not greet in time.
    fn give_up(&self, context: &PeerContext, link: &Arc<dyn Link>) {
        let since = locked(&self.link).since;
        let apart = locked(&self.peer).session().other().is_none();
        if apart && context.now().saturating_sub(since) > GREETING {
            self.drop_link(context, link, "it does not greet");
        }
    }

    fn dial(&self, context: &PeerContext, pause: &mut Duration) {
        let Some(endpoint) = self.endpoint(context.now()) else { return self.pause(pause) };
        // Whoever ends the line sees this, or is seen here.
        self.is_dialling.store(true, Ordering::SeqCst);
        let dial = |carrier: &Arc<dyn Carrier>| match self.has_ended() {
            true => Err(CarrierError::Nobody { endpoint: endpoint.clone() }),
            false => carrier.dial(&endpoint),
        };
        let dialled = context.carrier(&endpoint).and_then(dial);
        self.is_dialling.store(false, Ordering::SeqCst);
        match dialled {
            // Nobody waited for it.
            Ok(link) if self.has_ended() => link.close(),
            Ok(link) => {
                if let Some(reason) = impostor(link.as_ref(), &self.agent) {
                    link.close();
                    self.is_refused(context, reason);
                    return self.pause(pause);
                }
                let mut current = locked(&self.link);
                if current.link.is_none() {
                    *current =
                        CurrentLink { link: Some(link), dialled: Some(endpoint), since: context.now() };
                }
                drop(current);
                self.wake.notify(1);
            }
            Err(error) => {
                match error {
                    // It may come in a moment.
                    CarrierError::Nobody { .. } => *locked(&self.nobody) = Some(error.to_string()),
                    _ => self.is_refused(context, error.to_string()),
                }
                self.pause(pause);
            }
        }
    }

    /// Records the reason for a missing link; it is reported when it changes.
    fn is_refused(&self, context: &PeerContext, reason: String) {
        *locked(&self.nobody) = None;
        let before = std::mem::replace(&mut *locked(&self.reason), reason.clone());
        if before != reason {
            locked(&self.untold).push_back(Happening::Refused { reason });
            self.tell(context);
        }
    }

    /// Waits before the next attempt, unless the other agent has dialled.
    fn pause(&self, pause: &mut Duration) {
        let current = locked(&self.link);
        if current.link.is_none() && !self.has_ended() {
            // Who wakes up too early tries once more.
            drop(self.changed.wait_timeout(current, *pause).unwrap_or_else(PoisonError::into_inner));
        }
        *pause = (*pause * 2).min(LATER);
    }

    /// Passes answers to their requests, and queues the other events for the host.
    /// Returns whether the other agent left.
    fn report(&self, peer: &mut Peer) -> bool {
        let mut gone = false;
        for happening in peer.happenings() {
            match &happening {
                Happening::Connected { .. } => {
                    locked(&self.reason).clear();
                    *locked(&self.nobody) = None;
                }
                Happening::Disconnected { reason } | Happening::Refused { reason } => {
                    gone |= matches!(happening, Happening::Disconnected { .. });
                    locked(&self.reason).clone_from(reason);
                }
                Happening::Unserved { .. } | Happening::Told { .. } | Happening::Rejected { .. } => {}
                Happening::Answered { ticket, answer } => {
                    let mut waiting = locked(&self.waiting);
                    if let Some(sender) = waiting.answers.get(ticket) {
                        // Who asked may wait no longer.
                        let _ = sender.send(*answer);
                    }
                    if answer.is_final() {
                        waiting.answers.remove(ticket);
                    }
                }
                Happening::Listed { request, answer } => {
                    if let Some(sender) = locked(&self.waiting).lists.remove(request) {
                        // As above.
                        let _ = sender.send(answer.clone());
                    }
                }
            }
            locked(&self.untold).push_back(happening);
        }
        gone
    }

    /// Reports queued events to the host, in order regardless of the thread.
    /// The other agent is not locked meanwhile, so the host may send requests at once.
    fn tell(&self, context: &PeerContext) {
        let telling = locked(&self.telling);
        let next = || locked(&self.untold).pop_front();
        while let Some(happening) = next() {
            if let Some(notice) = &context.notice {
                notice(&self.agent, &happening);
            }
        }
        drop(telling);
    }

    /// Returns the reason why the other agent left or was refused, if known.
    pub fn reason(&self) -> String {
        locked(&self.reason).clone()
    }

    /// Returns the reason why it is absent now.
    pub fn explanation(&self) -> String {
        locked(&self.nobody).clone().unwrap_or_else(|| self.reason())
    }
}
