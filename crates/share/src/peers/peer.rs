//! Peer: another agent, as seen from this agent's board.
//! It has no thread and no clock: see [`super::Peers`].

use std::collections::VecDeque;
use std::sync::Arc;

use slate_blackboard::wake::Wake;
use slate_blackboard::{Board, Event as BoardEvent, Observer, Pattern, Url};
use slate_sorted::SortedMap;

use super::exchange::{LiveExchange, PeerExchange};
use super::export::{Export, Unserved};
use super::import::{Import, Status};
use super::inspection::{Answers, PropertyQuery};
use super::messages::{Incoming, Messages};
use super::rights::{is_of_team, may_read, may_send};
use super::{Allowance, PeerEvent, WantedProperty};
use crate::carrier::SharedMemory;
use crate::session::{
    Compression, Content, DeliveryStatus, Event, Identity, Limits, Options, Seen, SendError, Session,
};

/// Polling period of a property that does not exist yet, ns.
/// Other names of properties appear without an event.
const RETRY_PERIOD: u64 = 200_000_000;

/// Polling period of a mailbox's answers, ns.
const ANSWER_POLL_PERIOD: u64 = 2_000_000;

/// Largest number of unread events.
const MAX_UNREAD_EVENTS: usize = 4096;

/// Longest path of a subscription, bytes.
const MAX_PATH_LENGTH: usize = 1024;

/// Bytes of control messages that stay reserved while a question is answered.
const CONTROL_RESERVE: usize = 1 << 20;

/// Peer: the session with another agent, its subscriptions here, and its mirrors.
#[derive(Debug)]
pub struct Peer {
    pub(super) session: Session,
    pub(super) exchange: PeerExchange,
    queries: SortedMap<u32, PropertyQuery>,
    answers: Answers,
    messages: Messages,
    observer: Observer,
    missed: u64,
    unread_events: VecDeque<PeerEvent>,
    retry_at: u64,
}

impl Peer {
    /// Creates a peer of that name, which is not connected.
    /// `wake` is notified when this agent has something for it.
    pub fn new(board: &Arc<Board>, own: Identity, agent: &str, limits: Limits, wake: &Arc<Wake>) -> Self {
        // A pattern of any path.
        let all = Pattern::parse("**").unwrap_or_else(|_| unreachable!("it is a pattern"));
        Self {
            session: Session::new(own, Some(agent), limits),
            exchange: PeerExchange::new(board, agent, wake),
            queries: SortedMap::new(),
            answers: Answers::default(),
            messages: Messages::default(),
            observer: board.observe(&all, 256, Some(Arc::clone(wake))),
            missed: 0,
            unread_events: VecDeque::new(),
            retry_at: 0,
        }
    }

    /// Restricts the other agent to these rights; unrestricted for `None`.
    #[must_use]
    pub fn allow(mut self, allowance: Option<Allowance>) -> Self {
        self.exchange.allowance = allowance;
        self
    }

    /// Returns the other agent's name.
    pub fn agent(&self) -> &str {
        &self.exchange.agent
    }

    /// Returns the session with the other agent.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Subscribes to a property; its mirror is at `agents/<agent>/<path>`.
    ///
    /// # Errors
    /// When the mirror's path is taken, there are too many subscriptions, or JPEG is wanted and not built in.
    pub fn subscribe(&mut self, want: WantedProperty) -> Result<u32, String> {
        Url::parse(&format!("/{}", want.path)).map_err(|error| error.to_string())?;
        if !cfg!(feature = "jpeg") && matches!(want.options.compression, Compression::Jpeg(_)) {
            return Err("this program was built without JPEG: build it with the feature `jpeg`".into());
        }
        let mut import = Import::new(&self.exchange.agent, want);
        if self.exchange.board.get(&import.mirror_path).is_some_and(|(_, field)| field.is_empty()) {
            return Err(format!("/{} exists already", import.mirror_path));
        }
        import.prepare(&self.exchange.board)?;
        let (path, options) = (import.want.path.clone(), import.want.options);
        match self.session.subscribe(&path, options) {
            Ok(id) => {
                self.exchange.imports.insert(id, import);
                Ok(id)
            }
            Err(error) => {
                let _ = self.exchange.board.remove(&import.mirror_path);
                Err(error.to_string())
            }
        }
    }

    /// Ends a subscription, and removes its mirror from the board.
    pub fn unsubscribe(&mut self, id: u32) {
        self.session.unsubscribe(id);
        if let Some(import) = self.exchange.imports.remove(&id)
            && import.mirror.is_some()
        {
            // It may be removed already.
            let _ = self.exchange.board.remove(&import.mirror_path);
        }
    }

