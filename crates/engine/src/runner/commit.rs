use std::sync::atomic::Ordering;

use slate_blackboard::channel::Latest;
use slate_blackboard::interface::View;
use slate_blackboard::message::Answer;
use slate_module::{Flags, Priority};

use super::{Measured, ModuleCondition, ModuleTiming, PANIC_LIMIT, PANIC_ROW, Runner, TIMING_PERIOD, count};
use crate::digest::Digest;

impl Runner {
    /// Checks and commits what a step wrote. `code` is what the step returned.
    #[inline(always)] // Part of every step. Left to the compiler it is a call or not, for a tenth of the step.
    pub fn commit(&mut self, now: u64, code: i32, digest: Option<&mut Digest>) {
        if !self.has_only_values {
            self.hand_to_shadow();
            self.answer();
        }
        let condition = match code {
            0 => ModuleCondition::WORKING,
            1 => ModuleCondition::DEGRADED,
            2 => ModuleCondition::FAILED,
            _ => return self.recover(now),
        };
        self.set_condition(condition, now);
        if condition == ModuleCondition::FAILED {
            self.services.iter_mut().for_each(|service| service.abandon());
            self.lose_messages();
            self.publish_safe(now);
        } else {
            self.publish(now, digest);
        }
    }

    /// Answers the messages that the step saw.
    fn answer(&mut self) {
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

    /// Counts the messages of a step whose state stays, but which nobody gets: their numbers are not given again.
    fn lose_messages(&mut self) {
        for outbox in &mut self.outboxes {
            let count = self.slots[outbox.slot].count.get().min(outbox.memory.len());
            (0..count).for_each(|_| outbox.note(None));
        }
    }

    #[inline(always)]
    fn publish(&mut self, now: u64, mut digest: Option<&mut Digest>) {
        let several = self.outputs.len() > 1;
        if several {
            self.commit.begin();
        }
        let mut is_awaited = false;
        for output in &mut self.outputs {
            let slot = &self.slots[output.slot];
            let set = slot.flags.get() & Flags::SET != 0;
            if set && !slot.data.is_null() {
                let items = slot.items.get().min(output.writer.capacity());
                let bytes = output.writer.bytes(items);
                // SAFETY: the draft is lent to this runner until it is published, has room for those items, and holds a
                // value of the interface.
                let value = unsafe { output.form.canonical(slot.data, bytes, items) };
                if let Some((actuator, commander)) = &output.actuator {
                    actuator.offer(*commander, priority(slot.priority.get()), value, now);
                }
                if let Some(digest) = digest.as_deref_mut().filter(|_| !output.debug) {
                    digest.add(output.index, value);
                }
                // Only a recorder in lockstep may hold a writer up; its readers then find nothing new.
                let _ = output.writer.publish(items, now);
                is_awaited |= !output.wakes.is_empty();
            } else if let Some((actuator, commander)) = &output.actuator {
                // A command that is not renewed ends at once.
                actuator.withdraw(*commander, now);
            }
        }
        if several {
            self.commit.end();
        }
        // Only now, as a reader that wakes up wants all outputs of this tick.
        for output in self.outputs.iter().filter(|_| is_awaited) {
            if self.slots[output.slot].flags.get() & Flags::SET != 0 {
                output.wakes.iter().for_each(|wake| wake.notify(1));
            }
        }
        if !self.has_only_values {
            self.publish_others(now, digest);
        }
    }

    /// What is published of services, and the messages.
    fn publish_others(&mut self, now: u64, mut digest: Option<&mut Digest>) {
        for service in &mut self.services {
            service.commit(now, digest.as_deref_mut());
        }
        for outbox in &mut self.outboxes {
            let count = self.slots[outbox.slot].count.get().min(outbox.memory.len());
            for i in 0..count {
                let Some(sender) = &mut outbox.sender else {
                    outbox.note(None);
                    continue;
                };
                let data = outbox.memory[i].as_mut_ptr();
                // SAFETY: the memory holds a value of that size, written by this step.
                let value = unsafe {
                    outbox.form.clear_gaps(data, outbox.size, 0);
                    std::slice::from_raw_parts(data, outbox.size)
                };
                if let Some(digest) = digest.as_deref_mut() {
                    digest.add(outbox.index, value);
                }
                let ticket = sender.send(value, 0, now).ok();
                outbox.refused += u64::from(ticket.is_none());
                outbox.note(ticket);
            }
            if count > 0
                && let Some(wake) = &outbox.wake
            {
                wake.notify(1);
            }
        }
    }

    /// Gives every output its safe value, and ends its commands.
    pub fn publish_safe(&mut self, now: u64) {
        let late = self.condition() == ModuleCondition::LATE;
        self.commit.begin();
        for output in &mut self.outputs {
            if let Some((actuator, commander)) = &output.actuator {
                actuator.withdraw(*commander, now);
            }
            if late && output.aside.is_none() {
                output.aside = output.writer.set_aside();
            }
            if let Some(safe) = &output.safe
                && output.writer.write(safe, 0, now).is_ok()
            {
                output.wakes.iter().for_each(|wake| wake.notify(1));
            }
        }
        self.commit.end();
        self.services.iter().for_each(|service| service.rest(now));
    }

    /// Whether what this module writes is written in turn with the steps of the loop.
    ///
    /// # Safety
    /// As for [`Writer::set_in_turn`](slate_blackboard::channel::Writer::set_in_turn): from then on its steps, and all else
    /// that writes its outputs, are made by who has the loop's token, and in no other module's step.
    pub unsafe fn set_in_turn(&mut self, in_turn: bool) {
        for output in &self.outputs {
            // SAFETY: passed on to the caller.
            unsafe { output.writer.set_in_turn(in_turn) };
        }
        // Who writes what it reads may leave the loop, too.
        self.readers.iter_mut().for_each(Latest::hold);
    }

    /// A step was given up: its outputs become safe, and nobody calls its services. The step may still look at its inputs,
    /// so they are held before the loop goes on.
    pub fn give_up(&mut self, now: u64) {
        // SAFETY: the loop is in this step, or in one that has pinned what it reads; both are over before it goes on.
        unsafe { self.set_in_turn(false) };
        self.set_condition(ModuleCondition::LATE, now);
        self.publish_safe(now);
        self.providers.iter().for_each(|provider| provider.suspend(true));
    }

    /// A late step has returned that code: what it wrote is dropped, and it may run again; with a fresh state if it panicked.
    pub fn welcome_back(&mut self, code: i32) {
        self.providers.iter().for_each(|provider| provider.suspend(false));
        for output in &mut self.outputs {
            output.aside = None;
        }
        self.services.iter_mut().for_each(|service| service.abandon());
        self.lose_messages();
        // The process of an isolated one says by itself how it ended.
        if !(0..=2).contains(&code) && self.supervised.is_none() {
            return self.recover(self.last_tick);
        }
        self.set_condition(ModuleCondition::DEGRADED, self.last_tick);
    }

    /// After a panic: safe values, and an instance made anew. That knows of no message, so none is counted; an isolated one
    /// may also have ended long after its last step was committed.
    pub(super) fn recover(&mut self, now: u64) {
        self.services.iter_mut().for_each(|service| service.abandon());
        self.disarm(now);
        self.panics += 1;
        self.health.panics.store(self.panics.into(), Ordering::Relaxed);
        let tick = self.frame.number;
        if tick.saturating_sub(self.last_panic) > PANIC_ROW {
            self.panics_in_a_row = 0;
        }
        self.panics_in_a_row += 1;
        self.last_panic = tick;
        self.set_condition(ModuleCondition::FAILED, now);
        self.publish_safe(now);
        self.destroy();
        if self.supervised.is_some() {
            return self.fall(now);
        }
        let again = if self.panics_in_a_row >= PANIC_LIMIT {
            Err(format!("panicked {PANIC_LIMIT} times in a row; it stays off until its plugin is reloaded"))
        } else {
            self.create().map_err(|refusal| refusal.to_string())
        };
        match again {
            Ok(instance) => {
                self.instance = instance;
                self.log.write(slate_module::Level::Error, "panicked; started anew with a fresh state");
            }
            Err(reason) => {
                self.set_condition(ModuleCondition::FAULTED, now);
                self.log.write(slate_module::Level::Error, &reason);
            }
        }
    }

    /// Counts a step, and how many wall-clock nanoseconds it took if that was measured; it stands for so many steps in the
    /// histogram.
    #[inline]
    pub fn time(&mut self, duration: Option<u64>, stands_for: u32) {
        let measured = &mut self.measured;
        if let Some(duration) = duration {
            if stands_for > 0 {
                self.health.histogram.record(duration, stands_for);
            }
            measured.longest = measured.longest.max(duration);
            if self.deadline.is_some_and(|deadline| duration > deadline) {
                count(&self.health.misses);
            }
        }
        let period = self.frame.elapsed;
        if self.frame.number > 2 {
            measured.jitter = measured.jitter.max(period.abs_diff(measured.period));
        }
        measured.period = period;
        if self.frame.now - measured.written >= TIMING_PERIOD || self.frame.number == 1 {
            self.show_timing();
        }
    }

    /// Writes `/module/timing`.
    fn show_timing(&mut self) {
        let (measured, now) = (&mut self.measured, self.frame.now);
        for input in &self.inputs {
            let written = self.slots[input.slot as usize].stamp.time;
            input.age.set((input.seen != (0, 0)).then(|| now.saturating_sub(written)));
        }
        let mut timing = ModuleTiming {
            ticks: self.frame.number,
            period: measured.period,
            duration: measured.longest,
            jitter: measured.jitter,
            misses: self.health.misses.load(Ordering::Relaxed),
        };
        *measured = Measured { written: now, period: measured.period, longest: 0, jitter: 0 };
        // Only a recorder in lockstep may hold a writer up; the next timing comes soon.
        let _ = self.timing.write(View::of(&mut timing).bytes(), 0, now);
        self.show_process(now, false);
    }
}

/// A priority as it comes from a module.
pub fn priority(number: u32) -> Priority {
    match number {
        3 => Priority::Reflex,
        2 => Priority::Teleoperation,
        _ => Priority::Plan,
    }
}
