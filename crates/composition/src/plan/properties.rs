//! Properties that an agent of a composition has at its start.

use slate_blackboard::channel::{Budget, LinkError};
use slate_blackboard::interface::{Descriptor, Interface};
use slate_blackboard::{Access, AddressEntry, AddressSpace, Shape, Store};
use slate_configuration::{ErrorCode, Message};
use slate_interfaces::GateState;
use slate_module::{Direction, PortDescription};
use slate_sorted::SortedMap;

use super::{BuildPlan, PlanRefusal, PlannedPort, SPARE_READERS, planned_gate};
use crate::diagnostic_collector::DiagnosticCollector;
use crate::own::{ModuleProcess, ModuleState, ModuleTiming, TimingHistogram};
use crate::parameters::enabled_descriptor;
use crate::property_index::PropertyFacts;
use crate::survey::{
    Host, Implied, LOOP_STORE, LinkSource, RESERVED_WHEN_ISOLATED, ResolvedLink, Surveyed, stage_histogram,
};
use crate::{LinkEnd, Played};

/// Property that an agent would have, without memory for its values.
#[derive(Clone, Debug)]
pub struct PlannedProperty {
    path: String,
    descriptor: &'static Descriptor,
    access: Access,
    store: Store,
}

impl PropertyFacts for PlannedProperty {
    fn path(&self) -> &str {
        &self.path
    }

    fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    fn access(&self) -> Access {
        self.access
    }

    fn shape(&self) -> Shape {
        self.descriptor.shape(self.store.capacity)
    }
}

/// Returns the help for two properties of one path.
pub const SAME_PATH: &str = "rename one of the two";

/// Returns the properties that an agent has at its start.
/// Paths that are taken twice, and gates that do not fit, are added to `collector`.
pub fn planned_properties(
    plan: BuildPlan<'_, '_>,
    collector: &mut DiagnosticCollector<'_>,
) -> AddressSpace<PlannedProperty> {
    let mut planner = PropertyPlanner { plan, collector, space: AddressSpace::default() };
    planner.add_host();
    for module in 0..plan.survey.modules.len() {
        // What is wrong was added to the collector.
        let _ = planner.add_module(module);
    }
    planner.add_gates();
    if planner.collector.diagnostics.is_empty() {
        planner.check_readers();
    }
    planner.space
}

/// Planner of the properties, which are those that the builder of an agent makes.
struct PropertyPlanner<'a, 's, 'c, 'd> {
    plan: BuildPlan<'a, 's>,
    collector: &'c mut DiagnosticCollector<'d>,
    space: AddressSpace<PlannedProperty>,
}

impl PropertyPlanner<'_, '_, '_, '_> {
    /// Adds the properties of the main loop, its stages and the log.
    fn add_host(&mut self) {
        let stages = self.plan.configuration.schedule().stages().iter();
        let stages =
            stages.map(|stage| (stage_histogram(&stage.name), TimingHistogram::DESCRIPTOR, LOOP_STORE));
        let own = Host::ALL.map(|host| (host.path().to_owned(), host.descriptor(), host.store()));
        for (path, descriptor, store) in own.into_iter().chain(stages) {
            let property = PlannedProperty { path: path.clone(), descriptor, access: Access::Output, store };
            self.space.place(path, AddressEntry::Property(property));
        }
    }

    /// Adds all properties of a module, and those of absent modules that it links to.
    fn add_module(&mut self, m: usize) -> Result<(), PlanRefusal> {
        self.add_played(m)?;
        for (p, port) in self.plan.surveyed(m).description.ports.iter().enumerate() {
            let path = self.plan.port_path(m, p);
            match PlannedPort::of(self.plan, m, p) {
                PlannedPort::Output => self.add_output(m, LinkSource::Port(m, p), &path, port)?,
                PlannedPort::Messages => self.add_messages(m, &path, port)?,
                PlannedPort::Alias(source) => {
                    self.add(m, &path, AddressEntry::Alias(self.plan.target_path(source)))?;
                    self.add_absent(m, source, port)?;
                }
                PlannedPort::Converted => {
                    let access = Access::Output;
                    let store = self.converted_store(LinkSource::Port(m, p), &path, port.capacity);
                    self.add_property(m, &path, port.descriptor, access, store)?;
                }
                PlannedPort::Setting => {
                    let budget = Budget { latest: 1 + SPARE_READERS, queues: 1, window: port.window as u16 };
                    let depth = if port.direction == Direction::Queue { port.window * 2 } else { 1 };
                    let store = Store { capacity: port.capacity, depth, budget };
                    self.add_property(m, &path, port.descriptor, Access::Setting, store)?;
                }
                PlannedPort::Sent(inbox) => self.add_absent(m, inbox, port)?,
                PlannedPort::Nothing => {}
            }
        }
        self.add_implied(m)
    }

