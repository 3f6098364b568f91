//! Messages that another agent sends to mailboxes of this one.

use std::sync::Arc;

use slate_blackboard::message::{ABANDONED, Mailbox, Sender, Status, Ticket};
use slate_blackboard::{Board, Carrier, Property};
use slate_sorted::SortedMap;

use crate::session::{DeliveryStatus, Session};

/// Mailboxes that another agent has written to, and messages without an answer.
#[derive(Debug, Default)]
pub(super) struct Messages {
    /// Sender per mailbox, which keeps its messages in order.
    senders: SortedMap<String, (Arc<Property>, Sender)>,
    pending: Vec<(u64, String, Ticket)>,
}

/// Received message.
#[derive(Debug)]
pub(super) struct Incoming {
    pub ticket: u64,
    pub path: String,
    pub schema: u64,
    pub items: u64,
    pub bytes: Vec<u8>,
}

/// Largest number of mailboxes that one agent may write to.
const MAX_MAILBOXES: usize = 256;

impl Messages {
    /// Returns whether messages wait for their answers.
    pub fn is_open(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Delivers a message to its mailbox, and answers with its status.
    pub fn deliver(&mut self, board: &Board, message: &Incoming, now: u64, session: &mut Session) {
        let answer = match self.send(board, message, now) {
            Ok(ticket) => {
                self.pending.push((message.ticket, message.path.clone(), ticket));
                DeliveryStatus::Accepted
            }
            Err(answer) => answer,
        };
        session.answer(message.ticket, answer);
    }

    fn send(&mut self, board: &Board, message: &Incoming, now: u64) -> Result<Ticket, DeliveryStatus> {
        let found = board.get(&message.path).filter(|(_, field)| field.is_empty()).map(|(found, _)| found);
        let property = found.ok_or(DeliveryStatus::NoMailbox)?;
        let Carrier::Mailbox(mailbox) = property.carrier() else { return Err(DeliveryStatus::NoMailbox) };
        let shape = mailbox.shape();
        let items = usize::try_from(message.items).unwrap_or(usize::MAX);
        let fits = items <= shape.capacity && message.bytes.len() <= shape.bytes(items);
        if property.descriptor().hash != message.schema || !fits {
            return Err(DeliveryStatus::NoMailbox);
        }
        let known = self.senders.get(&message.path).is_some_and(|(known, _)| Arc::ptr_eq(known, &property));
        if is_reserved(&property.part(), mailbox, known) {
            return Err(DeliveryStatus::Denied);
        }
        if !known {
            if self.senders.len() >= MAX_MAILBOXES {
                return Err(DeliveryStatus::Full);
            }
            let sender = mailbox.sender().map_err(|_| DeliveryStatus::Full)?;
            self.senders.insert(message.path.clone(), (Arc::clone(&property), sender));
        }
        let (_, sender) = self.senders.get_mut(&message.path).ok_or(DeliveryStatus::NoMailbox)?;
        sender.send(&message.bytes, items, now).map_err(|_| DeliveryStatus::Full)
    }

    /// Forwards the receivers' answers to the other agent.
    pub fn forward_answers(&mut self, session: &mut Session) {
        let senders = &self.senders;
        self.pending.retain(|(number, path, ticket)| {
            let status = senders.get(path).map_or(Status::Unknown, |(_, sender)| sender.status(*ticket));
            let answer = match status {
                Status::Accepted => return true,
                Status::Done => DeliveryStatus::Done,
                Status::Refused(ABANDONED) | Status::Unknown => DeliveryStatus::Vanished,
                Status::Refused(code) => DeliveryStatus::Refused(code),
            };
            session.answer(*number, answer);
            false
        });
    }

    /// Drops open messages after the other agent has left.
    pub fn end(&mut self) {
        self.pending.clear();
        self.senders.clear();
    }
}

/// Returns whether an inbox refuses another agent.
/// It does if the robot's own Plan or reflexes already send to it. `known` is true if the other agent has a sender
/// there.
fn is_reserved(part: &str, mailbox: &Mailbox, known: bool) -> bool {
    // Modules of this agent have names.
    let is_own = |names: &[String]| names.iter().any(|name| !name.is_empty());
    match part {
        "plan" => {
            let names = mailbox.sender_names();
            is_own(&names) || !known && !names.is_empty()
        }
        "reactive" => is_own(&mailbox.sender_names()),
        _ => false,
    }
}
