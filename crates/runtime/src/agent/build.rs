//! Makes what the survey found to be right: properties, links, gates, instances.

use std::cell::Cell;
use std::sync::Arc;

use slate_blackboard::channel::{Budget, Policy, Start, Writer};
use slate_blackboard::commit::CommitWord;
use slate_blackboard::interface::{Descriptor, FloatMap};
use slate_blackboard::message::Mailbox;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, BoardError, Carrier, Property, Stamp};
use slate_module::{
    Direction, Entry, Frame, Interface, Plugin, PortDescription, PortSlot, Random, Setup, Trigger,
};
use slate_safety::{Gate, GateConfiguration, GateState, StopLatch};

use super::parameters::{enabled_descriptor, value_bytes};
use super::survey::{Complaints, Joint, Survey, Surveyed, Target, Wire, survey};
use crate::actuators::Actuator;
use crate::configuration::{self, Configuration, Report};
use crate::log::Logger;
use crate::runner::{
    Group, Health, InboxPort, InputPort, Measured, Memory, ModuleState, ModuleTiming, OutboxPort, OutputPort,
    QueuePort, Runner,
};

/// Reader handles that tools may take beside those of links.
const SPARE_READERS: u16 = 4;

/// What an agent consists of.
pub(super) struct Built {
    pub board: Arc<Board>,
    pub runners: Vec<Runner>,
    /// Per stage, levels of runners.
    pub order: Vec<Vec<Vec<usize>>>,
    /// Whether a runner waits for something or has a period, rather than running in every cycle.
    pub waits: Vec<bool>,
    pub actuators: Vec<Arc<Actuator>>,
}

pub(super) fn build(
    configuration: &Configuration,
    plugins: &[Plugin],
    logger: &Logger,
    lockstep: bool,
    stop: &StopLatch,
) -> Result<Built, Report> {
    let mut complaints = Complaints::new(configuration);
    let survey = survey(configuration, plugins, &mut complaints);
    if !complaints.diagnostics.is_empty() {
        return Err(Report::from(complaints.diagnostics));
    }
    let board = Arc::new(Board::new(configuration.agent_name()));
    let mut builder = Builder { configuration, survey: &survey, board: &board, complaints, index: 0 };
    let Ok(properties) = builder.properties() else {
        return Err(Report::from(builder.complaints.diagnostics));
    };
    let actuators = builder.actuators(stop);
    if !builder.complaints.diagnostics.is_empty() {
        return Err(Report::from(builder.complaints.diagnostics));
    }
    let runners = builder.runners(&properties, &actuators, logger, lockstep);
    if !builder.complaints.diagnostics.is_empty() {
        return Err(Report::from(builder.complaints.diagnostics));
    }
    let waits = survey.modules.iter().map(|module| module.trigger != Trigger::Stage).collect();
    Ok(Built { board, runners, order: survey.order, waits, actuators })
}

struct Builder<'a, 's> {
    configuration: &'a Configuration,
    survey: &'s Survey<'a>,
    board: &'s Arc<Board>,
    complaints: Complaints<'a>,
    /// Counts outputs, for the digest.
    index: u32,
}

/// The properties of a module's ports, by port; nothing for linked inputs and outboxes.
type PortProperties = Vec<Vec<Option<Arc<Property>>>>;

struct Failed;

