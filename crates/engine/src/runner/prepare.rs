use std::sync::atomic::Ordering;

use slate_blackboard::channel::{Latest, Loan};
use slate_blackboard::commit::{pin, pin_both};
use slate_module::{Entry, Flags, Level};

use super::{Group, Runner};

/// How often a group of inputs is pinned again when its writer is just committing.
const PIN_TRIES: u32 = 4;

impl Group {
    /// As [`pin`](Group::pin), for a step in whose time no other module of the loop is at work: what one of them writes is
    /// not pinned. Their last commit is whole.
    ///
    /// # Safety
    /// As for [`Latest::refresh_in_turn`].
    #[inline]
    unsafe fn take(&self, readers: &mut [Latest], sources: &mut [Latest]) {
        let own = &mut readers[self.first as usize..self.end as usize];
        if self.first_source == self.end_source && own.iter().all(Latest::is_in_turn) {
            for reader in own {
                // SAFETY: passed on to the caller.
                unsafe { reader.refresh_in_turn() };
            }
        } else {
            self.pin(readers, sources, PIN_TRIES);
        }
    }

    /// Whether it is an input alone.
    pub fn is_one_reader(&self) -> bool {
        self.end - self.first == 1 && self.first_source == self.end_source
    }

    /// Takes over the newest values, together if there are several. What can't be pinned together stays at the previous
    /// snapshot, which is consistent too.
    pub fn pin(&self, readers: &mut [Latest], sources: &mut [Latest], tries: u32) {
        let readers = &mut readers[self.first as usize..self.end as usize];
        let sources = &mut sources[self.first_source as usize..self.end_source as usize];
        match (readers, sources) {
            ([one], []) | ([], [one]) => {
                one.refresh();
            }
            (several, []) => {
                pin(&self.word, several, tries);
            }
            (readers, sources) => {
                pin_both(&self.word, readers, sources, tries);
            }
        }
    }
}

impl Runner {
    /// Pins what is to be of the last cycle, before the steps of this one.
    pub fn pin_early(&mut self) {
        for group in &self.early {
            group.pin(&mut self.readers, &mut self.sources, PIN_TRIES);
        }
        for queue in self.queues.iter_mut().filter(|queue| queue.is_early) {
            // As before a step.
            let _ = queue.reader.pull();
        }
    }

    /// Whether what was pinned when the cycle began has not been seen by a step.
    pub(super) fn has_early_news(&self) -> bool {
        let readers = self.early.iter().flat_map(|group| group.first as usize..group.end as usize);
        let mut inputs =
            readers.filter_map(|at| Some((self.inputs.get(at)?, self.readers[at].value()?.stamp())));
        inputs.any(|(input, stamp)| input.triggers && input.seen != (stamp.sequence, stamp.generation))
            || self.queues.iter().any(|queue| queue.is_early && queue.triggers && !queue.reader.is_empty())
    }

    /// Pins the inputs and fills the frame for a step at `now`.
    pub fn prepare(&mut self, now: u64) {
        if self.has_company {
            for group in &self.groups {
                group.pin(&mut self.readers, &mut self.sources, PIN_TRIES);
            }
        }
        self.prepare_pinned(now);
    }

    /// As [`prepare`](Runner::prepare), for a step that is the loop's only one while it lasts.
    ///
    /// # Safety
    /// The seats of the loop that write [in turn](slate_blackboard::channel::Writer::set_in_turn) are in no step until that
    /// one has ended, or was [given up](Runner::give_up).
    #[inline]
    pub unsafe fn prepare_in_turn(&mut self, now: u64) {
        // SAFETY: the values are looked at in the step, and what reads them is told to hold them when that is given up.
        unsafe {
            if self.reads_apart {
                for reader in &mut self.readers {
                    reader.refresh_in_turn();
                }
            } else {
                for group in &self.groups {
                    group.take(&mut self.readers, &mut self.sources);
                }
            }
        }
        self.prepare_pinned(now);
    }

    /// Fills the frame.
    #[inline(always)] // As for `commit`.
    fn prepare_pinned(&mut self, now: u64) {
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
        if !self.has_only_values {
            self.show_shadow();
        }
    }

    #[inline(always)]
    fn prepare_ports(&mut self, now: u64) {
        if self.has_conversions {
            self.convert();
        }
        self.fill_inputs(now);
        if self.has_conversions {
            self.mark_converted(now);
        }
        for output in &mut self.outputs {
            let slot = &mut self.slots[output.slot];
            let wanted = !output.debug || output.property.is_watched();
            slot.data = if wanted { output.writer.draft_ptr() } else { std::ptr::null_mut() };
            slot.items.set(0);
            slot.flags.set(0);
            slot.priority.set(0);
        }
        if !self.has_only_values {
            self.prepare_other_ports(now);
        }
    }

    fn prepare_other_ports(&mut self, now: u64) {
        for queue in &mut self.queues {
            if !queue.is_early {
                // An evicted reader has an empty window from then on; its port says how many values it lost.
                let _ = queue.reader.pull();
            }
            queue.entries.clear();
            let window = queue.reader.window();
            match &queue.filter {
                None => queue.entries.extend(window.map(|loan| entry(&loan))),
                Some(filter) => {
                    let passes =
                        |loan: &Loan<'_>| filter.passes(loan.bytes(), loan.items(), loan.stamp().sequence);
                    queue.entries.extend(window.filter(passes).map(|loan| entry(&loan)));
                }
            }
            let slot = &mut self.slots[queue.slot];
            slot.entries = queue.entries.as_ptr();
            slot.count.set(queue.entries.len());
            slot.missed = queue.reader.skipped();
            let is_evicted = queue.reader.cursor().evicted;
            queue.gauge.lag.store(queue.reader.waiting(), Ordering::Relaxed);
            queue.gauge.lost.store(queue.reader.lost(), Ordering::Relaxed);
            queue.gauge.evicted.store(is_evicted, Ordering::Relaxed);
            if is_evicted && !std::mem::replace(&mut queue.is_evicted, true) {
                self.log.write(Level::Warn, &queue.farewell);
            }
        }
        for inbox in &mut self.inboxes {
            inbox.receiver.collect();
            inbox.receiver.show(now);
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
        for outbox in &mut self.outboxes {
            outbox.settle();
            let slot = &mut self.slots[outbox.slot];
            slot.stamp.sequence = outbox.sent;
            slot.entries = outbox.entries.as_ptr();
            slot.count.set(0);
        }
        for provider in &self.providers {
            self.slots[provider.slot].flags.set(if provider.is_provided() { Flags::SET } else { 0 });
        }
        self.services.iter_mut().for_each(|service| service.prepare(now));
    }

    #[inline(always)]
    fn fill_inputs(&mut self, now: u64) {
        for (input, reader) in self.inputs.iter_mut().zip(&self.readers) {
            let slot = &mut self.slots[input.slot as usize];
            let working = input.writer.as_ref().is_none_or(|health| health.is_working());
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
