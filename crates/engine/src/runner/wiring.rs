use std::sync::Arc;

use slate_blackboard::channel::{Latest, QueueReader, Writer};
use slate_blackboard::message::Sender;
use slate_blackboard::wake::Wake;
use slate_module::Entry;

use slate_composition::link::Filter;

use super::{
    Conversion, Conversions, ConvertedSource, EntryPorts, Group, InputPort, Inputs, LinkEnd, QueueGauge,
    QueuePort,
};

/// Links of a module's ports: readers and senders.
/// It is exchanged between two steps, so a step sees all of a change or nothing.
#[derive(Default)]
pub struct Wiring {
    /// Inputs in the order of the groups, each with its reader.
    /// `None` keeps the port's present reader.
    pub inputs: Vec<(InputPort, Option<Latest>)>,
    /// Sources in the order of the groups.
    pub sources: Vec<SourceWiring>,
    /// Groups of inputs that are pinned together.
    pub groups: Vec<Group>,
    /// Groups pinned at the beginning of a cycle.
    pub previous_groups: Vec<Group>,
    /// Queue inputs.
    pub queues: Vec<QueueWiring>,
    /// Outboxes.
    pub outboxes: Vec<OutboxWiring>,
    /// Conversions of links that do not fit the port directly.
    pub conversions: Vec<ConversionWiring>,
    /// New reader of `enabled`, and true if another module switches this one.
    /// `None` keeps the present reader.
    pub switch: Option<(Latest, bool)>,
}

impl Wiring {
    /// Returns true if some values are taken at the beginning of a cycle.
    pub fn reads_previous(&self) -> bool {
        !self.previous_groups.is_empty() || self.queues.iter().any(|queue| queue.is_previous)
    }
}

/// Link of a queue input.
pub struct QueueWiring {
    /// Slot in the frame.
    pub slot: usize,
    /// True if new values trigger a step.
    pub triggers: bool,
    /// New reader; `None` keeps the port's present reader, and its cursor.
    pub reader: Option<QueueReader>,
    /// Maximum number of entries in a step.
    pub window: usize,
    /// Filter of the values; `None` if all pass.
    pub filter: Option<Arc<Filter>>,
    /// True if its values are taken at the beginning of a cycle.
    pub is_previous: bool,
    /// Backlog.
    pub gauge: Arc<QueueGauge>,
    /// Log message of the eviction.
    pub eviction_message: Box<str>,
}

/// Link of an outbox.
pub struct OutboxWiring {
    /// Slot in the frame.
    pub slot: usize,
    /// Sender of the messages.
    pub sender: Option<Sender>,
    /// Wakes the receiver.
    pub wake: Option<Arc<Wake>>,
}

/// Conversion of a link that does not fit the port directly.
pub enum ConversionWiring {
    /// Unchanged conversion.
    Same(LinkEnd),
    /// New conversion; without a writer, it keeps the present one.
    New(Conversion),
}

/// Source of a conversion.
pub struct SourceWiring {
    /// Target.
    pub link_end: LinkEnd,
    /// Reader and conversion of the source; `None` if the conversion is unchanged.
    pub source: Option<(Latest, ConvertedSource)>,
    /// Index in the present conversion.
    pub ordinal: usize,
}

/// Handles that are no longer used.
/// Dropping them takes locks, so the loop does not do it.
#[derive(Default)]
pub struct ReplacedHandles {
    #[allow(dead_code, reason = "it is there to be dropped")]
    pub(super) readers: Vec<Latest>,
    #[allow(dead_code, reason = "as above")]
    queues: Vec<QueuePort>,
    #[allow(dead_code, reason = "as above")]
    senders: Vec<Sender>,
    #[allow(dead_code, reason = "as above")]
    conversions: Vec<Conversion>,
}

// SAFETY: the entries of a queue point into values that its reader pins, and go with it.
unsafe impl Send for ReplacedHandles {}

/// Number of attempts to pin a group of inputs when it is linked.
/// A commit of their writer takes microseconds.
const FIRST_PIN_TRIES: u32 = 10_000;