impl<'a> Builder<'a, '_> {
    fn name(&self, module: usize) -> &'a str {
        &self.survey.modules[module].module.name.value
    }

    fn port(&self, module: usize, port: usize) -> &PortDescription {
        &self.survey.modules[module].description.ports[port]
    }

    /// The link of an input or an outbox.
    fn joint(&self, module: usize, wire: Wire) -> Option<&Joint<'a>> {
        self.survey.joints.iter().find(|joint| joint.port == (module, wire))
    }

    fn added<T>(&mut self, module: usize, result: Result<T, BoardError>) -> Result<T, Failed> {
        result.map_err(|error| {
            let span = self.survey.modules[module].module.name.span;
            self.complaints.add(span, error.to_string(), "rename one of the two");
            Failed
        })
    }

    fn properties(&mut self) -> Result<PortProperties, Failed> {
        let mut result = Vec::new();
        for (m, surveyed) in self.survey.modules.iter().enumerate() {
            let mut ports = Vec::new();
            for (p, port) in surveyed.description.ports.iter().enumerate() {
                let path = format!("{}/{}", surveyed.module.name.value, port.name);
                let property = match port.direction {
                    Direction::Output | Direction::Debug | Direction::Command => {
                        let (depth, budget) = self.demand(Target::Port(m, p));
                        let added = self.board.add_channel(
                            &path,
                            &port.doc,
                            port.descriptor,
                            port.capacity,
                            depth,
                            budget,
                            Access::Output,
                        );
                        Some(self.added(m, added)?)
                    }
                    Direction::Inbox => {
                        let senders = self.readers(Target::Port(m, p)).count() as u16 + SPARE_READERS;
                        let mailbox = Mailbox::new(port.descriptor.shape(0), senders, port.window as u16 * 2);
                        let added = self.board.add_mailbox(&path, &port.doc, port.descriptor, mailbox);
                        Some(self.added(m, added)?)
                    }
                    Direction::Input | Direction::Queue => match self.joint(m, Wire::Port(p)) {
                        Some(joint) => {
                            let target = self.target_path(joint.target);
                            let added = self.board.add_alias(&path, &target);
                            self.added(m, added)?;
                            None
                        }
                        None => Some(self.setting(m, &path, &port.doc, port, surveyed.inputs.get(&p))?),
                    },
                    Direction::Outbox => None,
                };
                ports.push(property);
            }
            self.implied(m, surveyed)?;
            result.push(ports);
        }
        Ok(result)
    }

    /// Parameters and `enabled`.
    fn implied(&mut self, m: usize, surveyed: &Surveyed<'a>) -> Result<(), Failed> {
        let name = &surveyed.module.name.value;
        let budget = Budget { latest: 1 + SPARE_READERS, queues: 1, window: 1 };
        let params = surveyed.description.params;
        let added = self.board.add_channel(
            &format!("{name}/params"),
            "Parameters of the module.",
            params,
            0,
            1,
            budget,
            Access::Setting,
        );
        let property = self.added(m, added)?;
        set_bytes(&property, &surveyed.params);
        let path = format!("{name}/enabled");
        if let Some(joint) = self.joint(m, Wire::Enabled) {
            let target = self.target_path(joint.target);
            let added = self.board.add_alias(&path, &target);
            return self.added(m, added);
        }
        let added = self.board.add_channel(
            &path,
            "Whether the module runs.",
            enabled_descriptor(),
            0,
            1,
            budget,
            Access::Setting,
        );
        let property = self.added(m, added)?;
        set_bytes(&property, &[surveyed.module.enabled.value.into()]);
        Ok(())
    }

    fn setting(
        &mut self,
        m: usize,
        path: &str,
        doc: &str,
        port: &PortDescription,
        value: Option<&Vec<u8>>,
    ) -> Result<Arc<Property>, Failed> {
        let budget = Budget { latest: 1 + SPARE_READERS, queues: 1, window: port.window as u16 };
        let depth = if port.direction == Direction::Queue { port.window * 2 } else { 1 };
        let added =
            self.board.add_channel(path, doc, port.descriptor, port.capacity, depth, budget, Access::Setting);
        let property = self.added(m, added)?;
        if let Some(bytes) = value {
            set_bytes(&property, bytes);
        }
        Ok(property)
    }

    fn target_path(&self, target: Target) -> String {
        match target {
            Target::Port(module, port) => format!("{}/{}", self.name(module), self.port(module, port).name),
            Target::Command(actuator) => {
                format!("{}/command", self.configuration.actuators()[actuator].name.value)
            }
        }
    }

    /// The ports that are linked to a property.
    fn readers(&self, target: Target) -> impl Iterator<Item = &Joint<'a>> {
        self.survey.joints.iter().filter(move |joint| joint.target == target)
    }

    /// How many values a property keeps, and how many readers it serves.
    fn demand(&self, target: Target) -> (usize, Budget) {
        let mut budget = Budget { latest: SPARE_READERS, queues: 1, window: 16 };
        let mut depth = 1;
        for joint in self.readers(target) {
            match joint.port {
                (module, Wire::Port(port)) if self.port(module, port).direction == Direction::Queue => {
                    let window = self.port(module, port).window;
                    depth = depth.max(window * 2);
                    budget.queues += 1;
                    budget.window = budget.window.max(window as u16);
                }
                _ => budget.latest += 1,
            }
        }
        (depth, budget)
    }

    fn actuators(&mut self, stop: &StopLatch) -> Vec<Arc<Actuator>> {
        let mut result = Vec::new();
        for (i, wanted) in self.configuration.actuators().iter().enumerate() {
            match self.actuator(i, wanted, stop) {
                Ok(actuator) => result.push(Arc::new(actuator)),
                Err(Failed) => {}
            }
        }
        result
    }

    /// The command port that a URL of an actuator names.
    fn commander(&self, path: &str) -> Option<(usize, usize)> {
        self.survey.modules.iter().enumerate().find_map(|(m, surveyed)| {
            let rest = path.strip_prefix(surveyed.module.name.value.as_str())?.strip_prefix('/')?;
            let port = surveyed.description.ports.iter().position(|port| port.name == rest)?;
            (surveyed.description.ports[port].direction == Direction::Command).then_some((m, port))
        })
    }

    fn actuator(
        &mut self,
        index: usize,
        wanted: &configuration::Actuator,
        stop: &StopLatch,
    ) -> Result<Actuator, Failed> {
        let name = &wanted.name.value;
        let mut descriptor = None;
        for url in &wanted.commands {
            let path = url.value.path_in("");
            let Some((module, port)) = self.commander(&path) else {
                let help = "name a Command port of a module, such as `r2/execute/wheels`";
                self.complaints.add(url.span, format!("`/{path}` is no command"), help);
                return Err(Failed);
            };
            let own = self.port(module, port).descriptor;
            if descriptor.is_some_and(|first: &Descriptor| first.hash != own.hash) {
                self.complaints.add(
                    url.span,
                    format!("`/{path}` is {}, unlike the first command", own.name),
                    "all commanders of an actuator speak one interface",
                );
                return Err(Failed);
            }
            descriptor = Some(own);
        }
        let Some(descriptor) = descriptor else {
            self.complaints.add(
                wanted.name.span,
                format!("actuator `{name}` has no commander"),
                "say `command = \"robot/execute/wheels\"`",
            );
            return Err(Failed);
        };
        for joint in self.survey.joints.iter().filter(|joint| joint.target == Target::Command(index)) {
            if let (module, Wire::Port(port)) = joint.port
                && self.survey.modules[module].description.ports[port].descriptor.hash != descriptor.hash
            {
                let own = self.survey.modules[module].description.ports[port].descriptor.name;
                self.complaints.add(
                    joint.link.from.span,
                    format!(
                        "`{}` is {own} but `/{name}/command` is {}",
                        joint.link.to.value, descriptor.name
                    ),
                    "both ends of a link carry the same interface",
                );
                return Err(Failed);
            }
        }
        let gate = self.gate(name, descriptor, wanted)?.stop_latch(stop);
        let (_, budget) = self.demand(Target::Command(index));
        let command = self.board.add_channel(
            &format!("{name}/command"),
            "What passed the gate.",
            descriptor,
            0,
            1,
            budget,
            Access::Output,
        );
        let state = self.board.add_channel(
            &format!("{name}/gate"),
            "How the gate stands.",
            GateState::DESCRIPTOR,
            0,
            1,
            Budget { latest: SPARE_READERS, queues: 1, window: 1 },
            Access::Output,
        );
        let complain = |complaints: &mut Complaints<'_>, error: BoardError| {
            complaints.add(wanted.name.span, error.to_string(), "rename the actuator");
            Failed
        };
        let command = command.map_err(|error| complain(&mut self.complaints, error))?;
        let state = state.map_err(|error| complain(&mut self.complaints, error))?;
        self.index += 1;
        match (new_writer(&command), new_writer(&state)) {
            (Some(writer), Some(state)) => {
                Ok(Actuator::new(Gate::new(gate), (command, writer), state, self.index))
            }
            _ => Err(Failed),
        }
    }

    fn gate(
        &mut self,
        name: &str,
        descriptor: &'static Descriptor,
        wanted: &configuration::Actuator,
    ) -> Result<GateConfiguration, Failed> {
        let mut gate = GateConfiguration::new(name, descriptor).time_to_live(wanted.time_to_live.value);
        for limit in &wanted.limits {
            gate = gate.limit(&limit.field.value, limit.low, limit.high).map_err(|error| {
                self.complaints.add(
                    limit.field.span,
                    error.to_string(),
                    "see the fields of the command's interface",
                );
                Failed
            })?;
        }
        for limit in &wanted.rate_limits {
            gate = gate.rate_limit(&limit.field.value, limit.per_second).map_err(|error| {
                self.complaints.add(
                    limit.field.span,
                    error.to_string(),
                    "see the fields of the command's interface",
                );
                Failed
            })?;
        }
        if !wanted.safe.is_empty() {
            let value = configuration::Spanned {
                value: configuration::Value::Table(wanted.safe.clone()),
                span: wanted.name.span,
            };
            let bytes = value_bytes(descriptor, &value, &mut self.complaints).ok_or(Failed)?;
            gate = gate.safe(&bytes).map_err(|error| {
                self.complaints.add(
                    wanted.name.span,
                    error.to_string(),
                    "the safe command must itself be within the limits",
                );
                Failed
            })?;
        }
        Ok(gate)
    }

    fn runners(
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
            surveyed.description.ports.iter().map(|port| empty_slot(port, &parts.zeros)).collect();
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
        let (section, bytes, table) =
            (surveyed.section.clone(), surveyed.params.clone(), surveyed.plugin.table);
        let create = move || {
            (table.create)(&Setup { name: &setup_name, seed, period, section: section.as_ref() }, &bytes)
        };
        let mut runner = Runner {
            name,
            plugin: surveyed.plugin,
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
                        entries: Vec::with_capacity(usize::from(u16::MAX.min(port.window.max(16) as u16))),
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
        let added = self.board.add_channel(&path, doc, descriptor, 0, 1, budget, Access::Output);
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

fn new_writer(property: &Property) -> Option<Writer> {
    property.channel()?.writer().ok()
}

/// The first value of a setting.
fn set_bytes(property: &Property, bytes: &[u8]) {
    // A setting has a writer of the host, and nobody holds it up.
    let _ = property.set_bytes(bytes, 0);
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
