//! Another agent, as seen from this agent's board. It has no thread and no clock: see [`super::Peers`].

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use slate_blackboard::wake::Wake;
use slate_blackboard::{Board, Event as BoardEvent, Observer, Pattern, Url};

use super::exchange::{LiveExchange, PeerExchange};
use super::export::{Export, Unserved};
use super::import::{Import, Status};
use super::inspection::{Answers, PropertyQuestion};
use super::messages::{Incoming, Messages};
use super::rights::{is_of_team, may_read, may_send};
use super::{Allowance, Happening, Want};
use crate::carrier::SharedMemory;
use crate::session::{
    Compression, Content, DeliveryStatus, Event, Identity, Limits, Options, Seen, SendError, Session,
};

/// How often a property is looked for that is not there; other names of properties come without an event.
const RETRY: u64 = 200_000_000;

/// How often a mailbox is asked for answers.
const SETTLE: u64 = 2_000_000;

/// How many happenings wait for whoever is interested.
const HAPPENINGS: usize = 4096;

/// Bytes of a path that another agent may ask for.
const LONGEST_PATH: usize = 1024;

/// Bytes of control messages that are left free for others while a question is answered.
const RESERVE: usize = 1 << 20;

/// Another agent: the session with it, what it reads here, and the mirrors of what is read there.
#[derive(Debug)]
pub struct Peer {
    pub(super) session: Session,
    pub(super) exchange: PeerExchange,
    questions: BTreeMap<u32, PropertyQuestion>,
    answers: Answers,
    messages: Messages,
    observer: Observer,
    missed: u64,
    happenings: VecDeque<Happening>,
    retry_at: u64,
}

impl Peer {
    /// Another agent of that name, which is not connected. `wake` is notified when this agent has something for it.
    pub fn new(board: &Arc<Board>, own: Identity, agent: &str, limits: Limits, wake: &Arc<Wake>) -> Self {
        // A pattern of any path.
        let all = Pattern::parse("**").unwrap_or_else(|_| unreachable!("it is a pattern"));
        Self {
            session: Session::new(own, Some(agent), limits),
            exchange: PeerExchange::new(board, agent, wake),
            questions: BTreeMap::new(),
            answers: Answers::default(),
            messages: Messages::default(),
            observer: board.observe(&all, 256, Some(Arc::clone(wake))),
            missed: 0,
            happenings: VecDeque::new(),
            retry_at: 0,
        }
    }

    /// The other agent may do this and nothing else; all when it is nothing.
    #[must_use]
    pub fn allow(mut self, allowance: Option<Allowance>) -> Self {
        self.exchange.allowance = allowance;
        self
    }

    /// The other agent's name.
    pub fn agent(&self) -> &str {
        &self.exchange.agent
    }

    /// The session with it.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Subscribes to a property, whose mirror is at `agents/<agent>/<path>`.
    ///
    /// # Errors
    /// When the mirror's path is taken, there are too many subscriptions, or JPEG is wanted and not built in.
    pub fn subscribe(&mut self, want: Want) -> Result<u32, String> {
        Url::parse(&format!("/{}", want.path)).map_err(|error| error.to_string())?;
        if !cfg!(feature = "jpeg") && matches!(want.options.compression, Compression::Jpeg(_)) {
            return Err("this program was built without JPEG: build it with the feature `jpeg`".into());
        }
        let mut import = Import::new(&self.exchange.agent, want);
        if self.exchange.board.get(&import.place).is_some_and(|(_, field)| field.is_empty()) {
            return Err(format!("/{} exists already", import.place));
        }
        import.prepare(&self.exchange.board)?;
        let (path, options) = (import.want.path.clone(), import.want.options);
        match self.session.subscribe(&path, options) {
            Ok(id) => {
                self.exchange.imports.insert(id, import);
                Ok(id)
            }
            Err(error) => {
                let _ = self.exchange.board.remove(&import.place);
                Err(error.to_string())
            }
        }
    }

    /// Ends a subscription, and takes its mirror off the board.
    pub fn unsubscribe(&mut self, id: u32) {
        self.session.unsubscribe(id);
        if let Some(import) = self.exchange.imports.remove(&id)
            && import.mirror.is_some()
        {
            // Somebody else may have taken it off.
            let _ = self.exchange.board.remove(&import.place);
        }
    }

    /// How a subscription stands.
    pub fn status(&self, id: u32) -> Option<&Status> {
        self.exchange.imports.get(&id).map(|import| &import.status)
    }

