//! State of a module's runner between two ticks, for a snapshot.
//! It has all that the runner knows beside the instance.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use slate_blackboard::channel::Cursor;
use slate_blackboard::{Board, BoardError, bytes};
use slate_module::{PortDescription, Random};

use super::{Conversions, EntryPorts, Inputs, Measured, Runner, Wire};
use crate::{FrozenMailbox, FrozenProperty};

/// State of a runner; its ports are named.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrozenRunner {
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
    pub inputs: BTreeMap<String, FrozenInput>,
    /// Cursors of queues by port.
    pub queues: BTreeMap<String, Cursor>,
    /// Messages that wait, by port.
    pub inboxes: BTreeMap<String, FrozenMailbox>,
    /// Indices of outputs in the order of all, for the digest.
    pub outputs: BTreeMap<String, u32>,
    /// Outboxes by port.
    pub outboxes: BTreeMap<String, FrozenOutbox>,
    /// True if links have changed since the last step.
    pub rewired: bool,
    /// Conversions of links that do not fit the port directly.
    pub conversions: BTreeMap<String, FrozenConversion>,
}

/// State of an input.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct FrozenInput {
    /// Cursor of the pinned value.
    pub cursor: u64,
    /// Sequence and generation of the value that the last tick saw.
    pub seen: (u64, u64),
    pub missed: u64,
}

/// State of a conversion.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrozenConversion {
    #[serde(with = "bytes")]
    pub value: Vec<u8>,
    pub unwritten: bool,
    pub sources: Vec<FrozenSource>,
}

/// State of a source of a conversion.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct FrozenSource {
    pub cursor: u64,
    pub seen: (u64, u64),
    pub time: Option<u64>,
    pub is_missing: bool,
}

/// State of an outbox.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrozenOutbox {
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
    pub fn freeze(&self, ports: &[PortDescription]) -> FrozenRunner {
        let (on, enabled) = self.switch.freeze();
        let (last_tick, due, rewired) = self.schedule.freeze();
        let outputs = self.outputs.ports.iter();
        let mut frozen = FrozenRunner {
            on,
            enabled,
            last_tick,
            due,
            rewired,
            number: self.frame.number(),
            params_version: self.frame.frame.params_version,
            params: self.params.cursor(),
            random: self.frame.random(),
            measured: self.timing.freeze(),
            inputs: self.inputs.freeze(ports),
            outputs: outputs.map(|output| (ports[output.slot].name.clone(), output.index)).collect(),
            conversions: self.inputs.conversions.freeze(ports),
            condition: None,
            ticks: 0,
            panics: 0,
            panics_in_a_row: 0,
            last_panic: 0,
            misses: 0,
            queues: BTreeMap::new(),
            inboxes: BTreeMap::new(),
            outboxes: BTreeMap::new(),
        };
        self.status.freeze(&mut frozen);
        self.entries.freeze(ports, &mut frozen);
        frozen
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
    pub fn thaw_written(
        &mut self,
        board: &Board,
        properties: &BTreeMap<String, FrozenProperty>,
    ) -> Result<(), BoardError> {
        for output in &mut self.outputs.ports {
            if let Some(frozen) = properties.get(output.property.path()) {
                output.property.thaw(&frozen.values, Some(&mut output.writer))?;
            }
        }
        for conversion in &mut self.inputs.conversions.all {
            if let (Some(frozen), Some(writer)) =
                (properties.get(conversion.property.path()), conversion.writer.as_mut())
            {
                conversion.property.thaw(&frozen.values, Some(writer))?;
            }
        }
        let process = self.supervised.as_mut().map(|supervised| ("process", &mut supervised.process));
        let own = [("state", self.status.writer()), ("timing", self.timing.writer())];
        for (own, writer) in own.into_iter().chain(process) {
            let path = format!("{}/{own}", self.name);
            if let (Some(frozen), Some((property, _))) = (properties.get(&path), board.get(&path)) {
                property.thaw(&frozen.values, Some(writer))?;
            }
        }
        Ok(())
    }

    /// Restores the runner; all properties must have been restored.
    pub fn thaw(&mut self, ports: &[PortDescription], frozen: &FrozenRunner) {
        self.status.thaw(frozen);
        self.switch.thaw(frozen.on, frozen.enabled);
        self.params.resume(frozen.params);
        self.schedule.thaw(frozen.last_tick, frozen.due, frozen.rewired);
        self.frame.thaw(frozen.number, frozen.params_version, frozen.random);
        self.timing.thaw(&frozen.measured);
        self.inputs.thaw(ports, &frozen.inputs);
        self.entries.thaw(ports, frozen);
        for output in &mut self.outputs.ports {
            output.index = frozen.outputs.get(&ports[output.slot].name).copied().unwrap_or(output.index);
        }
        self.inputs.conversions.thaw(ports, &frozen.conversions);
    }
}