    /// Adds the parameters, `enabled` and the properties of the module's runner.
    fn add_implied(&mut self, m: usize) -> Result<(), PlanRefusal> {
        let name = self.plan.name(m);
        let told = [
            (Implied::State, ModuleState::DESCRIPTOR),
            (Implied::Timing, ModuleTiming::DESCRIPTOR),
            (Implied::Histogram, TimingHistogram::DESCRIPTOR),
        ];
        for (implied, descriptor) in told {
            let path = format!("{name}/{}", implied.name());
            self.add_written(m, LinkSource::Implied(m, implied), &path, descriptor, 0)?;
        }
        let path = format!("{name}/params");
        let store = self.setting_store(m, Implied::Params, &path);
        self.add_property(m, &path, self.plan.surveyed(m).description.params, Access::Setting, store)?;
        self.add_switch(m)?;
        if self.plan.is_isolated(m) {
            let path = format!("{name}/{RESERVED_WHEN_ISOLATED}");
            let budget = Budget { latest: SPARE_READERS, queues: 1, window: 1 };
            let store = Store { capacity: 0, depth: 1, budget };
            self.add_property(m, &path, ModuleProcess::DESCRIPTOR, Access::Output, store)?;
        }
        Ok(())
    }

    fn add_switch(&mut self, m: usize) -> Result<(), PlanRefusal> {
        let path = format!("{}/enabled", self.plan.name(m));
        let source = LinkSource::Implied(m, Implied::Enabled);
        if let Some(target) = self.plan.link(m, LinkEnd::Enabled).map(|resolved| resolved.target) {
            if let LinkSource::Absent(absent) = target {
                let path = &self.plan.survey.absent[absent].path;
                self.add_written(m, target, path, enabled_descriptor(), 0)?;
            }
            return self.add(m, &path, AddressEntry::Alias(self.plan.target_path(target)));
        }
        if self.plan.is_converted(m, LinkEnd::Enabled) {
            let store = self.converted_store(source, &path, 0);
            return self.add_property(m, &path, enabled_descriptor(), Access::Output, store);
        }
        let store = self.setting_store(m, Implied::Enabled, &path);
        let (descriptor, access) = (enabled_descriptor(), Access::Setting);
        let property = PlannedProperty { path: path.clone(), descriptor, access, store };
        self.space.place(path, AddressEntry::Property(property));
        Ok(())
    }

    /// Returns the store of a setting, with an additional reader for the module.
    fn setting_store(&self, m: usize, implied: Implied, path: &str) -> Store {
        let (depth, budget) = self.plan.demand(LinkSource::Implied(m, implied), path);
        Store { capacity: 0, depth, budget: Budget { latest: budget.latest + 1, ..budget } }
    }

    /// Returns the store of a converted port, with an additional reader for the module.
    fn converted_store(&self, source: LinkSource, path: &str, capacity: usize) -> Store {
        let (_, budget) = self.plan.demand(source, path);
        Store { capacity, depth: 1, budget: Budget { latest: budget.latest + 1, ..budget } }
    }