    /// Returns the status of a subscription.
    pub fn status(&self, id: u32) -> Option<&Status> {
        self.exchange.imports.get(&id).map(|import| &import.status)
    }

    /// Sends a message to a mailbox of the other agent.
    /// Its status follows as a [`PeerEvent`].
    ///
    /// # Errors
    /// When the other agent is not there, or too much waits for it: the message is not sent then.
    pub fn send(&mut self, path: &str, schema: u64, items: usize, bytes: &[u8]) -> Result<u64, SendError> {
        self.session.send(path, schema, items as u64, bytes)
    }

    /// Sends a message of the team's knowledge; false if it is lost already.
    pub fn send_knowledge(&mut self, message: &[u8]) -> bool {
        is_of_team(self.exchange.allowance.as_ref()) && self.session.send_knowledge(message)
    }

    /// Asks for the properties that match a pattern.
    /// With `values`, their newest values are included. The answer is a [`PeerEvent`].
    ///
    /// # Errors
    /// When the other agent is not there, or has not answered the last questions.
    pub fn query(&mut self, pattern: &str, values: bool) -> Result<u32, SendError> {
        self.session.query(pattern, values)
    }

    /// Gives up waiting for the answer to a question.
    pub fn cancel_query(&mut self, request: u32) {
        self.session.cancel_query(request);
        self.answers.forget(request);
    }

