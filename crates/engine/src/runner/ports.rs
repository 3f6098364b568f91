use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use slate_blackboard::Property;
use slate_blackboard::channel::{Latest, QueueReader, SetAside, Writer};
use slate_blackboard::interface::CanonicalForm;
use slate_blackboard::message::{ABANDONED, Receiver, Sender, Status, Ticket};
use slate_blackboard::wake::Wake;
use slate_module::{Delivery, Entry, Flags, PortSlot};

use super::Health;
use crate::actuators::Actuator;
use crate::aligned_memory::AlignedMemory;
use slate_composition::link::Filter;

/// Input port of the size of a cache line.
/// Its reader has the same index in [`Inputs`](super::Inputs)' readers.
#[repr(align(64))]
pub struct InputPort {
    /// Slot in the frame.
    pub slot: u32,
    /// Age from which a value counts as stale, ns.
    pub stale_after: Option<u64>,
    /// True if new values trigger a step.
    pub triggers: bool,
    /// True if a write triggers a step at once.
    /// A value pinned at the beginning of a cycle is new then, and not before.
    pub wakes: bool,
    /// True if it is pinned at the beginning of a cycle.
    pub is_previous: bool,
    /// True if a link writes it, and not a person alone.
    pub is_written: bool,
    /// Module that writes it, if one does.
    pub writer: Option<Arc<Health>>,
    /// Sequence and generation of the value that the last tick saw.
    pub seen: (u64, u64),
    /// Values that it never saw.
    pub missed: u64,
    /// Age of the value in the last measured step, for other threads.
    pub age: Arc<InputAge>,
}

impl InputPort {
    /// Shows the value of its reader to the step at `now`, ns.
    /// Without a value, it shows `zeros`.
    #[inline(always)] // Part of every step.
    pub fn show(&mut self, reader: &Latest, slot: &mut PortSlot, zeros: &AlignedMemory, now: u64) {
        let is_working = self.writer.as_ref().is_none_or(|health| health.is_working());
        let mut flags = if is_working && self.is_written { Flags::ALIVE } else { 0 };
        match reader.value() {
            Some(loan) => {
                let stamp = loan.stamp();
                slot.data = loan.as_ptr().cast_mut();
                slot.items.set(loan.items());
                slot.stamp = stamp;
                let (seen, generation) = self.seen;
                if self.seen != (stamp.sequence, stamp.generation) {
                    flags |= Flags::NEW;
                    if generation == stamp.generation {
                        self.missed += stamp.sequence.saturating_sub(seen + 1);
                    }
                    self.seen = (stamp.sequence, stamp.generation);
                }
                let is_old = self.stale_after.is_some_and(|after| now.saturating_sub(stamp.time) > after);
                if is_old || !is_working {
                    flags |= Flags::STALE;
                }
            }
            None => {
                slot.data = zeros.as_ptr().cast_mut();
                slot.items.set(0);
                flags |= Flags::STALE;
            }
        }
        slot.missed = self.missed;
        slot.flags.set(flags);
    }
}

/// Age of a value when its reader receives it, ns of the agent's time.
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

    /// Returns the age, ns; `None` before the first value in a step.
    pub fn get(&self) -> Option<u64> {
        Some(self.0.load(Ordering::Relaxed)).filter(|age| *age != Self::UNKNOWN)
    }
}

/// Backlog of a queue input; other threads may read it at any time.
#[derive(Debug, Default)]
pub struct QueueGauge {
    /// Values that waited when the last step had taken its own.
    pub lag: AtomicU64,
    /// Values that it never saw.
    pub lost: AtomicU64,
    /// True if the reader was evicted.
    pub evicted: AtomicBool,
}

/// Queue input.
pub struct QueuePort {
    /// Slot in the frame.
    pub slot: usize,
    /// True if new values trigger a step.
    pub triggers: bool,
    /// Reader with its cursor.
    pub reader: QueueReader,
    /// Entries to which the frame points.
    pub entries: Vec<Entry>,
    /// Filter of the values; `None` if all pass.
    pub filter: Option<Arc<Filter>>,
    /// True if its values are taken at the cycle's beginning, not before the step.
    pub is_previous: bool,
    /// Backlog.
    pub gauge: Arc<QueueGauge>,
    /// Log message of the eviction, prepared as a step allocates nothing.
    pub eviction_message: Box<str>,
    /// True once the eviction was logged.
    pub is_evicted: bool,
}

/// Inbox.
pub struct InboxPort {
    /// Slot in the frame.
    pub slot: usize,
    /// True if messages trigger a step.
    pub triggers: bool,
    /// Receiver with the waiting messages.
    pub receiver: Receiver,
    /// Entries to which the frame points.
    pub entries: Vec<Entry>,
}

/// Output port.
/// In this order, as for [`Runner`](super::Runner): the first three cache lines have all that a step needs.
#[repr(C, align(64))]
pub struct OutputPort {
    /// Slot in the frame.
    pub slot: usize,
    /// Index of the property in the order of all, for the digest.
    pub index: u32,
    /// True for a debug output: computed only if read, and outside the digest.
    pub debug: bool,
    /// Gate that a command passes, and the number of the commander.
    pub actuator: Option<(Arc<Actuator>, u32)>,
    /// Threads that wait for it.
    pub wakes: Vec<Arc<Wake>>,
    /// Writes the property.
    pub writer: Writer,
    /// Bytes in which equal values may differ.
    pub form: CanonicalForm,
    /// Property.
    pub property: Arc<Property>,
    /// Safe value while the module does not work; `None` for zeros.
    pub safe: Option<Box<[u8]>>,
    /// Draft to which a late step may still write.
    pub late_draft: Option<SetAside>,
}

