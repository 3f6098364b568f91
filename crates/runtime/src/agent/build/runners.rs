//! Runners of the modules, with their handles and instances.

use std::cell::Cell;
use std::sync::Arc;

use slate_blackboard::channel::{Latest, Writer};
use slate_blackboard::interface::CanonicalForm;
use slate_blackboard::{Carrier, Stamp};
use slate_module::{Direction, Entry, Interface, ModuleKind, PortDescription, Random};

use super::{ModuleBuilder, WiringBuilder, new_writer};
use crate::aspects::{self, AspectPort, ProviderPort};
use slate_composition::{BuildPlan, LinkEnd, Surveyed, add_refusal};
use slate_engine::runner::{
    AlignedMemory, EntryPorts, InboxPort, Inputs, ModuleCode, ModuleServices, ModuleState, ModuleSwitch,
    ModuleTiming, OutboxPort, OutputPort, Outputs, ParameterReader, Requirements, Runner, RunnerStatus,
    Shortcuts, StepFrame, StepTiming, Supervised, TickSchedule,
};
use slate_engine::timing::TimingHistogram;

/// Properties of every module beside its ports.
struct OwnProperties {
    params: Latest,
    enabled: Latest,
    state: Writer,
    timing: Writer,
    histogram: Writer,
}

/// Builder of the modules' runners.
pub(super) struct RunnerBuilder<'b, 'a, 's> {
    plan: BuildPlan<'a, 's>,
    builder: &'b mut ModuleBuilder<'a, 's>,
}

impl<'b, 'a, 's> RunnerBuilder<'b, 'a, 's> {
    pub fn new(builder: &'b mut ModuleBuilder<'a, 's>) -> Self {
        Self { plan: builder.plan, builder }
    }

    /// Makes the runners of modules, by index; errors become diagnostics.
    pub fn all(&mut self, arriving: &[usize]) -> Vec<Runner> {
        let ports = self.plan.survey.modules.iter().flat_map(|surveyed| &surveyed.description.ports);
        let largest = ports.map(|port| port.descriptor.size).max();
        let zeros = Arc::new(AlignedMemory::zeroed(largest.unwrap_or(0)));
        let mut runners = Vec::new();
        for &m in arriving {
            match self.runner(m, &zeros) {
                Some(runner) => runners.push(runner),
                None if self.builder.diagnostics.diagnostics.is_empty() => {
                    let span = self.plan.surveyed(m).module.name.span;
                    let message = format!("`{}` can't get its handles", self.plan.name(m));
                    self.builder.diagnostics.add(
                        span,
                        message,
                        "the agent's logger or a reader budget is exhausted",
                    );
                }
                None => {}
            }
        }
        runners
    }

    fn runner(&mut self, m: usize, zeros: &Arc<AlignedMemory>) -> Option<Runner> {
        let mut runner = self.idle_runner(m, zeros)?;
        for p in 0..self.plan.surveyed(m).description.ports.len() {
            self.fill_port(m, p, &mut runner)?;
        }
        // The number is final, and with thousands of modules memory matters.
        runner.outputs.ports.shrink_to_fit();
        let wiring = WiringBuilder::new(self.builder, m, &|_| false).wiring()?;
        runner.rewire(wiring);
        // It is not news that it has links.
        runner.schedule.set_rewired(false);
        self.set_up(m, &mut runner)?;
        Some(runner)
    }

    /// Makes a runner without connections and without its instance.
    fn idle_runner(&mut self, m: usize, zeros: &Arc<AlignedMemory>) -> Option<Runner> {
        let surveyed = self.plan.surveyed(m);
        let name: Arc<str> = Arc::from(surveyed.module.name.value.as_str());
        let resources = &mut *self.builder.resources;
        let signals = resources.signals(&name);
        signals.health.begin();
        let log = resources.logger.module(&name, resources.lockstep, &resources.service_context.clock)?;
        let random = Random::new(self.plan.configuration.seed().value, &name);
        let supervised = self.builder.isolation().supervised(m);
        let kind = kind_of(surveyed, supervised.as_ref())?;
        let frame = StepFrame::new(&surveyed.description, zeros, random, log.host());
        let own = self.own_properties(m)?;
        let resources = &self.builder.resources;
        let timeout = resources.timeout(&name, supervised.is_some());
        let is_switched = self.plan.links(m, LinkEnd::Enabled).next().is_some();
        let ports = &surveyed.description.ports;
        let required = ports.iter().enumerate().filter(|(_, port)| port.required);
        let required = Requirements::new(required.map(|(p, port)| (p, port.name.as_str())));
        Some(Runner {
            shortcuts: Shortcuts::default(),
            status: RunnerStatus::new(Arc::clone(&signals.health), own.state),
            switch: ModuleSwitch::new(resources.board.settings(), own.enabled, is_switched),
            params: ParameterReader::new(own.params),
            code: ModuleCode::new(kind, surveyed.setup.clone(), timeout),
            frame,
            schedule: TickSchedule::new(surveyed.trigger.clone()),
            timing: StepTiming::new(surveyed.deadline, own.timing, own.histogram),
            inputs: Inputs::new(required),
            outputs: Outputs::new(signals.commit),
            supervised: supervised.map(Box::new),
            name,
            log,
            entries: EntryPorts::default(),
            services: ModuleServices::default(),
            shadow: None,
            wake: signals.wake,
        })
    }