    /// Sends a message to a mailbox of the other agent; how it fares is a [`Happening`].
    ///
    /// # Errors
    /// When the other agent is not there, or too much waits for it: the message is not sent then.
    pub fn send(&mut self, path: &str, schema: u64, items: usize, bytes: &[u8]) -> Result<u64, SendError> {
        self.session.send(path, schema, items as u64, bytes)
    }

    /// Tells the other agent something of the team's knowledge; false when it is lost already.
    pub fn tell(&mut self, message: &[u8]) -> bool {
        is_of_team(self.exchange.allowance.as_ref()) && self.session.tell(message)
    }

    /// Asks which properties there are of those paths, and for their newest values if those are wanted; the answer is
    /// a [`Happening`].
    ///
    /// # Errors
    /// When the other agent is not there, or has not answered the last questions.
    pub fn ask(&mut self, pattern: &str, values: bool) -> Result<u32, SendError> {
        self.session.ask(pattern, values)
    }

    /// Waits no longer for the answer to a question.
    pub fn give_up(&mut self, request: u32) {
        self.session.give_up(request);
        self.answers.forget(request);
    }

    /// What has happened since this was asked last. When nobody asks for long, the oldest is forgotten; but for answers,
    /// of which there are no more than messages and questions of this agent.
    pub fn happenings(&mut self) -> impl Iterator<Item = Happening> + '_ {
        self.happenings.drain(..)
    }

    fn happen(&mut self, happening: Happening) {
        if self.happenings.len() >= HAPPENINGS {
            let is_answer = |happening: &Happening| {
                matches!(happening, Happening::Answered { .. } | Happening::Listed { .. })
            };
            if let Some(oldest) = self.happenings.iter().position(|happening| !is_answer(happening)) {
                self.happenings.remove(oldest);
            }
        }
        self.happenings.push_back(happening);
    }

    /// Whether a mirror was written since this was asked last.
    pub fn take_shown(&mut self) -> bool {
        std::mem::take(&mut self.exchange.shown)
    }

    /// The values' clock shows so much more than the one that `now` is of, nanoseconds.
    pub fn set_lead(&mut self, lead: i64) {
        self.exchange.lead = lead;
    }

    /// Takes the mirrors off the board.
    pub(super) fn take_down(&mut self) {
        self.exchange.take_down();
    }

    /// Takes a packet that came at `now`.
    pub fn receive(&mut self, now: u64, packet: &[u8], memory: Option<&dyn SharedMemory>) {
        self.exchange.estimate = self.session.estimate();
        self.session.receive(now, packet, &mut LiveExchange { exchange: &mut self.exchange, memory });
        self.react(now);
    }

    /// Ends the connection, because the host knows that it is cut.
    pub fn disconnect(&mut self, now: u64, reason: &str) {
        self.session.disconnect(
            now,
            reason,
            &mut LiveExchange { exchange: &mut self.exchange, memory: None },
        );
        self.react(now);
    }

    /// Sees what time it is, and what happened on the board.
    pub fn tick(&mut self, now: u64) {
        self.session.tick(now, &mut LiveExchange { exchange: &mut self.exchange, memory: None });
        self.react(now);
        self.observe(now);
        self.messages.settle(&mut self.session);
        self.answer_questions();
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

    /// When something is to be done, unless a packet comes or the wake is notified before.
    pub fn deadline(&mut self, now: u64) -> u64 {
        let mut next =
            self.session.deadline(now, &mut LiveExchange { exchange: &mut self.exchange, memory: None });
        if self.messages.is_open() {
            next = next.min(now + SETTLE);
        }
        if !self.questions.is_empty() {
            next = next.min(now + SETTLE);
        }
        if self.exchange.exports.values().any(|export| export.source.is_none()) {
            next = next.min(self.retry_at);
        }
        next
    }

    /// Whether this agent reads nothing there, and the other one nothing here.
    pub fn is_idle(&self) -> bool {
        self.exchange.imports.is_empty() && self.session.other().is_none()
    }

    /// Whether either agent reads something of the other one, or waits for an answer.
    pub fn is_used(&self) -> bool {
        let reads = !self.exchange.imports.is_empty() || !self.exchange.exports.is_empty();
        reads || self.messages.is_open() || self.session.has_open()
    }

    /// Whether properties are served whose writers notify nobody by themselves.
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
            Event::Connected { instance, .. } => self.happen(Happening::Connected { instance }),
            Event::Disconnected { reason } => self.react_to_end(reason),
            Event::Refused { reason } => self.happen(Happening::Refused { reason }),
            Event::Accepted { id, offer } => {
                let PeerExchange { imports, board, .. } = &mut self.exchange;
                let Some(import) = imports.get_mut(&id) else { return };
                if let Err(reason) = import.accept(board, &offer, self.session.limits().value) {
                    import.status = Status::Refused(reason.clone());
                    let path = import.want.path.clone();
                    self.session.refrain(id);
                    self.happen(Happening::Unserved { path, reason });
                }
            }
            Event::Waiting { id, reason } => self.react_to_delay(id, reason, Status::Waiting),
            Event::Declined { id, reason } => self.react_to_delay(id, reason, Status::Refused),
            Event::WriterLeft { id, generation } => {
                if let Some(import) = self.exchange.imports.get_mut(&id) {
                    import.leave_writer(generation);
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
            Event::Answered { ticket, answer } => self.happen(Happening::Answered { ticket, answer }),
            Event::Asked { request, pattern, values } => match PropertyQuestion::new(&pattern, values) {
                Some(question) => {
                    self.questions.insert(request, question);
                }
                None => self.session.leave_unanswered(request, "that is no pattern of paths"),
            },
            Event::Part { request, bytes, last } => {
                if let Some(answer) = self.answers.take(request, &bytes, last) {
                    // What may still come of one that is no answer is not waited for.
                    self.session.give_up(request);
                    self.happen(Happening::Listed { request, answer });
                }
            }
            Event::Told { bytes } => {
                if is_of_team(self.exchange.allowance.as_ref()) {
                    self.happen(Happening::Told { bytes });
                }
            }
            Event::Failed { request, reason } => {
                self.answers.forget(request);
                self.happen(Happening::Listed { request, answer: Err(reason) });
            }
        }
    }

    fn react_to_end(&mut self, reason: String) {
        self.questions.clear();
        self.messages.end();
        for import in self.exchange.imports.values_mut() {
            import.leave();
            import.status = Status::Unanswered;
        }
        self.happen(Happening::Disconnected { reason });
    }

    /// A subscription of this agent brings no values, or none yet.
    fn react_to_delay(&mut self, id: u32, reason: String, status: impl FnOnce(String) -> Status) {
        let Some(import) = self.exchange.imports.get_mut(&id) else { return };
        import.leave();
        import.status = status(reason.clone());
        let path = import.want.path.clone();
        self.happen(Happening::Unserved { path, reason });
    }

    fn react_to_subscription(
        &mut self,
        id: u32,
        path: String,
        options: Options,
        seen: Option<Seen>,
        now: u64,
    ) {
        // What is served shows on the board under the same path.
        if path.len() > LONGEST_PATH || Url::parse(&format!("/{path}")).is_err() {
            return self.session.decline(id, "that is no path of a property");
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
        let time = now.saturating_add_signed(self.exchange.lead);
        self.messages.deliver(&self.exchange.board, message, time, &mut self.session);
        self.exchange.shown = true;
    }

    /// Looks for the property of a subscription of the other agent.
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
                self.retry_at = now + RETRY;
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
        let mut look = now >= self.retry_at;
        while let Some(event) = self.observer.next() {
            match event {
                BoardEvent::Appeared(_) => look = true,
                BoardEvent::Vanished(path) => self.unserve(|of| of == &*path),
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
            // What happened is not known, so whatever is not there any more has vanished.
            let board = Arc::clone(&self.exchange.board);
            self.unserve(|path| board.get(path).is_none());
            look = true;
        }
        if look {
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

    /// Those properties are gone.
    fn unserve(&mut self, gone: impl Fn(&str) -> bool) {
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

    fn answer_questions(&mut self) {
        let largest = self.session.limits().value / 2;
        while self.session.room() > RESERVE
            && let Some((&request, question)) = self.questions.iter_mut().next()
        {
            let (part, last) = question.next(&self.exchange.board, largest, self.exchange.allowance.as_ref());
            self.session.part(request, &part, last);
            if last {
                self.questions.remove(&request);
            }
        }
    }

    /// Values of queues that wait to be sent to the other agent.
    pub(super) fn lag(&self, id: u32) -> u64 {
        let export = self.exchange.exports.get(&id).filter(|export| export.options.content == Content::All);
        export.and_then(|export| export.source.as_ref()).map_or(0, |source| source.lag())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.take_down();
    }
}
