use slate_blackboard::channel::Loan;
use slate_blackboard::commit::pin;
use slate_module::{Entry, Flags};

use super::Runner;

/// How often a group of inputs is pinned again when its writer is just committing.
const PIN_TRIES: u32 = 4;

impl Runner {
    /// Pins the inputs and fills the frame for a step at `now`.
    pub fn prepare(&mut self, now: u64) {
        if self.has_company {
            self.prepare_ports(now);
        }
        if std::mem::take(&mut self.params_changed) {
            if self.params.refresh() {
                self.frame.params_version += 1;
            }
            if let Some(loan) = self.params.value() {
                self.frame.params = loan.as_ptr();
            }
        }
        self.frame.now = now;
        self.frame.elapsed = if self.frame.number == 0 { 0 } else { now - self.last_tick };
        self.frame.number += 1;
        self.last_tick = now;
        if self.has_company {
            self.show_shadow();
        }
    }

    fn prepare_ports(&mut self, now: u64) {
        for group in &self.groups {
            match &mut self.readers[group.first..group.end] {
                [one] => {
                    one.refresh();
                }
                // What can't be pinned together stays at the previous snapshot, which is consistent too.
                several => {
                    pin(&group.word, several, PIN_TRIES);
                }
            }
        }
        self.fill_inputs(now);
        for queue in &mut self.queues {
            // An evicted reader has an empty window from then on; its port says how many values it lost.
            let _ = queue.reader.pull();
            queue.entries.clear();
            queue.entries.extend(queue.reader.window().map(|loan| entry(&loan)));
            let slot = &mut self.slots[queue.slot];
            slot.entries = queue.entries.as_ptr();
            slot.count.set(queue.entries.len());
            slot.missed = queue.reader.skipped();
        }
        for inbox in &mut self.inboxes {
            inbox.receiver.collect();
            inbox.entries.clear();
            inbox.entries.extend(inbox.receiver.messages().map(|message| Entry {
                data: message.bytes().as_ptr().cast_mut(),
                items: message.items().into(),
                stamp: slate_blackboard::Stamp {
                    sequence: message.sequence(),
                    time: message.time(),
                    generation: 1,
                },
                answer: 0.into(),
                sender: message.sender(),
            }));
            let slot = &mut self.slots[inbox.slot];
            slot.entries = inbox.entries.as_ptr();
            slot.count.set(inbox.entries.len());
        }
        for output in &mut self.outputs {
            let slot = &mut self.slots[output.slot];
            let wanted = !output.debug || output.property.is_watched();
            slot.data = if wanted { output.writer.draft_ptr() } else { std::ptr::null_mut() };
            slot.items.set(0);
            slot.flags.set(0);
            slot.priority.set(0);
        }
        for outbox in &mut self.outboxes {
            self.slots[outbox.slot].count.set(0);
        }
        for provider in &self.providers {
            self.slots[provider.slot].flags.set(if provider.is_provided() { Flags::SET } else { 0 });
        }
        self.services.iter_mut().for_each(|service| service.prepare(now));
    }

    fn fill_inputs(&mut self, now: u64) {
        for (input, reader) in self.inputs.iter_mut().zip(&self.readers) {
            let slot = &mut self.slots[input.slot];
            let working = input.writer.as_ref().is_none_or(|health| health.condition().is_working());
            let mut flags = if working { Flags::ALIVE } else { 0 };
            match reader.value() {
                Some(loan) => {
                    let stamp = loan.stamp();
                    slot.data = loan.as_ptr().cast_mut();
                    slot.items.set(loan.items());
                    slot.stamp = stamp;
                    let (seen, generation) = input.seen;
                    if input.seen != (stamp.sequence, stamp.generation) {
                        flags |= Flags::NEW;
                        if generation == stamp.generation {
                            input.missed += stamp.sequence.saturating_sub(seen + 1);
                        }
                        input.seen = (stamp.sequence, stamp.generation);
                    }
                    let old = input.stale_after.is_some_and(|after| now.saturating_sub(stamp.time) > after);
                    if old || !working {
                        flags |= Flags::STALE;
                    }
                }
                None => {
                    slot.data = self.zeros.as_ptr().cast_mut();
                    slot.items.set(0);
                    flags |= Flags::STALE;
                }
            }
            slot.missed = input.missed;
            slot.flags.set(flags);
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