/// Part of a [`Wiring`] that fills inputs.
pub(super) struct InputWiring {
    pub inputs: Vec<(InputPort, Option<Latest>)>,
    pub sources: Vec<SourceWiring>,
    pub groups: Vec<Group>,
    pub previous_groups: Vec<Group>,
    pub conversions: Vec<ConversionWiring>,
}

impl Inputs {
    /// Replaces the readers.
    pub(super) fn rewire(&mut self, wiring: InputWiring, replaced: &mut ReplacedHandles) {
        let InputWiring { inputs, sources, groups, previous_groups, conversions } = wiring;
        let ports = std::mem::take(&mut self.ports);
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
            self.ports.push(port);
            self.readers.push(reader);
        }
        replaced.readers.extend(old.into_iter().map(|(_, reader)| reader));
        self.conversions.rewire(conversions, sources, &self.ports, replaced);
        (self.groups, self.previous_groups) = (groups, previous_groups);
        self.pin_first(FIRST_PIN_TRIES);
        self.requirements.reopen();
    }
}

impl Conversions {
    fn rewire(
        &mut self,
        conversions: Vec<ConversionWiring>,
        sources: Vec<SourceWiring>,
        inputs: &[InputPort],
        replaced: &mut ReplacedHandles,
    ) {
        let mut old = std::mem::take(&mut self.all);
        let mut readers: Vec<Option<Latest>> =
            std::mem::take(&mut self.sources).into_iter().map(Some).collect();
        for conversion in conversions {
            let known =
                |old: &[Conversion], link_end| old.iter().position(|other| other.link_end == link_end);
            match conversion {
                ConversionWiring::Same(link_end) => {
                    if let Some(at) = known(&old, link_end) {
                        self.all.push(old.swap_remove(at));
                    }
                }
                ConversionWiring::New(mut new) => {
                    if new.writer.is_none()
                        && let Some(at) = known(&old, new.link_end)
                    {
                        new.writer = std::mem::take::<Option<Writer>>(&mut old[at].writer);
                    }
                    self.all.push(new);
                }
            }
        }
        for SourceWiring { link_end, source, ordinal } in sources {
            let Some(conversion) = self.all.iter_mut().find(|other| other.link_end == link_end) else {
                continue;
            };
            let index = self.sources.len();
            match source {
                Some((reader, source)) => {
                    self.sources.push(reader);
                    conversion.sources.push(ConvertedSource { reader: index, ..source });
                }
                None => {
                    let Some(source) = conversion.sources.get_mut(ordinal) else { continue };
                    let Some(reader) = readers.get_mut(source.reader).and_then(Option::take) else {
                        continue;
                    };
                    self.sources.push(reader);
                    source.reader = index;
                }
            }
        }
        for conversion in &mut self.all {
            let own =
                inputs.iter().position(|input| LinkEnd::Port(input.slot as usize) == conversion.link_end);
            conversion.reader = own.unwrap_or(0);
        }
        replaced.readers.extend(readers.into_iter().flatten());
        replaced.conversions = old;
    }
}

impl EntryPorts {
    /// Replaces the readers and senders.
    pub(super) fn rewire(
        &mut self,
        queues: Vec<QueueWiring>,
        outboxes: Vec<OutboxWiring>,
        replaced: &mut ReplacedHandles,
    ) {
        let mut old = std::mem::take(&mut self.queues);
        for QueueWiring { slot, triggers, reader, window, filter, is_previous, gauge, eviction_message } in
            queues
        {
            let known = old.iter().position(|port| port.slot == slot);
            match (reader, known) {
                (Some(reader), _) => {
                    let entries: Vec<Entry> = Vec::with_capacity(window);
                    let is_evicted = false;
                    self.queues.push(QueuePort {
                        slot,
                        triggers,
                        reader,
                        entries,
                        filter,
                        is_previous,
                        gauge,
                        eviction_message,
                        is_evicted,
                    });
                }
                (None, Some(at)) => self.queues.push(old.swap_remove(at)),
                (None, None) => {}
            }
        }
        replaced.queues = old;
        for OutboxWiring { slot, sender, wake } in outboxes {
            if let Some(port) = self.outboxes.iter_mut().find(|port| port.slot == slot) {
                port.wake = wake;
                replaced.senders.extend(port.replace_sender(sender));
            }
        }
    }
}
