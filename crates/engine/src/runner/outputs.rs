use slate_blackboard::commit::CommitWord;
use slate_module::{Flags, Level, Priority};

use super::{OutputPort, Slots, StepFrame};
use crate::digest::Digest;
use crate::log::ModuleLog;

/// Outputs of a module.
#[repr(C)]
pub struct Outputs {
    /// Ports, one for each output.
    pub ports: Vec<OutputPort>,
    /// Counter of commits, which makes the results of a step visible at once.
    commit: CommitWord,
}

impl Outputs {
    /// Returns no outputs yet; `commit` counts the commits of the module.
    pub fn new(commit: CommitWord) -> Self {
        Self { ports: Vec::new(), commit }
    }

    /// Shows the next step where it writes.
    #[inline(always)] // Part of every step.
    pub(super) fn prepare(&mut self, slots: &mut Slots) {
        for output in &mut self.ports {
            let slot = &mut slots[output.slot];
            let is_wanted = !output.debug || output.property.is_watched();
            slot.data = if is_wanted { output.writer.draft_ptr() } else { std::ptr::null_mut() };
            slot.items.set(0);
            slot.flags.set(0);
            slot.priority.set(0);
        }
    }

    /// Publishes the outputs of a step, at the agent's time `now`, ns.
    /// A command is as old as its step, which may have taken long.
    #[inline(always)] // Part of every step.
    pub(super) fn publish(&mut self, step: &StepFrame, now: u64, mut digest: Option<&mut Digest>) {
        let slots = &step.slots;
        let has_several = self.ports.len() > 1;
        if has_several {
            self.commit.begin();
        }
        let mut is_awaited = false;
        for output in &mut self.ports {
            let slot = &slots[output.slot];
            let is_set = slot.flags.get() & Flags::SET != 0;
            if is_set && !slot.data.is_null() {
                let items = slot.items.get().min(output.writer.capacity());
                let bytes = output.writer.bytes(items);
                // SAFETY: the draft is lent to this runner until it is published, has room for those items, and holds a
                // value of the interface.
                let value = unsafe { output.form.canonical(slot.data, bytes, items) };
                if let Some((actuator, commander)) = &output.actuator {
                    actuator.offer(*commander, priority(slot.priority.get()), value, step.frame.now);
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
        if has_several {
            self.commit.end();
        }
        // Only now, as a reader that wakes up wants all outputs of this tick.
        if is_awaited {
            self.wake_readers(slots);
        }
    }

    /// Wakes the threads that wait for the outputs of a step.
    #[inline(never)] // Few outputs are awaited.
    fn wake_readers(&self, slots: &Slots) {
        let written = self.ports.iter().filter(|output| slots[output.slot].flags.get() & Flags::SET != 0);
        written.flat_map(|output| &output.wakes).for_each(|wake| wake.notify(1));
    }

    /// Publishes the safe values of all outputs, and ends their commands.
    /// For a late step, which may still write to its drafts, it uses other drafts.
    pub(super) fn publish_safe(&mut self, is_late: bool, now: u64) {
        self.commit.begin();
        for output in &mut self.ports {
            if let Some((actuator, commander)) = &output.actuator {
                actuator.withdraw(*commander, now);
            }
            if is_late && output.late_draft.is_none() {
                output.late_draft = output.writer.set_aside();
            }
            if let Some(safe) = &output.safe
                && output.writer.write(safe, 0, now).is_ok()
            {
                output.wakes.iter().for_each(|wake| wake.notify(1));
            }
        }
        self.commit.end();
    }

    /// Takes back the drafts of a late step, which has returned.
    pub(super) fn reclaim_drafts(&mut self) {
        self.ports.iter_mut().for_each(|output| output.late_draft = None);
    }

    /// Sets whether the outputs are written in turn with the steps of the loop.
    ///
    /// # Safety
    /// As for [`Writer::set_in_turn`](slate_blackboard::channel::Writer::set_in_turn).
    pub(super) unsafe fn set_in_turn(&self, in_turn: bool) {
        for output in &self.ports {
            // SAFETY: passed on to the caller.
            unsafe { output.writer.set_in_turn(in_turn) };
        }
    }

    /// Disarms the actuators until they are armed again.
    pub(super) fn disarm(&self, log: &ModuleLog, now: u64) {
        for (actuator, _) in self.ports.iter().filter_map(|output| output.actuator.as_ref()) {
            actuator.disarm(now);
            let name = actuator.name();
            log.write(Level::Error, &format!("its actuator {name} is disarmed: `slate arm` arms it"));
        }
    }
}

/// Converts a module's number of a priority.
pub fn priority(number: u32) -> Priority {
    match number {
        3 => Priority::Reflex,
        2 => Priority::Teleoperation,
        _ => Priority::Plan,
    }
}
