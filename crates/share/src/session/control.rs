//! Control stream: messages between the two agents other than values.

use super::delivery::DeliveryStatus;
use super::event::{Application, Event, Offer};
use super::inbound::Inbound;
use super::subscription::{ReadStream, Serving};
use super::wire::{ControlMessage, PortableOffer, RawBytes, append};
use super::{MAX_OPEN_QUERIES, Options, Session};

/// Largest number of unanswered messages of this agent.
const MAX_UNANSWERED_MESSAGES: usize = 1024;

/// Reason why a request can't be sent to the other agent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// Absent agent.
    #[error("the other agent is not connected")]
    NotConnected,
    /// Full queue of outgoing messages.
    #[error("too much waits to be sent to the other agent")]
    Full,
    /// Too many unanswered questions, including those that were given up.
    #[error("the other agent has not answered the last {MAX_OPEN_QUERIES} questions")]
    Unanswered,
    /// Message larger than a session takes.
    #[error("{bytes} bytes are more than the {limit} that are sent at once")]
    TooLarge {
        /// Size of the message, bytes.
        bytes: usize,
        /// Largest size, bytes.
        limit: usize,
    },
}

impl Session {
    /// Subscribes to a property of the other agent, now and after every connection.
    /// It begins as soon as the clock offset is known.
    ///
    /// # Errors
    /// When there are as many subscriptions as there may be.
    pub fn subscribe(&mut self, path: &str, options: Options) -> Result<u32, SendError> {
        if self.readings.len() >= self.limits.subscriptions {
            return Err(SendError::Full);
        }
        let id = self.next_id;
        self.next_id += 1;
        self.readings.insert(id, ReadStream::new(path, options, &self.limits));
        if self.connection.established && self.clock.estimate().is_some() {
            self.send_subscription(id);
        }
        Ok(id)
    }

    /// Ends a subscription of this agent.
    pub fn unsubscribe(&mut self, id: u32) {
        if self.readings.remove(&id).is_some() && self.connection.established {
            self.control(&ControlMessage::Unsubscribe { id });
        }
    }

    /// Refuses the offer for a subscription: it is not the expected one.
    /// The subscription is requested again after every connection.
    pub fn refuse_offer(&mut self, id: u32) {
        if let Some(reading) = self.readings.get_mut(&id) {
            reading.epoch = 0;
            self.control(&ControlMessage::Unsubscribe { id });
        }
    }

    pub(super) fn send_subscription(&mut self, id: u32) {
        let Some(reading) = self.readings.get(&id) else { return };
        let (path, options, seen) = (reading.path.clone(), reading.options, reading.seen);
        self.control(&ControlMessage::Subscribe { id, path: &path, options, seen });
    }

    /// Serves a subscription of the other agent.
    /// Values follow once it knows the offer.
    pub fn accept(&mut self, id: u32, offer: &Offer) {
        let Some(serving) = self.servings.get_mut(&id) else { return };
        serving.epoch += 1;
        serving.begun = false;
        serving.stream.sequence = offer.after;
        let epoch = serving.epoch;
        let offer = PortableOffer {
            path: &offer.path,
            interface: RawBytes(&offer.interface),
            doc: &offer.doc,
            part: &offer.part,
            capacity: offer.capacity,
            depth: offer.depth,
            after: offer.after,
        };
        self.control(&ControlMessage::Accepted { id, epoch, offer });
    }

    /// Makes a subscription of the other agent wait until it is accepted.
    pub fn wait(&mut self, id: u32, reason: &str) {
        let Some(serving) = self.servings.get_mut(&id) else { return };
        serving.begun = false;
        self.control(&ControlMessage::Waiting { id, reason });
    }

    /// Refuses a subscription of the other agent.
    pub fn decline(&mut self, id: u32, reason: &str) {
        if self.servings.remove(&id).is_some() {
            self.control(&ControlMessage::Refused { id, reason });
        }
    }

    /// Announces that a property of the other agent's subscription has no writer.
    pub fn writer_left(&mut self, id: u32, generation: u64) {
        if self.servings.contains_key(&id) {
            self.control(&ControlMessage::WriterLeft { id, generation });
        }
    }

    /// Announces that values up to that number will not be sent.
    /// The queue no longer keeps them.
    pub fn pass(&mut self, now: u64, id: u32, sequence: u64) {
        if let Some(serving) = self.servings.get_mut(&id) {
            serving.stream.pass(sequence, now);
        }
    }

