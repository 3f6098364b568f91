//! State of a module's runner between two ticks, for a snapshot.
//! It has all that the runner knows beside the instance.

use serde::{Deserialize, Serialize};
use slate_blackboard::channel::Cursor;
use slate_blackboard::{Board, BoardError, bytes};
use slate_module::{PortDescription, Random};
use slate_sorted::SortedMap;

use super::{Conversions, EntryPorts, Inputs, LinkEnd, Measured, Runner};
use crate::{MailboxSnapshot, PropertySnapshot};

/// State of a runner; its ports are named.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunnerSnapshot {
    /// Condition of the module, as a number.
    pub condition: Option<u8>,
    /// Last value of its switch.
    pub on: bool,
    /// Time of the last tick.
    pub last_tick: u64,
    /// Time of the next tick, ns, if it has a period.
    pub due: u64,
    /// Ticks made, and those that began.
    pub number: u64,
    /// Ticks that were made.
    pub ticks: u64,
    /// Number of changes of its parameters.
    pub params_version: u64,
    /// Cursor of the parameters.
    pub params: u64,
    /// Cursor of `enabled`.
    pub enabled: u64,
    /// Random stream.
    pub random: Random,
    /// Measurements.
    pub measured: Measured,
    /// Panics so far.
    pub panics: u32,
    /// Panics without many ticks between them.
    pub panics_in_a_row: u32,
    /// Tick of the last panic.
    pub last_panic: u64,
    /// Missed deadlines.
    pub misses: u64,
    /// Inputs by port.
    pub inputs: SortedMap<String, InputSnapshot>,
    /// Cursors of queues by port.
    pub queues: SortedMap<String, Cursor>,
    /// Messages that wait, by port.
    pub inboxes: SortedMap<String, MailboxSnapshot>,
    /// Indices of outputs in the order of all, for the digest.
    pub outputs: SortedMap<String, u32>,
    /// Outboxes by port.
    pub outboxes: SortedMap<String, OutboxSnapshot>,
    /// True if links have changed since the last step.
    pub rewired: bool,
    /// Conversions of links that do not fit the port directly.
    pub conversions: SortedMap<String, ConversionSnapshot>,
}

/// State of an input.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct InputSnapshot {
    /// Cursor of the pinned value.
    pub cursor: u64,
    /// Sequence and generation of the value that the last tick saw.
    pub seen: (u64, u64),
    pub missed: u64,
}

/// State of a conversion.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ConversionSnapshot {
    #[serde(with = "bytes")]
    pub value: Vec<u8>,
    pub unwritten: bool,
    pub sources: Vec<SourceSnapshot>,
}

/// State of a source of a conversion.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct SourceSnapshot {
    pub cursor: u64,
    pub seen: (u64, u64),
    pub time: Option<u64>,
    pub is_missing: bool,
}

/// State of an outbox.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OutboxSnapshot {
    pub index: u32,
    pub refused: u64,
    /// Number of messages sent.
    #[serde(default)]
    pub sent: u64,
    /// Delivery states of the remembered messages, by their numbers.
    #[serde(default)]
    pub deliveries: Vec<(u64, u32)>,
    /// Number under which it sends.
    pub sender: Option<u32>,
}

impl Runner {
    /// Returns the state of the runner while the module is in no step.
    pub fn snapshot(&self, ports: &[PortDescription]) -> RunnerSnapshot {
        let (on, enabled) = self.switch.snapshot();
        let (last_tick, due, rewired) = self.schedule.snapshot();
        let outputs = self.outputs.ports.iter();
        let mut saved = RunnerSnapshot {
            on,
            enabled,
            last_tick,
            due,
            rewired,
            number: self.frame.number(),
            params_version: self.frame.frame.params_version,
            params: self.params.cursor(),
            random: self.frame.random(),
            measured: self.timing.snapshot(),
            inputs: self.inputs.snapshot(ports),
            outputs: outputs.map(|output| (ports[output.slot].name.clone(), output.index)).collect(),
            conversions: self.inputs.conversions.snapshot(ports),
            condition: None,
            ticks: 0,
            panics: 0,
            panics_in_a_row: 0,
            last_panic: 0,
            misses: 0,
            queues: SortedMap::new(),
            inboxes: SortedMap::new(),
            outboxes: SortedMap::new(),
        };
        self.status.snapshot(&mut saved);
        self.entries.snapshot(ports, &mut saved);
        saved
    }

    /// Returns the paths of the properties that this runner writes.
    pub fn written(&self) -> impl Iterator<Item = String> {
        let own = ["state", "timing"].into_iter().chain(self.supervised.as_ref().map(|_| "process"));
        let outputs = self.outputs.ports.iter().map(|output| output.property.path().to_owned());
        let conversions = self.inputs.conversions.all.iter();
        let converted = conversions.filter(|conversion| conversion.writer.is_some());
        let converted = converted.map(|conversion| conversion.property.path().to_owned());
        own.map(|own| format!("{}/{own}", self.name)).chain(outputs).chain(converted)
    }

    /// Restores the values of the properties that it writes.
    ///
    /// # Errors
    /// A value that does not fit, which was excluded before.
    pub fn restore_written(
        &mut self,
        board: &Board,
        properties: &SortedMap<String, PropertySnapshot>,
    ) -> Result<(), BoardError> {
        for output in &mut self.outputs.ports {
            if let Some(saved) = properties.get(output.property.path()) {
                output.property.restore(&saved.values, Some(&mut output.writer))?;
            }
        }
        for conversion in &mut self.inputs.conversions.all {
            if let (Some(saved), Some(writer)) =
                (properties.get(conversion.property.path()), conversion.writer.as_mut())
            {
                conversion.property.restore(&saved.values, Some(writer))?;
            }
        }
        let process = self.supervised.as_mut().map(|supervised| ("process", &mut supervised.process));
        let own = [("state", self.status.writer()), ("timing", self.timing.writer())];
        for (own, writer) in own.into_iter().chain(process) {
            let path = format!("{}/{own}", self.name);
            if let (Some(saved), Some((property, _))) = (properties.get(&path), board.get(&path)) {
                property.restore(&saved.values, Some(writer))?;
            }
        }
        Ok(())
    }

