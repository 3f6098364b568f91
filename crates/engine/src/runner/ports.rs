use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use slate_blackboard::Property;
use slate_blackboard::channel::{QueueReader, SetAside, Writer};
use slate_blackboard::interface::CanonicalForm;
use slate_blackboard::message::{ABANDONED, Receiver, Sender, Status, Ticket};
use slate_blackboard::wake::Wake;
use slate_module::{Delivery, Entry};

use super::Health;
use crate::actuators::Actuator;
use crate::aligned_memory::AlignedMemory;
use slate_composition::link::Filter;

/// An input; its reader stands at the same index in [`Inputs`](super::Inputs)' readers. It fills a cache line.
#[repr(align(64))]
pub struct InputPort {
    /// Its slot in the frame.
    pub slot: u32,
    /// The age from which a value counts as stale, nanoseconds.
    pub stale_after: Option<u64>,
    /// Whether news trigger a step.
    pub triggers: bool,
    /// Whether it triggers as soon as it is written: what is taken when a cycle begins is news then, and not before.
    pub wakes: bool,
    /// Whether it is pinned when a cycle begins.
    pub is_early: bool,
    /// Whether something writes it: links do, and not a person alone.
    pub is_written: bool,
    /// The module that writes it, if one does.
    pub writer: Option<Arc<Health>>,
    /// Sequence and generation of the value that the last tick saw.
    pub seen: (u64, u64),
    /// Values that it never saw.
    pub missed: u64,
    /// How old the value was in the step that was measured last, for others to look at.
    pub age: Arc<InputAge>,
}

/// How old a value is when its reader has it, ns of the agent's time.
#[derive(Debug)]
pub struct InputAge(AtomicU64);

impl Default for InputAge {
    fn default() -> Self {
        Self(AtomicU64::new(Self::UNKNOWN))
    }
}

impl InputAge {
    const UNKNOWN: u64 = u64::MAX;

    /// Sets the age.
    pub fn set(&self, age: Option<u64>) {
        self.0.store(age.unwrap_or(Self::UNKNOWN), Ordering::Relaxed);
    }

    /// The age; none before there was a value in a step.
    pub fn get(&self) -> Option<u64> {
        Some(self.0.load(Ordering::Relaxed)).filter(|age| *age != Self::UNKNOWN)
    }
}

/// How a queue input keeps up; others may look at any time.
#[derive(Debug, Default)]
pub struct QueueGauge {
    /// Values that waited when the last step had taken its own.
    pub lag: AtomicU64,
    /// Values that it never saw.
    pub lost: AtomicU64,
    /// Whether it reads no more.
    pub evicted: AtomicBool,
}

/// A queue input.
pub struct QueuePort {
    /// Its slot in the frame.
    pub slot: usize,
    /// Whether news trigger a step.
    pub triggers: bool,
    /// Its cursor.
    pub reader: QueueReader,
    /// What the frame points to.
    pub entries: Vec<Entry>,
    /// Which values it gets, if not all.
    pub filter: Option<Arc<Filter>>,
    /// Whether its values are taken when a cycle begins, and not before the step.
    pub is_early: bool,
    /// How it keeps up.
    pub gauge: Arc<QueueGauge>,
    /// What is logged when it reads no more, as nothing is made in a step.
    pub farewell: Box<str>,
    /// Whether that was said.
    pub is_evicted: bool,
}

/// An inbox.
pub struct InboxPort {
    /// Its slot in the frame.
    pub slot: usize,
    /// Whether messages trigger a step.
    pub triggers: bool,
    /// Where messages wait.
    pub receiver: Receiver,
    /// What the frame points to.
    pub entries: Vec<Entry>,
}

/// An output; in this order, as for [`Runner`](super::Runner): what a step needs is in the first three lines.
#[repr(C, align(64))]
pub struct OutputPort {
    /// Its slot in the frame.
    pub slot: usize,
    /// The place of the property in the order of all, for the digest.
    pub index: u32,
    /// Computed only while somebody watches, and outside the digest.
    pub debug: bool,
    /// The gate that a command passes, and as whom.
    pub actuator: Option<(Arc<Actuator>, u32)>,
    /// The threads that wait for it.
    pub wakes: Vec<Arc<Wake>>,
    /// Writes the property.
    pub writer: Writer,
    /// Where its bytes may differ though it is the same.
    pub form: CanonicalForm,
    /// The property.
    pub property: Arc<Property>,
    /// What it shows while the module does not work; nothing for zeros.
    pub safe: Option<Box<[u8]>>,
    /// The slot that a late step may still write to.
    pub aside: Option<SetAside>,
}

