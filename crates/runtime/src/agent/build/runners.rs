//! The runners of all modules, with their handles and instances.

use std::cell::Cell;
use std::sync::Arc;

use slate_blackboard::channel::{Budget, Policy, Start, Writer};
use slate_blackboard::commit::CommitWord;
use slate_blackboard::interface::{Descriptor, FloatMap};
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Carrier, Property, Stamp, Store};
use slate_module::{Direction, Entry, Frame, Interface, PortDescription, PortSlot, Random, Setup, Trigger};

use super::{Builder, PortProperties, SPARE_READERS, new_writer};
use crate::actuators::Actuator;
use crate::agent::survey::{Target, Wire};
use crate::log::Logger;
use crate::runner::{
    Group, Health, InboxPort, InputPort, Measured, Memory, ModuleState, ModuleTiming, OutboxPort, OutputPort,
    QueuePort, Runner,
};

impl Builder<'_, '_> {
    pub(super) fn runners(
        &mut self,
        properties: &PortProperties,
        actuators: &[Arc<Actuator>],
        logger: &Logger,
        lockstep: bool,
    ) -> Vec<Runner> {
        let largest = self
            .survey
            .modules
            .iter()
            .flat_map(|m| &m.description.ports)
            .map(|port| port.descriptor.size)
            .max();
        let zeros = Arc::new(Memory::zeroed(largest.unwrap_or(0)));
        let health: Vec<_> = self.survey.modules.iter().map(|_| Arc::new(Health::new())).collect();
        let commits: Vec<_> = self.survey.modules.iter().map(|_| CommitWord::new()).collect();
        let wakes: Vec<_> = self.survey.modules.iter().map(|_| Arc::new(Wake::new())).collect();
        let mut runners = Vec::new();
        for m in 0..self.survey.modules.len() {
            let parts = Parts {
                properties,
                actuators,
                zeros: &zeros,
                health: &health,
                commits: &commits,
                wakes: &wakes,
            };
            match self.runner(m, &parts, logger, lockstep) {
                Some(runner) => runners.push(runner),
                None if self.complaints.diagnostics.is_empty() => {
                    let span = self.survey.modules[m].module.name.span;
                    self.complaints.add(
                        span,
                        format!("`{}` can't get its handles", self.name(m)),
                        "the agent's logger or a reader budget is exhausted",
                    );
                }
                None => {}
            }
        }
        runners
    }