    /// Sends a message to a mailbox of the other agent.
    /// It is delivered at most once, and answered.
    ///
    /// # Errors
    /// When the other agent is not there, or too much waits for it: the message is not sent then.
    pub fn send(&mut self, path: &str, schema: u64, items: u64, bytes: &[u8]) -> Result<u64, SendError> {
        if bytes.len() > self.limits.value {
            return Err(SendError::TooLarge { bytes: bytes.len(), limit: self.limits.value });
        }
        self.check_room(bytes.len())?;
        if self.tickets.len() >= MAX_UNANSWERED_MESSAGES {
            return Err(SendError::Full);
        }
        let ticket = self.next_ticket;
        self.next_ticket += 1;
        self.tickets.insert(ticket, false);
        self.control(&ControlMessage::Send { ticket, path, schema, items, bytes: RawBytes(bytes) });
        Ok(ticket)
    }

    /// Answers a message of the other agent.
    pub fn answer(&mut self, ticket: u64, answer: DeliveryStatus) {
        if self.connection.established {
            self.control(&ControlMessage::Answer { ticket, answer });
        }
    }

    /// Asks the other agent for the properties that match a pattern.
    ///
    /// # Errors
    /// When the other agent is not there, or has not answered the last questions.
    pub fn query(&mut self, pattern: &str, values: bool) -> Result<u32, SendError> {
        self.check_room(pattern.len())?;
        if self.requests.len() >= MAX_OPEN_QUERIES {
            return Err(SendError::Unanswered);
        }
        let request = self.next_request;
        self.next_request += 1;
        self.requests.insert(request, true);
        self.control(&ControlMessage::Ask { request, pattern, values });
        Ok(request)
    }

    /// Gives up waiting for the answer to a question; the answer is dropped.
    /// The question counts as open until the other agent has answered it, which has no place for another one before.
    pub fn cancel_query(&mut self, request: u32) {
        if let Some(is_wanted) = self.requests.get_mut(&request) {
            *is_wanted = false;
        }
    }

    /// Sends a part of the answer to a question of the other agent.
    pub fn send_part(&mut self, request: u32, bytes: &[u8], last: bool) {
        if self.open_queries.contains(&request) {
            self.control(&ControlMessage::Part { request, bytes: RawBytes(bytes), last });
            if last {
                self.open_queries.remove(&request);
            }
        }
    }

    /// Returns whether a message or a question of either agent has no answer yet.
    pub fn has_pending(&self) -> bool {
        !(self.requests.is_empty() && self.tickets.is_empty() && self.open_queries.is_empty())
    }

    /// Sends the reason why a question is not answered.
    pub fn decline_query(&mut self, request: u32, reason: &str) {
        if self.open_queries.remove(&request) {
            self.control(&ControlMessage::Unanswered { request, reason });
        }
    }

    /// Returns the number of bytes that control messages may still add.
    pub fn room(&self) -> usize {
        self.limits.control.saturating_sub(self.control_queue_bytes)
    }

    fn check_room(&self, bytes: usize) -> Result<(), SendError> {
        if !self.connection.established {
            return Err(SendError::NotConnected);
        }
        // One that is larger than the room is sent alone.
        if self.control_queue_bytes > 0 && bytes > self.room() {
            return Err(SendError::Full);
        }
        Ok(())
    }

    fn control(&mut self, message: &ControlMessage<'_>) {
        let mut bytes = Vec::new();
        append(message, &mut bytes);
        self.control_queue_bytes += bytes.len();
        self.control_queue.push_back(bytes);
    }