/// An outbox.
pub struct OutboxPort {
    /// Its slot in the frame.
    pub slot: usize,
    /// Where messages go; nothing for an outbox without a link.
    pub sender: Option<Sender>,
    /// Room for the messages of a step.
    pub memory: Vec<AlignedMemory>,
    /// What the frame points to.
    pub entries: Vec<Entry>,
    /// Bytes of a message.
    pub size: usize,
    /// Where bytes of messages may differ though they are the same.
    pub form: CanonicalForm,
    /// Its place in the order of all outputs, for the digest.
    pub index: u32,
    /// Wakes the receiver.
    pub wake: Option<Arc<Wake>>,
    /// Messages that were refused.
    pub refused: u64,
    /// Counts the messages.
    pub sent: u64,
    /// Those without an answer, each at the place of its number.
    pub open: Vec<Option<Ticket>>,
}

impl OutboxPort {
    /// Counts a message that nobody answers unless there is a ticket.
    pub fn note(&mut self, ticket: Option<Ticket>) {
        let place = (self.sent % self.entries.len().max(1) as u64) as usize;
        self.sent += 1;
        let delivery = if ticket.is_some() { Delivery::Waiting } else { Delivery::Lost };
        if let (Some(entry), Some(open)) = (self.entries.get_mut(place), self.open.get_mut(place)) {
            entry.stamp.sequence = self.sent;
            entry.answer.set(delivery.code());
            *open = ticket;
        }
    }

    /// Looks how the messages fare that have no answer.
    pub fn settle(&mut self) {
        let Some(sender) = &self.sender else { return };
        for (entry, open) in self.entries.iter().zip(&mut self.open) {
            let delivery = open.map_or(Delivery::Waiting, |ticket| delivery(sender, ticket));
            if delivery != Delivery::Waiting {
                entry.answer.set(delivery.code());
                *open = None;
            }
        }
    }

    /// How the messages fare that are remembered, by their numbers.
    pub fn deliveries(&self) -> Vec<(u64, u32)> {
        let fares = |(entry, open): (&Entry, &Option<Ticket>)| {
            let now = self.sender.as_ref().zip(*open).map(|(sender, ticket)| delivery(sender, ticket).code());
            (entry.stamp.sequence, now.unwrap_or(entry.answer.get()))
        };
        let all = self.entries.iter().zip(&self.open).map(fares);
        all.filter(|(number, _)| *number > 0).collect()
    }

    /// Goes on after so many messages, of which these are remembered.
    pub fn resume(&mut self, sent: u64, deliveries: &[(u64, u32)]) {
        self.sent = sent;
        // What was sent until now is another life's.
        self.open.fill(None);
        self.entries.iter_mut().for_each(|entry| entry.stamp.sequence = 0);
        let count = self.entries.len().max(1) as u64;
        for (number, code) in deliveries.iter().filter(|(number, _)| *number > 0) {
            if let Some(entry) = self.entries.get_mut(((number - 1) % count) as usize) {
                entry.stamp.sequence = *number;
                entry.answer.set(*code);
            }
        }
    }

    /// Sends a message again that waited, before so many `later` ones. The oldest first: those without an answer that are not
    /// remembered any more come before all that are.
    pub fn send_again(&mut self, bytes: &[u8], items: usize, time: u64, later: usize) {
        // As many fit as fitted then.
        let ticket = self.sender.as_mut().and_then(|sender| sender.send(bytes, items, time).ok());
        let waiting = self.entries.iter().zip(&mut self.open).filter(|(entry, open)| waits(entry, **open));
        let mut waiting: Vec<_> = waiting.collect();
        waiting.sort_unstable_by_key(|(entry, _)| entry.stamp.sequence);
        let Some(place) = waiting.len().checked_sub(later + 1) else { return };
        *waiting[place].1 = ticket;
    }

    /// What waits and was not sent again, as its mailbox is another agent's, is lost: nobody will answer.
    pub fn give_up(&mut self) {
        for (entry, open) in self.entries.iter().zip(&self.open) {
            if waits(entry, *open) {
                entry.answer.set(Delivery::Lost.code());
            }
        }
    }

    /// Sends to another receiver from now on: what the former one has not answered is lost.
    pub fn turn_to(&mut self, sender: Option<Sender>) -> Option<Sender> {
        self.settle();
        for (entry, open) in self.entries.iter().zip(&mut self.open) {
            if open.take().is_some() {
                entry.answer.set(Delivery::Lost.code());
            }
        }
        std::mem::replace(&mut self.sender, sender)
    }
}

/// Whether a message waits for an answer that nobody has promised.
fn waits(entry: &Entry, open: Option<Ticket>) -> bool {
    open.is_none() && entry.stamp.sequence > 0 && entry.answer.get() == Delivery::Waiting.code()
}

fn delivery(sender: &Sender, ticket: Ticket) -> Delivery {
    match sender.status(ticket) {
        Status::Accepted => Delivery::Waiting,
        Status::Done => Delivery::Done,
        Status::Refused(ABANDONED) | Status::Unknown => Delivery::Lost,
        Status::Refused(reason) => Delivery::Refused(reason),
    }
}