    fn runner(&mut self, m: usize, parts: &Parts<'_>, logger: &Logger, lockstep: bool) -> Option<Runner> {
        let surveyed = &self.survey.modules[m];
        let name: Arc<str> = Arc::from(surveyed.module.name.value.as_str());
        let log = logger.module(&name, lockstep)?;
        let host = Box::new(log.host());
        let random = Box::new(Cell::new(Random::new(self.configuration.seed().value, &name)));
        let triggers = |port: &PortDescription| match &surveyed.trigger {
            Trigger::On { ports, .. } => ports.contains(&port.name),
            Trigger::Stage | Trigger::Every(_) => false,
        };
        let slots: Box<[PortSlot]> =
            surveyed.description.ports.iter().map(|port| empty_slot(port, parts.zeros)).collect();
        let params = self.board.find(&format!("{name}/params")).ok()?.0.channel()?.latest().ok()?;
        let enabled = self.board.find(&format!("{name}/enabled")).ok()?.0.channel()?.latest().ok()?;
        let state = self.implied_writer(m, "state", "How the module is.", ModuleState::DESCRIPTOR)?;
        let timing =
            self.implied_writer(m, "timing", "How long its ticks take.", ModuleTiming::DESCRIPTOR)?;
        let frame = Box::new(Frame {
            ports: slots.as_ptr(),
            port_count: slots.len(),
            params: parts.zeros.as_ptr(),
            params_size: surveyed.description.params.size,
            params_version: 0,
            now: 0,
            elapsed: 0,
            number: 0,
            random: &raw const *random,
            host: &raw const *host,
        });
        let setup_name = name.to_string();
        let (seed, period) = (self.configuration.seed().value, self.configuration.period().value);
        let (section, bytes, kind) =
            (surveyed.section.clone(), surveyed.params.clone(), surveyed.kind.clone());
        let create = move || {
            kind.create(&Setup { name: &setup_name, seed, period, section: section.as_ref() }, &bytes)
        };
        let mut runner = Runner {
            name,
            kind: surveyed.kind.clone(),
            trigger: surveyed.trigger.clone(),
            deadline: surveyed.deadline,
            health: Arc::clone(&parts.health[m]),
            inputs: Vec::new(),
            readers: Vec::new(),
            groups: Vec::new(),
            queues: Vec::new(),
            inboxes: Vec::new(),
            outputs: Vec::new(),
            outboxes: Vec::new(),
            params,
            enabled,
            on: true,
            state,
            timing,
            measured: Measured::default(),
            commit: parts.commits[m].clone(),
            wake: Arc::clone(&parts.wakes[m]),
            log,
            instance: std::ptr::null_mut(),
            create: Box::new(create),
            frame,
            slots,
            random,
            host,
            zeros: Arc::clone(parts.zeros),
            last_tick: 0,
            due: 0,
            panics: 0,
        };
        self.inputs(m, &mut runner, parts, &triggers)?;
        for (p, port) in surveyed.description.ports.iter().enumerate() {
            match port.direction {
                Direction::Input => {}
                Direction::Queue => {
                    let property = self.source(m, p, parts)?.0;
                    let reader = property.channel()?.queue(Policy::Skip, Start::Next).ok()?;
                    runner.queues.push(QueuePort {
                        slot: p,
                        triggers: triggers(port),
                        reader,
                        entries: Vec::with_capacity(port.window.max(16)),
                    });
                }
                Direction::Inbox => {
                    let Carrier::Mailbox(mailbox) = parts.properties[m][p].as_ref()?.carrier() else {
                        return None;
                    };
                    let receiver = mailbox.receiver().ok()?;
                    let entries = Vec::with_capacity(receiver.capacity());
                    runner.inboxes.push(InboxPort { slot: p, triggers: triggers(port), receiver, entries });
                }
                Direction::Output | Direction::Debug | Direction::Command => {
                    let output = self.output(m, p, port, parts)?;
                    runner.outputs.push(output);
                }
                Direction::Outbox => {
                    let outbox = self.outbox(m, p, port, parts)?;
                    let slot = &mut runner.slots[p];
                    slot.entries = outbox.entries.as_ptr();
                    slot.capacity = outbox.entries.len();
                    runner.outboxes.push(outbox);
                }
            }
        }
        match (runner.create)() {
            Ok(instance) => runner.instance = instance,
            Err(refusal) => {
                let message = format!("`{}` can't be set up: {refusal}", runner.name);
                self.complaints.add(
                    surveyed.module.name.span,
                    message,
                    "mend its parameters or what it is set up from",
                );
                return None;
            }
        }
        Some(runner)
    }

    /// The writer of a property that every module has.
    fn implied_writer(
        &mut self,
        m: usize,
        name: &str,
        doc: &str,
        descriptor: &'static Descriptor,
    ) -> Option<Writer> {
        let path = format!("{}/{name}", self.name(m));
        let budget = Budget { latest: SPARE_READERS, queues: 1, window: 1 };
        let added = self.board.add_channel(
            &path,
            doc,
            descriptor,
            Store { capacity: 0, depth: 1, budget },
            Access::Output,
        );
        new_writer(&*self.added(m, added).ok()?)
    }

    /// The property that an input reads, and the module that writes it.
    fn source(&self, m: usize, p: usize, parts: &Parts<'_>) -> Option<(Arc<Property>, Option<usize>)> {
        match self.joint(m, Wire::Port(p)).map(|joint| joint.target) {
            Some(Target::Port(module, port)) => {
                Some((Arc::clone(parts.properties[module][port].as_ref()?), Some(module)))
            }
            Some(Target::Command(actuator)) => Some((Arc::clone(&parts.actuators[actuator].command), None)),
            None => Some((Arc::clone(parts.properties[m][p].as_ref()?), None)),
        }
    }

