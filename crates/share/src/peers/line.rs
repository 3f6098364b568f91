//! The line to another agent: what its two threads share, and what they do. One sends, one receives; nobody else waits
//! for either of them.

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

/// How long a thread waits at most before it looks whether it is to end.
const LOOK: Duration = Duration::from_millis(100);

/// From one attempt to dial to the next: at first, and at most.
const SOON: Duration = Duration::from_millis(20);
const LATER: Duration = Duration::from_millis(500);

/// How long a link may take until both agents know of each other, nanoseconds.
const GREETING: u64 = 2_000_000_000;

/// How long a link over which nothing can be sent may still bring what came before.
const LAST_WORDS: Duration = Duration::from_millis(20);

/// How long a link stays that this agent has dialled and that nobody needs any more, nanoseconds.
const UNUSED: u64 = 5_000_000_000;

/// How often the states on the board are brought up to date, nanoseconds.
const STATES: u64 = 100_000_000;

/// The line to one other agent.
#[derive(Debug)]
pub(super) struct PeerLine {
    pub agent: String,
    pub peer: Mutex<Peer>,
    /// Wakes the thread that sends.
    pub wake: Arc<Wake>,
    dialling: Mutex<Dialling>,
    /// Whether somebody is being looked for, which takes its time.
    pub is_dialling: AtomicBool,
    /// Locked before the agent, by whoever needs both.
    link: Mutex<CurrentLink>,
    changed: Condvar,
    pub waiting: Mutex<PendingReplies>,
    reason: Mutex<String>,
    /// What came of dialling last, when nobody was there: that is told to nobody.
    nobody: Mutex<Option<String>>,
    /// What has happened and was not told, in order, and whoever tells it.
    untold: Mutex<VecDeque<Happening>>,
    telling: Mutex<()>,
    ended: AtomicBool,
}

/// The link in use.
#[derive(Debug, Default)]
struct CurrentLink {
    link: Option<Arc<dyn Link>>,
    /// Where this agent dialled it; nothing when the other one did.
    dialled: Option<String>,
    since: u64,
}

/// Who waits for an answer of the other agent.
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

    /// Dials the other agent whenever it is not there; no longer when that is nowhere.
    pub fn dial_at(&self, endpoint: Option<&str>) {
        locked(&self.dialling).always = endpoint.map(Into::into);
        self.changed.notify_all();
    }

    /// Dials it for a question.
    pub fn visit(&self, endpoint: &str, now: u64) {
        locked(&self.dialling).visit(endpoint, now.saturating_add(UNUSED));
        self.changed.notify_all();
    }

    /// Whether it is dialled whenever it is not there.
    pub fn is_dialled(&self) -> bool {
        locked(&self.dialling).always.is_some()
    }

    /// Where it is to be dialled now.
    fn endpoint(&self, now: u64) -> Option<String> {
        locked(&self.dialling).endpoint(now)
    }

    /// Whether nobody would miss it: the other agent came by itself, and is gone.
    pub fn is_idle(&self, now: u64) -> bool {
        self.endpoint(now).is_none() && self.current().is_none() && locked(&self.peer).is_idle()
    }

    fn has_ended(&self) -> bool {
        self.ended.load(Ordering::SeqCst)
    }

    fn current(&self) -> Option<Arc<dyn Link>> {
        locked(&self.link).link.clone()
    }

    /// Takes a link that the other agent has dialled, with the greeting that came over it; or says why not.
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

    /// The link is of no use any more.
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

    /// What the sending thread does; `end_idle` ends lines that nobody needs.
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

    /// Sends what there is; false when there was no room for all.
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

    /// What the receiving thread does: it dials, too.
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

    /// Where this agent dials, or has dialled the link there is; empty when the other one did.
    fn dialled(&self, now: u64) -> String {
        let current = locked(&self.link);
        match &current.link {
            Some(_) => current.dialled.clone().unwrap_or_default(),
            None => self.endpoint(now).unwrap_or_default(),
        }
    }

    /// Whether this agent has dialled the link, and would not do so again.
    fn is_unwanted(&self, now: u64) -> bool {
        locked(&self.link).dialled.is_some() && self.endpoint(now).is_none()
    }

    /// A link over which the other agent does not greet is tried no longer.
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

    /// There is no link, for a reason that is told when it is another one than before.
    fn is_refused(&self, context: &PeerContext, reason: String) {
        *locked(&self.nobody) = None;
        let before = std::mem::replace(&mut *locked(&self.reason), reason.clone());
        if before != reason {
            locked(&self.untold).push_back(Happening::Refused { reason });
            self.tell(context);
        }
    }

    /// Waits, but not when the other agent has dialled.
    fn pause(&self, pause: &mut Duration) {
        let current = locked(&self.link);
        if current.link.is_none() && !self.has_ended() {
            // Who wakes up too early tries once more.
            drop(self.changed.wait_timeout(current, *pause).unwrap_or_else(PoisonError::into_inner));
        }
        *pause = (*pause * 2).min(LATER);
    }

    /// Answers whoever waits for what has happened, and keeps it in order until it is told; whether the other agent went
    /// away.
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

    /// Tells the host what has happened, in that order whichever thread does it. The other agent is not locked meanwhile, so
    /// the host may ask for something at once.
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

    /// Why the other agent went away or was not let in, where that is known.
    pub fn reason(&self) -> String {
        locked(&self.reason).clone()
    }

    /// Why it is not there now.
    pub fn explanation(&self) -> String {
        locked(&self.nobody).clone().unwrap_or_else(|| self.reason())
    }
}