    /// Handles the messages that the control stream delivers.
    pub(super) fn with_control(
        &mut self,
        now: u64,
        application: &mut dyn Application,
        call: impl FnOnce(&mut Inbound, &mut dyn FnMut(&[u8])) -> bool,
    ) -> bool {
        let attempt = self.connection.attempt;
        let mut stream = std::mem::replace(&mut self.control_in, Inbound::idle());
        let mut valid = true;
        let fine = call(&mut stream, &mut |item| {
            // A message may end the connection, and what comes behind it belongs to that.
            if self.connection.attempt != attempt {
                return;
            }
            match postcard::from_bytes::<ControlMessage<'_>>(item) {
                Ok(message) => self.receive_control(now, message, application),
                Err(_) => valid = false,
            }
        });
        if self.connection.attempt == attempt {
            self.control_in = stream;
        }
        fine && valid
    }

    fn receive_control(&mut self, now: u64, message: ControlMessage<'_>, application: &mut dyn Application) {
        match message {
            ControlMessage::Subscribe { id, path, options, seen } => {
                self.receive_subscription(now, id, path, options, seen, application);
            }
            ControlMessage::Unsubscribe { id } => {
                if self.servings.remove(&id).is_some() {
                    application.event(Event::Unsubscribed { id });
                }
            }
            ControlMessage::Accepted { id, epoch, offer } => {
                self.receive_offer(id, epoch, &offer, application)
            }
            ControlMessage::Begin { id, epoch } => {
                if let Some(serving) = self.servings.get_mut(&id) {
                    serving.begun |= serving.epoch == epoch;
                }
            }
            ControlMessage::Waiting { id, reason } => {
                if self.readings.contains_key(&id) {
                    application.event(Event::Waiting { id, reason: reason.into() });
                }
            }
            ControlMessage::Refused { id, reason } => {
                if self.readings.contains_key(&id) {
                    application.event(Event::Declined { id, reason: reason.into() });
                }
            }
            ControlMessage::WriterLeft { id, generation } => {
                // A value of the next writer may have overtaken this.
                let old =
                    |reading: &ReadStream| reading.seen.is_none_or(|seen| seen.generation <= generation);
                if self.readings.get(&id).is_some_and(old) {
                    application.event(Event::WriterLeft { id, generation });
                }
            }
            ControlMessage::Send { ticket, path, schema, items, bytes } => {
                let (path, bytes) = (path.into(), bytes.0.into());
                application.event(Event::Message { ticket, path, schema, items, bytes });
            }
            ControlMessage::Answer { ticket, answer } => self.receive_answer(ticket, answer, application),
            ControlMessage::Ask { request, pattern, values } => {
                if self.open_queries.len() < MAX_OPEN_QUERIES && self.open_queries.insert(request) {
                    application.event(Event::Asked { request, pattern: pattern.into(), values });
                } else {
                    let reason = "too many questions are open";
                    self.control(&ControlMessage::Unanswered { request, reason });
                }
            }
            ControlMessage::Part { request, bytes, last } => {
                let is_wanted =
                    if last { self.requests.remove(&request) } else { self.requests.get(&request).copied() };
                if is_wanted == Some(true) {
                    application.event(Event::Part { request, bytes: bytes.0.into(), last });
                }
            }
            ControlMessage::Unanswered { request, reason } => {
                if self.requests.remove(&request) == Some(true) {
                    application.event(Event::Failed { request, reason: reason.into() });
                }
            }
        }
        if self.control_queue_bytes > self.limits.control.saturating_mul(2) {
            self.disconnect(now, "it asks for more than it reads", application);
        }
    }

    fn receive_offer(
        &mut self,
        id: u32,
        epoch: u32,
        offer: &PortableOffer<'_>,
        application: &mut dyn Application,
    ) {
        let instance = self.other().map_or(0, |other| other.instance);
        let Some(reading) = self.readings.get_mut(&id) else { return };
        reading.accept(instance, epoch, offer.after);
        let offer = Offer {
            path: offer.path.into(),
            interface: offer.interface.0.into(),
            doc: offer.doc.into(),
            part: offer.part.into(),
            capacity: offer.capacity,
            depth: offer.depth,
            after: offer.after,
        };
        application.event(Event::Accepted { id, offer });
        self.control(&ControlMessage::Begin { id, epoch });
    }

    fn receive_answer(&mut self, ticket: u64, answer: DeliveryStatus, application: &mut dyn Application) {
        let known = if answer.is_final() {
            self.tickets.remove(&ticket).is_some()
        } else {
            // Once, however often it is said.
            self.tickets.get_mut(&ticket).is_some_and(|accepted| !std::mem::replace(accepted, true))
        };
        if known {
            application.event(Event::Answered { ticket, answer });
        }
    }

    fn receive_subscription(
        &mut self,
        now: u64,
        id: u32,
        path: &str,
        options: Options,
        seen: Option<super::Seen>,
        application: &mut dyn Application,
    ) {
        if id == 0 || self.servings.contains_key(&id) {
            return;
        }
        if self.servings.len() >= self.limits.subscriptions {
            let reason = format!("more than {} subscriptions are not served", self.limits.subscriptions);
            self.control(&ControlMessage::Refused { id, reason: &reason });
            return;
        }
        self.servings.insert(id, Serving::new(options, &self.limits, now));
        application.event(Event::Subscribed { id, path: path.into(), options, seen });
    }
}