    fn inputs(
        &self,
        m: usize,
        runner: &mut Runner,
        parts: &Parts<'_>,
        triggers: &dyn Fn(&PortDescription) -> bool,
    ) -> Option<()> {
        let ports = &self.survey.modules[m].description.ports;
        let mut sources = Vec::new();
        for (p, port) in ports.iter().enumerate().filter(|(_, port)| port.direction == Direction::Input) {
            let (property, writer) = self.source(m, p, parts)?;
            sources.push((writer, p, port, property));
        }
        // Inputs of one writer stand together, so that they can be pinned in one go.
        sources.sort_by_key(|(writer, p, ..)| (*writer, *p));
        let mut last = None;
        for (writer, p, port, property) in sources {
            let reader = property.channel()?.latest().ok()?;
            let stale = self
                .joint(m, Wire::Port(p))
                .and_then(|joint| joint.link.stale.as_ref())
                .map(|stale| stale.value);
            let at = runner.readers.len();
            match (writer, last) {
                (Some(writer), Some(before)) if writer == before => {
                    if let Some(group) = runner.groups.last_mut() {
                        group.end = at + 1;
                    }
                }
                _ => {
                    let word = writer.map_or_else(CommitWord::new, |writer| parts.commits[writer].clone());
                    runner.groups.push(Group { word, first: at, end: at + 1 });
                }
            }
            last = writer;
            runner.readers.push(reader);
            runner.inputs.push(InputPort {
                slot: p,
                stale_after: stale.or(port.stale_after),
                triggers: triggers(port),
                writer: writer.map(|writer| Arc::clone(&parts.health[writer])),
                seen: (0, 0),
                missed: 0,
            });
        }
        Some(())
    }

    fn output(
        &mut self,
        m: usize,
        p: usize,
        port: &PortDescription,
        parts: &Parts<'_>,
    ) -> Option<OutputPort> {
        let property = Arc::clone(parts.properties[m][p].as_ref()?);
        let writer = new_writer(&property)?;
        self.index += 1;
        let path = property.path();
        let actuator = self.configuration.actuators().iter().enumerate().find_map(|(a, wanted)| {
            let place = wanted.commands.iter().position(|url| url.value.path_in("") == path)?;
            Some((Arc::clone(&parts.actuators[a]), place as u32 + 1))
        });
        for joint in self.survey.joints.iter() {
            if let (Target::Command(a), Some((own, _))) = (joint.target, &actuator)
                && Arc::ptr_eq(own, &parts.actuators[a])
            {
                own.wakes(Arc::clone(&parts.wakes[joint.port.0]));
            }
        }
        let wakes =
            self.readers(Target::Port(m, p)).map(|joint| Arc::clone(&parts.wakes[joint.port.0])).collect();
        Some(OutputPort {
            slot: p,
            shape: property.channel()?.shape(),
            property,
            index: self.index,
            writer,
            floats: FloatMap::new(port.descriptor),
            debug: port.direction == Direction::Debug,
            safe: port.safe.clone().map(Vec::into_boxed_slice),
            actuator,
            wakes,
            aside: None,
        })
    }

    fn outbox(
        &mut self,
        m: usize,
        p: usize,
        port: &PortDescription,
        parts: &Parts<'_>,
    ) -> Option<OutboxPort> {
        self.index += 1;
        let target = self.joint(m, Wire::Port(p)).map(|joint| joint.target);
        let (sender, wake) = match target {
            Some(Target::Port(module, inbox)) => {
                let Carrier::Mailbox(mailbox) = parts.properties[module][inbox].as_ref()?.carrier() else {
                    return None;
                };
                (Some(mailbox.sender().ok()?), Some(Arc::clone(&parts.wakes[module])))
            }
            _ => (None, None),
        };
        let mut memory: Vec<_> = (0..port.window).map(|_| Memory::zeroed(port.descriptor.size)).collect();
        let entries = memory
            .iter_mut()
            .map(|memory| Entry {
                data: memory.as_mut_ptr(),
                items: Cell::new(0),
                stamp: Stamp::default(),
                answer: Cell::new(0),
                sender: 0,
            })
            .collect();
        Some(OutboxPort {
            slot: p,
            sender,
            memory,
            entries,
            size: port.descriptor.size,
            index: self.index,
            wake,
            refused: 0,
        })
    }
}

/// What runners share.
struct Parts<'p> {
    properties: &'p PortProperties,
    actuators: &'p [Arc<Actuator>],
    zeros: &'p Arc<Memory>,
    health: &'p [Arc<Health>],
    commits: &'p [CommitWord],
    wakes: &'p [Arc<Wake>],
}

fn empty_slot(port: &PortDescription, zeros: &Memory) -> PortSlot {
    PortSlot {
        schema: port.descriptor.hash,
        direction: port.direction as u32,
        data: zeros.as_ptr().cast_mut(),
        items: Cell::new(0),
        capacity: port.capacity,
        stamp: Stamp::default(),
        flags: Cell::new(0),
        priority: Cell::new(0),
        entries: std::ptr::null(),
        count: Cell::new(0),
        missed: 0,
    }
}