    /// Adds the source of a link whose module is absent.
    /// Or the messages for another agent.
    fn add_absent(
        &mut self,
        m: usize,
        target: LinkSource,
        port: &PortDescription,
    ) -> Result<(), PlanRefusal> {
        let is_outbox = port.direction == Direction::Outbox;
        match target {
            LinkSource::Remote(_) if is_outbox => self.add_messages(m, &self.plan.target_path(target), port),
            LinkSource::Absent(absent) => {
                let path = &self.plan.survey.absent[absent].path;
                if is_outbox {
                    self.add_messages(m, path, port)
                } else {
                    self.add_output(m, target, path, port)
                }
            }
            _ => Ok(()),
        }
    }

    /// Adds the played properties that a module reads.
    fn add_played(&mut self, m: usize) -> Result<(), PlanRefusal> {
        let survey = self.plan.survey;
        for resolved in survey.links.iter().filter(|resolved| resolved.port.0 == m) {
            let LinkSource::Played(index) = resolved.target else { continue };
            let Played { path, descriptor, capacity, is_mailbox, .. } = &survey.played[index];
            match resolved.port.1 {
                LinkEnd::Port(port) if *is_mailbox => self.add_messages(m, path, self.plan.port(m, port))?,
                _ => self.add_written(m, resolved.target, path, descriptor, *capacity)?,
            }
        }
        Ok(())
    }

    fn add_output(
        &mut self,
        m: usize,
        source: LinkSource,
        path: &str,
        port: &PortDescription,
    ) -> Result<(), PlanRefusal> {
        self.add_written(m, source, path, port.descriptor, port.capacity)
    }

    /// Adds a property that a module writes; a reader may have made it before.
    fn add_written(
        &mut self,
        m: usize,
        source: LinkSource,
        path: &str,
        descriptor: &'static Descriptor,
        capacity: usize,
    ) -> Result<(), PlanRefusal> {
        if self.stands(m, path, descriptor)? {
            return Ok(());
        }
        let (depth, budget) = self.plan.demand(source, path);
        self.add_property(m, path, descriptor, Access::Output, Store { capacity, depth, budget })
    }

    fn add_messages(&mut self, m: usize, path: &str, port: &PortDescription) -> Result<(), PlanRefusal> {
        if self.stands(m, path, port.descriptor)? {
            return Ok(());
        }
        let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 0, queues: 0, window: 0 } };
        self.add_property(m, path, port.descriptor, Access::Messages, store)
    }

    /// Returns true if a property of that interface stands at a path.
    fn stands(&mut self, m: usize, path: &str, descriptor: &Descriptor) -> Result<bool, PlanRefusal> {
        let Some(AddressEntry::Property(standing)) = self.space.entry(path) else { return Ok(false) };
        if standing.descriptor.hash == descriptor.hash {
            return Ok(true);
        }
        let (message, help) = interface_conflict(path, descriptor, standing.descriptor);
        self.collector.add(self.plan.surveyed(m).module.name.span, message, help);
        Err(PlanRefusal)
    }

    fn add_property(
        &mut self,
        m: usize,
        path: &str,
        descriptor: &'static Descriptor,
        access: Access,
        store: Store,
    ) -> Result<(), PlanRefusal> {
        let property = PlannedProperty { path: path.into(), descriptor, access, store };
        self.add(m, path, AddressEntry::Property(property))
    }

    fn add(&mut self, m: usize, path: &str, entry: AddressEntry<PlannedProperty>) -> Result<(), PlanRefusal> {
        self.space.add(path, entry).map_err(|error| {
            self.collector.add(self.plan.surveyed(m).module.name.span, error.to_string(), SAME_PATH);
            PlanRefusal
        })
    }

    /// Adds the commands and the states of the gates.
    fn add_gates(&mut self) {
        for (index, wanted) in self.plan.configuration.actuators().iter().enumerate() {
            let Some(gate) = planned_gate(self.plan, index, self.collector) else { continue };
            let name = &wanted.name.value;
            let (command, state) = gate_stores(self.plan, index);
            let properties = [("command", gate.descriptor, command), ("gate", GateState::DESCRIPTOR, state)];
            let mut added = properties.into_iter().map(|(last, descriptor, store)| {
                let path = format!("{name}/{last}");
                let property = PlannedProperty { path, descriptor, access: Access::Output, store };
                self.space.add(&property.path.clone(), AddressEntry::Property(property))
            });
            if let Some(error) = added.find_map(Result::err) {
                self.collector.add(wanted.name.span, error.to_string(), SAME_ACTUATOR);
            }
        }
    }

    /// Checks that each source has a handle for each reader.
    /// And that it keeps enough values for its queues.
    fn check_readers(&mut self) {
        let mut counts = SortedMap::<&str, (u16, u16)>::new();
        for resolved in &self.plan.survey.links {
            let Some((source, field)) = self.space.get(&self.plan.target_path(resolved.target)) else {
                continue;
            };
            if source.access == Access::Messages || !field.is_empty() {
                continue;
            }
            let queue = self.queue_of(resolved);
            let own = u16::from(source.access == Access::Setting);
            let (latest, queues) = counts.entry(&source.path).or_insert((own, 0));
            let (count, limit) = match queue {
                Some(_) => (queues, source.store.budget.queues),
                None => (latest, source.store.budget.latest),
            };
            *count += 1;
            if *count > limit {
                let error = LinkError::BudgetSpent { limit };
                let (message, help) = reader_refusal(&source.path, &error);
                self.collector.add(resolved.link.from.span, message, help);
            } else if let Some((reader, port, window)) = queue
                && !(source.store.depth >= window * 2 && usize::from(source.store.budget.window) >= window)
                && self.plan.writing(resolved.target).is_none()
            {
                let port = format!("{}/{}", reader.module.name.value, port.name);
                let (message, help) = shallow_source(&source.path, source.store.depth, &port, window);
                self.collector.add(resolved.link.from.span, message, help);
            }
        }
    }

    /// Returns the queue that a link fills directly, with its window.
    fn queue_of(&self, resolved: &ResolvedLink<'_>) -> Option<(&Surveyed<'_>, &PortDescription, usize)> {
        let (module, LinkEnd::Port(port)) = resolved.port else { return None };
        let port = self.plan.port(module, port);
        let window = resolved.link.window.as_ref().map_or(port.window, |window| window.value.into());
        let is_queue = port.direction == Direction::Queue && resolved.is_plain();
        is_queue.then(|| (self.plan.surveyed(module), port, window))
    }
}