/// Outbox.
pub struct OutboxPort {
    /// Slot in the frame.
    pub slot: usize,
    /// Sender of the messages; `None` for an outbox without a link.
    pub sender: Option<Sender>,
    /// Room for the messages of a step.
    pub memory: Vec<AlignedMemory>,
    /// Entries to which the frame points.
    pub entries: Vec<Entry>,
    /// Size of a message, bytes.
    pub size: usize,
    /// Bytes in which equal messages may differ.
    pub form: CanonicalForm,
    /// Index in the order of all outputs, for the digest.
    pub index: u32,
    /// Wakes the receiver.
    pub wake: Option<Arc<Wake>>,
    /// Number of refused messages.
    pub refused: u64,
    /// Number of messages.
    pub sent: u64,
    /// Tickets of messages without an answer, at the index of their number.
    pub tickets: Vec<Option<Ticket>>,
}

impl OutboxPort {
    /// Counts a message; without a ticket it is lost, as no answer comes.
    pub fn record_message(&mut self, ticket: Option<Ticket>) {
        let index = (self.sent % self.entries.len().max(1) as u64) as usize;
        self.sent += 1;
        let delivery = if ticket.is_some() { Delivery::Waiting } else { Delivery::Lost };
        if let (Some(entry), Some(pending)) = (self.entries.get_mut(index), self.tickets.get_mut(index)) {
            entry.stamp.sequence = self.sent;
            entry.answer.set(delivery.code());
            *pending = ticket;
        }
    }

    /// Updates the delivery states of messages without an answer.
    pub fn update_deliveries(&mut self) {
        let Some(sender) = &self.sender else { return };
        for (entry, pending) in self.entries.iter().zip(&mut self.tickets) {
            let delivery = pending.map_or(Delivery::Waiting, |ticket| delivery(sender, ticket));
            if delivery != Delivery::Waiting {
                entry.answer.set(delivery.code());
                *pending = None;
            }
        }
    }

    /// Returns the delivery states of the remembered messages, by their numbers.
    pub fn deliveries(&self) -> Vec<(u64, u32)> {
        let delivery_state = |(entry, pending): (&Entry, &Option<Ticket>)| {
            let code =
                self.sender.as_ref().zip(*pending).map(|(sender, ticket)| delivery(sender, ticket).code());
            (entry.stamp.sequence, code.unwrap_or(entry.answer.get()))
        };
        let all = self.entries.iter().zip(&self.tickets).map(delivery_state);
        all.filter(|(number, _)| *number > 0).collect()
    }

    /// Resumes after `sent` messages, with the remembered deliveries.
    pub fn resume(&mut self, sent: u64, deliveries: &[(u64, u32)]) {
        self.sent = sent;
        // Earlier messages belong to another instance.
        self.tickets.fill(None);
        self.entries.iter_mut().for_each(|entry| entry.stamp.sequence = 0);
        let count = self.entries.len().max(1) as u64;
        for (number, code) in deliveries.iter().filter(|(number, _)| *number > 0) {
            if let Some(entry) = self.entries.get_mut(((number - 1) % count) as usize) {
                entry.stamp.sequence = *number;
                entry.answer.set(*code);
            }
        }
    }

    /// Sends a waiting message again, before `later` others that are sent again.
    /// The oldest is sent first: unanswered messages that are no longer remembered come before all others.
    pub fn resend(&mut self, bytes: &[u8], items: usize, time: u64, later: usize) {
        // As many fit as fitted then.
        let ticket = self.sender.as_mut().and_then(|sender| sender.send(bytes, items, time).ok());
        let waiting = self
            .entries
            .iter()
            .zip(&mut self.tickets)
            .filter(|(entry, pending)| awaits_answer(entry, **pending));
        let mut waiting: Vec<_> = waiting.collect();
        waiting.sort_unstable_by_key(|(entry, _)| entry.stamp.sequence);
        let Some(index) = waiting.len().checked_sub(later + 1) else { return };
        *waiting[index].1 = ticket;
    }

    /// Marks waiting messages that were not sent again as lost.
    /// Their mailbox is another agent's, so that no answer comes.
    pub fn mark_waiting_lost(&mut self) {
        for (entry, pending) in self.entries.iter().zip(&self.tickets) {
            if awaits_answer(entry, *pending) {
                entry.answer.set(Delivery::Lost.code());
            }
        }
    }

    /// Sets the sender, and returns the former one.
    /// Messages to the former receiver without an answer are lost.
    pub fn replace_sender(&mut self, sender: Option<Sender>) -> Option<Sender> {
        self.update_deliveries();
        for (entry, pending) in self.entries.iter().zip(&mut self.tickets) {
            if pending.take().is_some() {
                entry.answer.set(Delivery::Lost.code());
            }
        }
        std::mem::replace(&mut self.sender, sender)
    }
}

/// Returns true if a message waits for an answer and has no ticket.
fn awaits_answer(entry: &Entry, pending: Option<Ticket>) -> bool {
    pending.is_none() && entry.stamp.sequence > 0 && entry.answer.get() == Delivery::Waiting.code()
}

fn delivery(sender: &Sender, ticket: Ticket) -> Delivery {
    match sender.status(ticket) {
        Status::Accepted => Delivery::Waiting,
        Status::Done => Delivery::Done,
        Status::Refused(ABANDONED) | Status::Unknown => Delivery::Lost,
        Status::Refused(reason) => Delivery::Refused(reason),
    }
}
