use std::sync::Arc;

use slate_blackboard::channel::{Latest, QueueReader, Writer};
use slate_blackboard::message::Sender;
use slate_blackboard::wake::Wake;
use slate_module::Entry;

use slate_composition::link::Filter;

use super::{
    Conversion, Conversions, ConvertedSource, EntryPorts, Group, InputPort, Inputs, QueueGauge, QueuePort,
    Wire,
};

/// What a module's ports read and send to. It is exchanged between two steps, so a step sees all of a change or nothing.
#[derive(Default)]
pub struct Wiring {
    /// In the order of the groups, each with its reader; none where the port goes on with the one that it has.
    pub inputs: Vec<(InputPort, Option<Latest>)>,
    /// In the order of the groups.
    pub sources: Vec<SourceWiring>,
    /// Which inputs are pinned together.
    pub groups: Vec<Group>,
    /// What is pinned when a cycle begins.
    pub early: Vec<Group>,
    /// Queue inputs.
    pub queues: Vec<QueueWiring>,
    /// Outboxes.
    pub outboxes: Vec<OutboxWiring>,
    /// What links fill that do not fit as they are.
    pub conversions: Vec<ConversionWiring>,
    /// The reader of `enabled`, if it is another one, and whether another module switches this one.
    pub switch: Option<(Latest, bool)>,
}

impl Wiring {
    /// Whether something of it is pinned when a cycle begins.
    pub fn is_early(&self) -> bool {
        !self.early.is_empty() || self.queues.iter().any(|queue| queue.is_early)
    }
}

/// What a queue input reads.
pub struct QueueWiring {
    /// Its slot in the frame.
    pub slot: usize,
    /// Whether news trigger a step.
    pub triggers: bool,
    /// None where the port goes on with the one that it has, and its cursor.
    pub reader: Option<QueueReader>,
    /// How many entries there may be.
    pub window: usize,
    /// Which values it gets, if not all.
    pub filter: Option<Arc<Filter>>,
    /// Whether its values are taken when a cycle begins.
    pub is_early: bool,
    /// How it keeps up.
    pub gauge: Arc<QueueGauge>,
    /// What is logged when it reads no more.
    pub farewell: Box<str>,
}

/// What an outbox sends to.
pub struct OutboxWiring {
    /// Its slot in the frame.
    pub slot: usize,
    /// Where messages go.
    pub sender: Option<Sender>,
    /// Wakes the receiver.
    pub wake: Option<Arc<Wake>>,
}

/// What links fill that do not fit as they are.
pub enum ConversionWiring {
    /// As it is.
    Same(Wire),
    /// Another one; without a writer, it goes on with the one that it has.
    New(Conversion),
}

/// A source of a conversion.
pub struct SourceWiring {
    /// What it fills.
    pub wire: Wire,
    /// Its reader and what it comes to; none where the conversion is the same.
    pub source: Option<(Latest, ConvertedSource)>,
    /// Its place in the conversion that it has.
    pub ordinal: usize,
}

/// Handles that are no longer used; dropping them takes locks, and so is not for the loop.
#[derive(Default)]
pub struct Unwired {
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
unsafe impl Send for Unwired {}

/// How often inputs that belong together are pinned when they are linked: a commit of their writer takes microseconds.
const FIRST_PIN_TRIES: u32 = 10_000;

/// What of a [`Wiring`] fills inputs.
pub(super) struct InputWiring {
    pub inputs: Vec<(InputPort, Option<Latest>)>,
    pub sources: Vec<SourceWiring>,
    pub groups: Vec<Group>,
    pub early: Vec<Group>,
    pub conversions: Vec<ConversionWiring>,
}

impl Inputs {
    /// Goes on with other readers.
    pub(super) fn rewire(&mut self, wiring: InputWiring, unwired: &mut Unwired) {
        let InputWiring { inputs, sources, groups, early, conversions } = wiring;
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
        unwired.readers.extend(old.into_iter().map(|(_, reader)| reader));
        self.conversions.rewire(conversions, sources, &self.ports, unwired);
        (self.groups, self.early) = (groups, early);
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
        unwired: &mut Unwired,
    ) {
        let mut old = std::mem::take(&mut self.all);
        let mut readers: Vec<Option<Latest>> =
            std::mem::take(&mut self.sources).into_iter().map(Some).collect();
        for conversion in conversions {
            let known = |old: &[Conversion], wire| old.iter().position(|other| other.wire == wire);
            match conversion {
                ConversionWiring::Same(wire) => {
                    if let Some(at) = known(&old, wire) {
                        self.all.push(old.swap_remove(at));
                    }
                }
                ConversionWiring::New(mut new) => {
                    if new.writer.is_none()
                        && let Some(at) = known(&old, new.wire)
                    {
                        new.writer = std::mem::take::<Option<Writer>>(&mut old[at].writer);
                    }
                    self.all.push(new);
                }
            }
        }
        for SourceWiring { wire, source, ordinal } in sources {
            let Some(conversion) = self.all.iter_mut().find(|other| other.wire == wire) else {
                continue;
            };
            let place = self.sources.len();
            match source {
                Some((reader, source)) => {
                    self.sources.push(reader);
                    conversion.sources.push(ConvertedSource { reader: place, ..source });
                }
                None => {
                    let Some(source) = conversion.sources.get_mut(ordinal) else { continue };
                    let Some(reader) = readers.get_mut(source.reader).and_then(Option::take) else {
                        continue;
                    };
                    self.sources.push(reader);
                    source.reader = place;
                }
            }
        }
        for conversion in &mut self.all {
            let own = inputs.iter().position(|input| Wire::Port(input.slot as usize) == conversion.wire);
            conversion.reader = own.unwrap_or(0);
        }
        unwired.readers.extend(readers.into_iter().flatten());
        unwired.conversions = old;
    }
}

impl EntryPorts {
    /// Goes on with other readers and senders.
    pub(super) fn rewire(
        &mut self,
        queues: Vec<QueueWiring>,
        outboxes: Vec<OutboxWiring>,
        unwired: &mut Unwired,
    ) {
        let mut old = std::mem::take(&mut self.queues);
        for QueueWiring { slot, triggers, reader, window, filter, is_early, gauge, farewell } in queues {
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
                        is_early,
                        gauge,
                        farewell,
                        is_evicted,
                    });
                }
                (None, Some(at)) => self.queues.push(old.swap_remove(at)),
                (None, None) => {}
            }
        }
        unwired.queues = old;
        for OutboxWiring { slot, sender, wake } in outboxes {
            if let Some(port) = self.outboxes.iter_mut().find(|port| port.slot == slot) {
                port.wake = wake;
                unwired.senders.extend(port.turn_to(sender));
            }
        }
    }
}