/// Advice for an actuator whose properties have taken paths.
pub const SAME_ACTUATOR: &str = "rename the actuator";

/// Returns the capacities of a gate's command and of its state.
pub fn gate_stores(plan: BuildPlan<'_, '_>, actuator: usize) -> (Store, Store) {
    let command = format!("{}/command", plan.configuration.actuators()[actuator].name.value);
    let (_, budget) = plan.demand(LinkSource::Command(actuator), &command);
    let readers = plan.readers(LinkSource::Gate(actuator)).count() as u16;
    let state = Budget { latest: SPARE_READERS + readers, queues: 1, window: 1 };
    (Store { capacity: 0, depth: 1, budget }, Store { capacity: 0, depth: 1, budget: state })
}

/// Returns error and help for a property whose readers expect another interface.
pub fn interface_conflict(path: &str, own: &Descriptor, standing: &Descriptor) -> (String, &'static str) {
    let message = format!(
        "`/{path}` is {} {:016x}, but its readers were linked to {} {:016x}",
        own.name, own.hash, standing.name, standing.hash
    );
    (message, "build both with the same version of the interface")
}

/// Returns error and help for a property that is out of reader handles.
pub fn reader_refusal(path: &str, error: &dyn std::fmt::Display) -> (String, &'static str) {
    let help = "write the link into the file and start the agent again: a property is made for the readers that links \
                name then, and some more";
    (format!("`/{path}` can't take one more reader: {error}"), help)
}

/// Returns error and help for a property that keeps too few values for a queue.
pub fn shallow_source(path: &str, depth: usize, port: &str, window: usize) -> (Message, &'static str) {
    let needed = window * 2;
    let message = ErrorCode::Ends.of(format!(
        "`/{path}` keeps {depth} values, and `{port}` takes up to {window} at once, which needs {needed}"
    ));
    let help = "link it to an output of a module, or write the link into the file and start the agent again: a property \
                keeps as many values as the queues need that are linked then";
    (message, help)
}