    /// Restores the runner; all properties must have been restored.
    pub fn restore_snapshot(&mut self, ports: &[PortDescription], saved: &RunnerSnapshot) {
        self.status.restore(saved);
        self.switch.restore(saved.on, saved.enabled);
        self.params.resume(saved.params);
        self.schedule.restore(saved.last_tick, saved.due, saved.rewired);
        self.frame.restore(saved.number, saved.params_version, saved.random);
        self.timing.restore(&saved.measured);
        self.inputs.restore(ports, &saved.inputs);
        self.entries.restore(ports, saved);
        for output in &mut self.outputs.ports {
            output.index = saved.outputs.get(&ports[output.slot].name).copied().unwrap_or(output.index);
        }
        self.inputs.conversions.restore(ports, &saved.conversions);
    }
}

impl Inputs {
    fn snapshot(&self, ports: &[PortDescription]) -> SortedMap<String, InputSnapshot> {
        let inputs = self.ports.iter().zip(&self.readers).map(|(input, reader)| {
            let saved = InputSnapshot { cursor: reader.cursor(), seen: input.seen, missed: input.missed };
            (ports[input.slot as usize].name.clone(), saved)
        });
        inputs.collect()
    }

    fn restore(&mut self, ports: &[PortDescription], saved: &SortedMap<String, InputSnapshot>) {
        for (input, reader) in self.ports.iter_mut().zip(&mut self.readers) {
            if let Some(saved) = saved.get(&ports[input.slot as usize].name) {
                (input.seen, input.missed) = (saved.seen, saved.missed);
                reader.resume(saved.cursor);
            }
        }
    }
}

impl Conversions {
    fn snapshot(&self, ports: &[PortDescription]) -> SortedMap<String, ConversionSnapshot> {
        let all = self.all.iter().map(|conversion| {
            let sources = conversion.sources.iter().map(|source| SourceSnapshot {
                cursor: self.sources[source.reader].cursor(),
                seen: source.seen,
                time: source.time,
                is_missing: source.is_missing,
            });
            let value = conversion.value.bytes(conversion.bytes).to_vec();
            let (unwritten, sources) = (conversion.unwritten, sources.collect());
            (end_name(conversion.link_end, ports), ConversionSnapshot { value, unwritten, sources })
        });
        all.collect()
    }

    fn restore(&mut self, ports: &[PortDescription], saved: &SortedMap<String, ConversionSnapshot>) {
        for conversion in &mut self.all {
            let Some(saved) = saved.get(&end_name(conversion.link_end, ports)) else { continue };
            let value = conversion.value.bytes_mut(conversion.bytes);
            if value.len() == saved.value.len() {
                value.copy_from_slice(&saved.value);
            }
            conversion.unwritten = saved.unwritten;
            for (source, saved) in conversion.sources.iter_mut().zip(&saved.sources) {
                (source.seen, source.time) = (saved.seen, saved.time);
                source.is_missing = saved.is_missing;
                self.sources[source.reader].resume(saved.cursor);
            }
        }
    }
}

impl EntryPorts {
    fn snapshot(&self, ports: &[PortDescription], saved: &mut RunnerSnapshot) {
        let name = |slot: usize| ports[slot].name.clone();
        saved.queues = self.queues.iter().map(|queue| (name(queue.slot), queue.reader.cursor())).collect();
        let inboxes = self.inboxes.iter().map(|inbox| {
            let (sequence, messages) = (inbox.receiver.sequence(), inbox.receiver.waiting());
            (name(inbox.slot), MailboxSnapshot { sequence, messages })
        });
        saved.inboxes = inboxes.collect();
        let outboxes = self.outboxes.iter().map(|outbox| {
            let own = OutboxSnapshot {
                index: outbox.index,
                refused: outbox.refused,
                sent: outbox.sent,
                deliveries: outbox.deliveries(),
                sender: outbox.sender.as_ref().map(|sender| sender.id()),
            };
            (name(outbox.slot), own)
        });
        saved.outboxes = outboxes.collect();
    }

    fn restore(&mut self, ports: &[PortDescription], saved: &RunnerSnapshot) {
        let name = |slot: usize| ports[slot].name.as_str();
        for queue in &mut self.queues {
            queue.entries.clear();
            if let Some(cursor) = saved.queues.get(name(queue.slot)) {
                queue.reader.resume(*cursor);
            }
        }
        for inbox in &mut self.inboxes {
            inbox.entries.clear();
            let sequence = saved.inboxes.get(name(inbox.slot)).map(|mailbox| mailbox.sequence);
            inbox.receiver.resume(sequence.unwrap_or(0));
        }
        for outbox in &mut self.outboxes {
            if let Some(saved) = saved.outboxes.get(name(outbox.slot)) {
                (outbox.index, outbox.refused) = (saved.index, saved.refused);
                outbox.resume(saved.sent, &saved.deliveries);
            }
        }
    }
}

/// Returns the name of a link's target in a snapshot.
fn end_name(link_end: LinkEnd, ports: &[PortDescription]) -> String {
    match link_end {
        LinkEnd::Port(slot) => ports[slot].name.clone(),
        LinkEnd::Enabled => "enabled".into(),
        LinkEnd::Params => "params".into(),
    }
}
