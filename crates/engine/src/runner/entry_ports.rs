use std::sync::atomic::Ordering;

use slate_blackboard::Stamp;
use slate_blackboard::channel::Loan;
use slate_blackboard::message::Answer;
use slate_module::{Entry, Level};

use super::{InboxPort, OutboxPort, QueuePort, Slots};
use crate::digest::Digest;
use crate::log::ModuleLog;

/// Ports with several values in a step: queues, inboxes and outboxes.
#[derive(Default)]
pub struct EntryPorts {
    /// Queue inputs.
    pub queues: Vec<QueuePort>,
    /// Inboxes.
    pub inboxes: Vec<InboxPort>,
    /// Outboxes.
    pub outboxes: Vec<OutboxPort>,
}

impl EntryPorts {
    /// Returns true if it has no ports.
    pub fn is_empty(&self) -> bool {
        self.queues.is_empty() && self.inboxes.is_empty() && self.outboxes.is_empty()
    }

    /// Returns true if some values are taken at the beginning of a cycle.
    pub fn have_previous(&self) -> bool {
        self.queues.iter().any(|queue| queue.is_previous)
    }

    /// Returns true if a triggering port has new values.
    pub(super) fn have_updates(&self) -> bool {
        self.queues.iter().any(|queue| queue.triggers && !queue.is_previous && queue.reader.waiting() > 0)
            || self.inboxes.iter().any(|inbox| inbox.triggers && inbox.receiver.has_messages())
    }

    /// Returns true if values taken at the cycle's beginning were not in a step yet.
    pub(super) fn have_previous_updates(&self) -> bool {
        self.queues.iter().any(|queue| queue.is_previous && queue.triggers && !queue.reader.is_empty())
    }

    /// Takes the early values, those of the last cycle, before the steps of this one.
    pub(super) fn pull_previous(&mut self) {
        for queue in self.queues.iter_mut().filter(|queue| queue.is_previous) {
            // As before a step.
            let _ = queue.reader.pull();
        }
    }

    /// Fills the slots of the next step with the received entries.
    pub(super) fn prepare(&mut self, slots: &mut Slots, log: &ModuleLog, now: u64) {
        self.queues.iter_mut().for_each(|queue| queue.prepare(slots, log));
        self.inboxes.iter_mut().for_each(|inbox| inbox.prepare(slots, now));
        for outbox in &mut self.outboxes {
            outbox.update_deliveries();
            let slot = &mut slots[outbox.slot];
            slot.stamp.sequence = outbox.sent;
            slot.entries = outbox.entries.as_ptr();
            slot.count.set(0);
        }
    }

    /// Answers the messages that the step saw.
    pub(super) fn answer(&mut self) {
        for inbox in &mut self.inboxes {
            for (i, entry) in inbox.entries.iter().enumerate() {
                let reason = entry.answer.get();
                let answer = if reason == 0 { Answer::Done } else { Answer::Refused(reason as u16) };
                inbox.receiver.answer(i, answer);
            }
            // The senders can use the slots at once, and not only after the next step.
            inbox.entries.clear();
            inbox.receiver.release();
        }
    }

    /// Counts the messages of a step that are never sent.
    /// Its state stays, so their numbers must not be given again.
    pub(super) fn lose_messages(&mut self, slots: &Slots) {
        for outbox in &mut self.outboxes {
            let count = slots[outbox.slot].count.get().min(outbox.memory.len());
            (0..count).for_each(|_| outbox.record_message(None));
        }
    }

    /// Sends the messages of a step.
    pub(super) fn send(&mut self, slots: &Slots, now: u64, mut digest: Option<&mut Digest>) {
        for outbox in &mut self.outboxes {
            let count = slots[outbox.slot].count.get().min(outbox.memory.len());
            outbox.send(count, now, digest.as_deref_mut());
        }
    }
}

impl QueuePort {
    fn prepare(&mut self, slots: &mut Slots, log: &ModuleLog) {
        if !self.is_previous {
            // An evicted reader has an empty window from then on; its port says how many values it lost.
            let _ = self.reader.pull();
        }
        self.entries.clear();
        let window = self.reader.window();
        match &self.filter {
            None => self.entries.extend(window.map(|loan| entry(&loan))),
            Some(filter) => {
                let passes =
                    |loan: &Loan<'_>| filter.passes(loan.bytes(), loan.items(), loan.stamp().sequence);
                self.entries.extend(window.filter(passes).map(|loan| entry(&loan)));
            }
        }
        let slot = &mut slots[self.slot];
        slot.entries = self.entries.as_ptr();
        slot.count.set(self.entries.len());
        slot.missed = self.reader.skipped();
        let is_evicted = self.reader.cursor().evicted;
        self.gauge.lag.store(self.reader.waiting(), Ordering::Relaxed);
        self.gauge.lost.store(self.reader.lost(), Ordering::Relaxed);
        self.gauge.evicted.store(is_evicted, Ordering::Relaxed);
        if is_evicted && !std::mem::replace(&mut self.is_evicted, true) {
            log.write(Level::Warn, &self.eviction_message);
        }
    }
}

impl InboxPort {
    fn prepare(&mut self, slots: &mut Slots, now: u64) {
        self.receiver.collect();
        self.receiver.show(now);
        self.entries.clear();
        self.entries.extend(self.receiver.messages().map(|message| Entry {
            data: message.bytes().as_ptr().cast_mut(),
            items: message.items().into(),
            stamp: Stamp { sequence: message.sequence(), time: message.time(), generation: 1 },
            answer: 0.into(),
            sender: message.sender(),
        }));
        let slot = &mut slots[self.slot];
        slot.entries = self.entries.as_ptr();
        slot.count.set(self.entries.len());
    }
}

impl OutboxPort {
    /// Sends the first `count` messages of its memory.
    fn send(&mut self, count: usize, now: u64, mut digest: Option<&mut Digest>) {
        for i in 0..count {
            let Some(sender) = &mut self.sender else {
                self.record_message(None);
                continue;
            };
            let data = self.memory[i].as_mut_ptr();
            // SAFETY: the memory holds a value of that size, written by this step.
            let value = unsafe {
                self.form.clear_gaps(data, self.size, 0);
                std::slice::from_raw_parts(data, self.size)
            };
            if let Some(digest) = digest.as_deref_mut() {
                digest.add(self.index, value);
            }
            let ticket = sender.send(value, 0, now).ok();
            self.refused += u64::from(ticket.is_none());
            self.record_message(ticket);
        }
        if count > 0
            && let Some(wake) = &self.wake
        {
            wake.notify(1);
        }
    }
}

fn entry(loan: &Loan<'_>) -> Entry {
    Entry {
        data: loan.as_ptr().cast_mut(),
        items: loan.items().into(),
        stamp: loan.stamp(),
        answer: 0.into(),
        sender: 0,
    }
}