impl Inputs {
    fn freeze(&self, ports: &[PortDescription]) -> BTreeMap<String, FrozenInput> {
        let inputs = self.ports.iter().zip(&self.readers).map(|(input, reader)| {
            let frozen = FrozenInput { cursor: reader.cursor(), seen: input.seen, missed: input.missed };
            (ports[input.slot as usize].name.clone(), frozen)
        });
        inputs.collect()
    }

    fn thaw(&mut self, ports: &[PortDescription], frozen: &BTreeMap<String, FrozenInput>) {
        for (input, reader) in self.ports.iter_mut().zip(&mut self.readers) {
            if let Some(frozen) = frozen.get(&ports[input.slot as usize].name) {
                (input.seen, input.missed) = (frozen.seen, frozen.missed);
                reader.resume(frozen.cursor);
            }
        }
    }
}

impl Conversions {
    fn freeze(&self, ports: &[PortDescription]) -> BTreeMap<String, FrozenConversion> {
        let all = self.all.iter().map(|conversion| {
            let sources = conversion.sources.iter().map(|source| FrozenSource {
                cursor: self.sources[source.reader].cursor(),
                seen: source.seen,
                time: source.time,
                is_missing: source.is_missing,
            });
            let value = conversion.value.bytes(conversion.bytes).to_vec();
            let (unwritten, sources) = (conversion.unwritten, sources.collect());
            (wire_name(conversion.wire, ports), FrozenConversion { value, unwritten, sources })
        });
        all.collect()
    }

    fn thaw(&mut self, ports: &[PortDescription], frozen: &BTreeMap<String, FrozenConversion>) {
        for conversion in &mut self.all {
            let Some(frozen) = frozen.get(&wire_name(conversion.wire, ports)) else { continue };
            let value = conversion.value.bytes_mut(conversion.bytes);
            if value.len() == frozen.value.len() {
                value.copy_from_slice(&frozen.value);
            }
            conversion.unwritten = frozen.unwritten;
            for (source, frozen) in conversion.sources.iter_mut().zip(&frozen.sources) {
                (source.seen, source.time) = (frozen.seen, frozen.time);
                source.is_missing = frozen.is_missing;
                self.sources[source.reader].resume(frozen.cursor);
            }
        }
    }
}

impl EntryPorts {
    fn freeze(&self, ports: &[PortDescription], frozen: &mut FrozenRunner) {
        let name = |slot: usize| ports[slot].name.clone();
        frozen.queues = self.queues.iter().map(|queue| (name(queue.slot), queue.reader.cursor())).collect();
        let inboxes = self.inboxes.iter().map(|inbox| {
            let (sequence, messages) = (inbox.receiver.sequence(), inbox.receiver.waiting());
            (name(inbox.slot), FrozenMailbox { sequence, messages })
        });
        frozen.inboxes = inboxes.collect();
        let outboxes = self.outboxes.iter().map(|outbox| {
            let own = FrozenOutbox {
                index: outbox.index,
                refused: outbox.refused,
                sent: outbox.sent,
                deliveries: outbox.deliveries(),
                sender: outbox.sender.as_ref().map(|sender| sender.id()),
            };
            (name(outbox.slot), own)
        });
        frozen.outboxes = outboxes.collect();
    }

    fn thaw(&mut self, ports: &[PortDescription], frozen: &FrozenRunner) {
        let name = |slot: usize| ports[slot].name.as_str();
        for queue in &mut self.queues {
            queue.entries.clear();
            if let Some(cursor) = frozen.queues.get(name(queue.slot)) {
                queue.reader.resume(*cursor);
            }
        }
        for inbox in &mut self.inboxes {
            inbox.entries.clear();
            let sequence = frozen.inboxes.get(name(inbox.slot)).map(|mailbox| mailbox.sequence);
            inbox.receiver.resume(sequence.unwrap_or(0));
        }
        for outbox in &mut self.outboxes {
            if let Some(frozen) = frozen.outboxes.get(name(outbox.slot)) {
                (outbox.index, outbox.refused) = (frozen.index, frozen.refused);
                outbox.resume(frozen.sent, &frozen.deliveries);
            }
        }
    }
}

/// Returns the name of a link's target in a snapshot.
fn wire_name(wire: Wire, ports: &[PortDescription]) -> String {
    match wire {
        Wire::Port(slot) => ports[slot].name.clone(),
        Wire::Enabled => "enabled".into(),
        Wire::Params => "params".into(),
    }
}