    /// Returns the events since the last call.
    /// If it is not called for long, the oldest are dropped. Answers are not, as they are no more than this agent's
    /// messages and questions.
    pub fn unread_events(&mut self) -> impl Iterator<Item = PeerEvent> + '_ {
        self.unread_events.drain(..)
    }

    fn push_event(&mut self, event: PeerEvent) {
        if self.unread_events.len() >= MAX_UNREAD_EVENTS {
            let is_answer =
                |event: &PeerEvent| matches!(event, PeerEvent::Answered { .. } | PeerEvent::Listed { .. });
            if let Some(oldest) = self.unread_events.iter().position(|event| !is_answer(event)) {
                self.unread_events.remove(oldest);
            }
        }
        self.unread_events.push_back(event);
    }

    /// Returns whether a mirror was written since the last call.
    pub fn take_updated(&mut self) -> bool {
        std::mem::take(&mut self.exchange.updated)
    }

    /// Sets the offset of the values' clock to the clock of `now`, ns.
    pub fn set_clock_offset(&mut self, clock_offset: i64) {
        self.exchange.clock_offset = clock_offset;
    }

    /// Takes the mirrors off the board.
    pub(super) fn remove_mirrors(&mut self) {
        self.exchange.remove_mirrors();
    }

    /// Takes a packet that arrived at `now`.
    pub fn receive(&mut self, now: u64, packet: &[u8], memory: Option<&dyn SharedMemory>) {
        self.exchange.estimate = self.session.estimate();
        self.session.receive(now, packet, &mut LiveExchange { exchange: &mut self.exchange, memory });
        self.react(now);
    }

    /// Ends the connection when the host knows that it is cut.
    pub fn disconnect(&mut self, now: u64, reason: &str) {
        self.session.disconnect(
            now,
            reason,
            &mut LiveExchange { exchange: &mut self.exchange, memory: None },
        );
        self.react(now);
    }

    /// Advances the time, and handles events of the board.
    pub fn tick(&mut self, now: u64) {
        self.session.tick(now, &mut LiveExchange { exchange: &mut self.exchange, memory: None });
        self.react(now);
        self.observe(now);
        self.messages.forward_answers(&mut self.session);
        self.answer_queries();
    }

    /// Writes the next packet, if there is something to be sent.
    pub fn outgoing(
        &mut self,
        now: u64,
        largest: usize,
        packet: &mut Vec<u8>,
        memory: Option<&dyn SharedMemory>,
    ) -> bool {
        self.session.outgoing(
            now,
            largest,
            packet,
            &mut LiveExchange { exchange: &mut self.exchange, memory },
        )
    }

    /// Returns the time of the next action, unless a packet or a wake-up comes before.
    pub fn deadline(&mut self, now: u64) -> u64 {
        let mut next =
            self.session.deadline(now, &mut LiveExchange { exchange: &mut self.exchange, memory: None });
        if self.messages.is_open() {
            next = next.min(now + ANSWER_POLL_PERIOD);
        }
        if !self.queries.is_empty() {
            next = next.min(now + ANSWER_POLL_PERIOD);
        }
        if self.exchange.exports.values().any(|export| export.source.is_none()) {
            next = next.min(self.retry_at);
        }
        next
    }

    /// Returns whether this agent reads nothing there, and the other one nothing here.
    pub fn is_idle(&self) -> bool {
        self.exchange.imports.is_empty() && self.session.other().is_none()
    }

    /// Returns whether either agent reads the other, or waits for an answer.
    pub fn is_used(&self) -> bool {
        let reads = !self.exchange.imports.is_empty() || !self.exchange.exports.is_empty();
        reads || self.messages.is_open() || self.session.has_pending()
    }

    /// Returns whether properties are served whose writers do not notify by themselves.
    pub fn serves(&self) -> bool {
        !self.exchange.exports.is_empty()
    }

    fn react(&mut self, now: u64) {
        while let Some(event) = self.exchange.events.pop_front() {
            self.react_to(event, now);
        }
    }

    fn react_to(&mut self, event: Event, now: u64) {
        match event {
            Event::Connected { instance, .. } => self.push_event(PeerEvent::Connected { instance }),
            Event::Disconnected { reason } => self.react_to_end(reason),
            Event::Refused { reason } => self.push_event(PeerEvent::Refused { reason }),
            Event::Accepted { id, offer } => {
                let PeerExchange { imports, board, .. } = &mut self.exchange;
                let Some(import) = imports.get_mut(&id) else { return };
                if let Err(reason) = import.accept(board, &offer, self.session.limits().value) {
                    import.status = Status::Refused(reason.clone());
                    let path = import.want.path.clone();
                    self.session.refuse_offer(id);
                    self.push_event(PeerEvent::Unserved { path, reason });
                }
            }
            Event::Waiting { id, reason } => self.react_to_delay(id, reason, Status::Waiting),
            Event::Declined { id, reason } => self.react_to_delay(id, reason, Status::Refused),
            Event::WriterLeft { id, generation } => {
                if let Some(import) = self.exchange.imports.get_mut(&id) {
                    import.remove_writer(generation);
                }
            }
            Event::Subscribed { id, path, options, seen } => {
                self.react_to_subscription(id, path, options, seen, now);
            }
            Event::Unsubscribed { id } => {
                self.exchange.exports.remove(&id);
            }
            Event::Message { ticket, path, schema, items, bytes } => {
                self.react_to_message(&Incoming { ticket, path, schema, items, bytes }, now);
            }
            Event::Answered { ticket, answer } => self.push_event(PeerEvent::Answered { ticket, answer }),
            Event::Asked { request, pattern, values } => match PropertyQuery::new(&pattern, values) {
                Some(query) => {
                    self.queries.insert(request, query);
                }
                None => self.session.decline_query(request, "that is not a pattern of paths"),
            },
            Event::Part { request, bytes, last } => {
                if let Some(answer) = self.answers.take(request, &bytes, last) {
                    // The rest of an invalid answer is ignored.
                    self.session.cancel_query(request);
                    self.push_event(PeerEvent::Listed { request, answer });
                }
            }
            Event::Knowledge { bytes } => {
                if is_of_team(self.exchange.allowance.as_ref()) {
                    self.push_event(PeerEvent::Knowledge { bytes });
                }
            }
            Event::Failed { request, reason } => {
                self.answers.forget(request);
                self.push_event(PeerEvent::Listed { request, answer: Err(reason) });
            }
        }
    }

    fn react_to_end(&mut self, reason: String) {
        self.queries.clear();
        self.messages.end();
        for import in self.exchange.imports.values_mut() {
            import.mark_unreachable();
            import.status = Status::Unanswered;
        }
        self.push_event(PeerEvent::Disconnected { reason });
    }

    /// Notes that a subscription of this agent brings no values, at least for now.
    fn react_to_delay(&mut self, id: u32, reason: String, status: impl FnOnce(String) -> Status) {
        let Some(import) = self.exchange.imports.get_mut(&id) else { return };
        import.mark_unreachable();
        import.status = status(reason.clone());
        let path = import.want.path.clone();
        self.push_event(PeerEvent::Unserved { path, reason });
    }

    fn react_to_subscription(
        &mut self,
        id: u32,
        path: String,
        options: Options,
        seen: Option<Seen>,
        now: u64,
    ) {
        // A served property is on the board under the same path.
        if path.len() > MAX_PATH_LENGTH || Url::parse(&format!("/{path}")).is_err() {
            return self.session.decline(id, "that is not a path of a property");
        }
        if !may_read(self.exchange.allowance.as_ref(), &path) {
            let own = &self.session.own().agent;
            let reason =
                format!("agent `{own}` does not allow agent `{}` to read /{path}", self.exchange.agent);
            return self.session.decline(id, &reason);
        }
        let export = Export::new(path, options, seen, Arc::clone(&self.exchange.wake));
        self.exchange.exports.insert(id, export);
        self.serve(id, now);
    }

    fn react_to_message(&mut self, message: &Incoming, now: u64) {
        if !may_send(self.exchange.allowance.as_ref(), &message.path) {
            return self.session.answer(message.ticket, DeliveryStatus::Denied);
        }
        let time = now.saturating_add_signed(self.exchange.clock_offset);
        self.messages.deliver(&self.exchange.board, message, time, &mut self.session);
        self.exchange.updated = true;
    }

    /// Connects a subscription of the other agent to its property.
    fn serve(&mut self, id: u32, now: u64) {
        let instance = self.session.own().instance;
        let Some(export) = self.exchange.exports.get_mut(&id) else { return };
        match export.connect(&self.exchange.board, instance, self.exchange.allowance.as_ref()) {
            Ok(offer) => {
                export.waiting.clear();
                self.session.accept(id, &offer);
                // A property without a writer has no value that is still true.
                let left = export.source.as_ref().filter(|source| !source.property().has_writer());
                if let Some(source) = left {
                    self.session.writer_left(id, source.property().generation());
                }
            }
            Err(Unserved::Waits(reason)) => {
                self.retry_at = now + RETRY_PERIOD;
                if export.waiting != reason {
                    self.session.wait(id, &reason);
                    export.waiting = reason;
                }
            }
            Err(Unserved::Declined(reason)) => {
                self.exchange.exports.remove(&id);
                self.session.decline(id, &reason);
            }
        }
    }

    fn observe(&mut self, now: u64) {
        let mut retry = now >= self.retry_at;
        while let Some(event) = self.observer.next() {
            match event {
                BoardEvent::Appeared(_) => retry = true,
                BoardEvent::Vanished(path) => self.end_exports(|of| of == &*path),
                BoardEvent::WriterLeft(path, generation) => {
                    let serves = |export: &Export| {
                        export.source.as_ref().is_some_and(|source| source.property().path() == &*path)
                    };
                    let ids =
                        self.exchange.exports.iter().filter(|(_, export)| serves(export)).map(|(id, _)| *id);
                    ids.for_each(|id| self.session.writer_left(id, generation));
                }
                _ => {}
            }
        }
        if self.observer.missed() > self.missed {
            self.missed = self.observer.missed();
            // Events were lost, so each missing property has vanished.
            let board = Arc::clone(&self.exchange.board);
            self.end_exports(|path| board.get(path).is_none());
            retry = true;
        }
        if retry {
            let waiting = |export: &Export| export.source.is_none();
            let ids: Vec<u32> = self
                .exchange
                .exports
                .iter()
                .filter(|(_, export)| waiting(export))
                .map(|(id, _)| *id)
                .collect();
            ids.into_iter().for_each(|id| self.serve(id, now));
        }
    }

    /// Ends exports of properties that are gone.
    fn end_exports(&mut self, gone: impl Fn(&str) -> bool) {
        for (id, export) in &mut self.exchange.exports {
            if export.source.as_ref().is_some_and(|source| gone(source.property().path())) {
                export.source = None;
                export.waiting = format!("/{} was removed", export.path);
                self.session.wait(*id, &export.waiting);
                // It may be back under the same path already.
                self.retry_at = 0;
            }
        }
    }

    fn answer_queries(&mut self) {
        let largest = self.session.limits().value / 2;
        while self.session.room() > CONTROL_RESERVE
            && let Some((&request, query)) = self.queries.iter_mut().next()
        {
            let (part, last) = query.next(&self.exchange.board, largest, self.exchange.allowance.as_ref());
            self.session.send_part(request, &part, last);
            if last {
                self.queries.remove(&request);
            }
        }
    }

    /// Returns the number of queued values that wait to be sent.
    pub(super) fn lag(&self, id: u32) -> u64 {
        let export = self.exchange.exports.get(&id).filter(|export| export.options.content == Content::All);
        export.and_then(|export| export.source.as_ref()).map_or(0, |source| source.lag())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.remove_mirrors();
    }
}
