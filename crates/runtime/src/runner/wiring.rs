use std::sync::Arc;

use slate_blackboard::channel::{Latest, QueueReader};
use slate_blackboard::commit::pin;
use slate_blackboard::message::Sender;
use slate_blackboard::wake::Wake;
use slate_module::Entry;

use super::{Group, InputPort, QueuePort, Runner};

/// What a module's ports read and send to. It is exchanged between two steps, so a step sees all of a change or nothing.
#[derive(Default)]
pub(crate) struct Wiring {
    /// In the order of the groups, each with its reader; none where the port goes on with the one that it has.
    pub inputs: Vec<(InputPort, Option<Latest>)>,
    pub groups: Vec<Group>,
    pub queues: Vec<QueueWiring>,
    pub outboxes: Vec<OutboxWiring>,
    /// The reader of `enabled`, if it is another one, and whether another module switches this one.
    pub switch: Option<(Latest, bool)>,
}

/// What a queue input reads.
pub(crate) struct QueueWiring {
    pub slot: usize,
    pub triggers: bool,
    /// None where the port goes on with the one that it has, and its cursor.
    pub reader: Option<QueueReader>,
    /// How many entries there may be.
    pub window: usize,
}

/// What an outbox sends to.
pub(crate) struct OutboxWiring {
    pub slot: usize,
    pub sender: Option<Sender>,
    pub wake: Option<Arc<Wake>>,
}

/// Handles that are no longer used; dropping them takes locks, and so is not for the loop.
#[derive(Default)]
pub(crate) struct Unwired {
    #[allow(dead_code, reason = "it is there to be dropped")]
    readers: Vec<Latest>,
    #[allow(dead_code, reason = "as above")]
    queues: Vec<QueuePort>,
    #[allow(dead_code, reason = "as above")]
    senders: Vec<Sender>,
}

// SAFETY: the entries of a queue point into values that its reader pins, and go with it.
unsafe impl Send for Unwired {}

/// How often inputs that belong together are pinned when they are linked: a commit of their writer takes microseconds.
const FIRST_PIN_TRIES: u32 = 10_000;

impl Runner {
    /// Goes on with other ports' readers, from the next step on. The module is in no step.
    pub fn rewire(&mut self, wiring: Wiring) -> Unwired {
        let Wiring { inputs, groups, queues, outboxes, switch } = wiring;
        let mut unwired = Unwired::default();
        let ports = std::mem::take(&mut self.inputs);
        let mut old: Vec<_> = ports.into_iter().zip(std::mem::take(&mut self.readers)).collect();
        for (mut port, reader) in inputs {
            let reader = match reader {
                Some(reader) => reader,
                None => {
                    let Some(at) = old.iter().position(|(known, _)| known.slot == port.slot) else {
                        continue;
                    };
                    let (known, reader) = old.swap_remove(at);
                    (port.seen, port.missed) = (known.seen, known.missed);
                    reader
                }
            };
            self.inputs.push(port);
            self.readers.push(reader);
        }
        unwired.readers.extend(old.into_iter().map(|(_, reader)| reader));
        self.groups = groups;
        for group in &self.groups {
            // Values of one writer belong together from the first step on.
            if let Some(several @ [_, _, ..]) = self.readers.get_mut(group.first..group.end) {
                pin(&group.word, several, FIRST_PIN_TRIES);
            }
        }
        let mut old = std::mem::take(&mut self.queues);
        for QueueWiring { slot, triggers, reader, window } in queues {
            let known = old.iter().position(|port| port.slot == slot);
            match (reader, known) {
                (Some(reader), _) => {
                    let entries: Vec<Entry> = Vec::with_capacity(window);
                    self.queues.push(QueuePort { slot, triggers, reader, entries });
                }
                (None, Some(at)) => self.queues.push(old.swap_remove(at)),
                (None, None) => {}
            }
        }
        unwired.queues = old;
        for OutboxWiring { slot, sender, wake } in outboxes {
            if let Some(port) = self.outboxes.iter_mut().find(|port| port.slot == slot) {
                port.wake = wake;
                unwired.senders.extend(std::mem::replace(&mut port.sender, sender));
            }
        }
        if let Some((reader, is_switched)) = switch {
            unwired.readers.push(std::mem::replace(&mut self.enabled, reader));
            (self.is_switched, self.settings_seen) = (is_switched, None);
        }
        self.rewired = true;
        unwired
    }
}