    /// Returns the properties of a module beside its ports.
    fn own_properties(&mut self, m: usize) -> Option<OwnProperties> {
        let params = format!("{}/params", self.plan.name(m));
        let params = self.builder.resources.board.get(&params)?.0.channel()?.latest().ok()?;
        let enabled = self.builder.switch(m)?;
        let state =
            self.builder.implied_writer(m, "state", "State of the module.", ModuleState::DESCRIPTOR)?;
        let timing = self.builder.implied_writer(
            m,
            "timing",
            "Duration of the module's ticks.",
            ModuleTiming::DESCRIPTOR,
        )?;
        let doc = "Histogram of the durations of its ticks.";
        let histogram = self.builder.implied_writer(m, "histogram", doc, TimingHistogram::DESCRIPTOR)?;
        Some(OwnProperties { params, enabled, state, timing, histogram })
    }

    /// Connects a port, except one that links fill.
    fn fill_port(&mut self, m: usize, p: usize, runner: &mut Runner) -> Option<()> {
        let port = &self.plan.survey.modules[m].description.ports[p];
        match port.direction {
            Direction::Input | Direction::Queue => {}
            Direction::Inbox => {
                let property = self.builder.own_property(m, p)?;
                let Carrier::Mailbox(mailbox) = property.carrier() else { return None };
                let receiver = mailbox.receiver().ok()?;
                let entries = Vec::with_capacity(receiver.capacity());
                runner.entries.inboxes.push(InboxPort {
                    slot: p,
                    triggers: self.plan.triggers(m, p),
                    receiver,
                    entries,
                });
            }
            Direction::Output | Direction::Debug | Direction::Command => {
                let output = self.output(m, p, port)?;
                // A reader that came first may have made room for less.
                runner.frame.slots[p].capacity = output.writer.capacity();
                runner.outputs.ports.push(output);
            }
            Direction::Aspect => self.aspect(m, p, runner)?,
            Direction::Provider => {
                let place = self.builder.resources.service(&self.plan.port_path(m, p));
                let provider = ProviderPort::new(p, place, runner.code.kind().clone());
                runner.frame.slots[p].data = provider.table().cast_mut().cast();
                runner.services.providers.push(provider);
            }
            Direction::Outbox => {
                let outbox = self.outbox(p, port);
                let slot = &mut runner.frame.slots[p];
                slot.entries = outbox.entries.as_ptr();
                slot.capacity = outbox.entries.len();
                runner.entries.outboxes.push(outbox);
            }
        }
        Some(())
    }

    /// Makes the instance of a module.
    fn set_up(&mut self, m: usize, runner: &mut Runner) -> Option<()> {
        match runner.create_with_timeout() {
            Ok(instance) => {
                runner.code.set_instance(instance);
                runner.write_process(0, true);
                Some(())
            }
            Err(refusal) => {
                let module = self.plan.surveyed(m).module;
                add_refusal(self.plan.configuration, module, &refusal, &mut self.builder.diagnostics);
                None
            }
        }
    }

    /// Returns the service that a port needs.
    fn aspect(&mut self, m: usize, p: usize, runner: &mut Runner) -> Option<()> {
        match *self.plan.survey.services.get(&(m, p))? {
            Some((provider, port)) => {
                let place = self.builder.resources.service(&self.plan.port_path(provider, port));
                runner.services.aspects.push(AspectPort::new(
                    p,
                    &self.plan.port(m, p).name,
                    place,
                    &runner.wake,
                ));
            }
            None => {
                let schema = self.plan.port(m, p).descriptor.hash;
                let mut service =
                    aspects::service(schema, &self.builder.resources.service_context, &runner.name)?;
                service.begin(runner.code.kind());
                runner.frame.slots[p].data = service.table().cast_mut();
                runner.services.host.push(service);
            }
        }
        Some(())
    }

    fn output(&mut self, m: usize, p: usize, port: &PortDescription) -> Option<OutputPort> {
        let property = self.builder.own_property(m, p)?;
        let writer = new_writer(&property)?;
        self.builder.resources.index += 1;
        let path = property.path().to_owned();
        let actuator = self.plan.configuration.actuators().iter().find_map(|wanted| {
            let actuator = self.builder.resources.actuators.get(&wanted.name.value)?;
            Some((Arc::clone(actuator), actuator.commander(&path)?))
        });
        let wakes = self.builder.wakes(&path);
        Some(OutputPort {
            slot: p,
            property,
            index: self.builder.resources.index,
            writer,
            form: CanonicalForm::new(port.descriptor),
            debug: port.direction == Direction::Debug,
            safe: port.safe.clone().map(Vec::into_boxed_slice),
            actuator,
            wakes,
            late_draft: None,
        })
    }

    fn outbox(&mut self, p: usize, port: &PortDescription) -> OutboxPort {
        self.builder.resources.index += 1;
        let mut memory: Vec<_> =
            (0..port.window).map(|_| AlignedMemory::zeroed(port.descriptor.size)).collect();
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
        OutboxPort {
            slot: p,
            sender: None,
            sent: 0,
            tickets: memory.iter().map(|_| None).collect(),
            memory,
            entries,
            size: port.descriptor.size,
            form: CanonicalForm::new(port.descriptor),
            index: self.builder.resources.index,
            wake: None,
            refused: 0,
        }
    }
}

/// Returns the code of a module, in this process or isolated.
/// `None` for an isolated module that lacks its resources.
fn kind_of(surveyed: &Surveyed<'_>, supervised: Option<&Supervised>) -> Option<ModuleKind> {
    match supervised {
        Some(supervised) => Some(supervised.isolation.kind(&surveyed.kind)),
        None if surveyed.is_isolated => None,
        None => Some(surveyed.kind.clone()),
    }
}
