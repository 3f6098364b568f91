//! Gates of the actuators.

use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::Descriptor;
use slate_blackboard::{Access, Store};
use slate_module::aspect::{Actuators, Service};
use slate_module::{Direction, Interface};
use slate_safety::{Gate, GateConfiguration, GateState};

use super::{BuildPlan, Failed, ModuleBuilder, SPARE_READERS, new_writer};
use slate_composition::parameters::value_bytes;
use slate_composition::{GATE, LinkSource, Wire, described_limits};
use slate_configuration::Mistake;
use slate_engine::actuators::Actuator;

/// Builder of the actuators' gates.
pub(super) struct GateBuilder<'b, 'a, 's> {
    plan: BuildPlan<'a, 's>,
    builder: &'b mut ModuleBuilder<'a, 's>,
}

impl<'b, 'a, 's> GateBuilder<'b, 'a, 's> {
    pub fn new(builder: &'b mut ModuleBuilder<'a, 's>) -> Self {
        Self { plan: builder.plan, builder }
    }

    /// Makes the missing gates whose commands are known.
    pub fn all(&mut self) {
        for (i, wanted) in self.plan.configuration.actuators().iter().enumerate() {
            if self.builder.resources.actuators.contains_key(&wanted.name.value) {
                continue;
            }
            // What is wrong was complained about.
            if let Ok(Some(actuator)) = self.actuator(i, wanted) {
                for wake in self.builder.wakes(&format!("{}/command", wanted.name.value)) {
                    actuator.add_wake(wake);
                }
                self.builder.resources.actuators.insert(wanted.name.value.clone(), Arc::new(actuator));
            }
        }
    }

    /// Makes an actuator; `None` while its commanders are absent.
    fn actuator(
        &mut self,
        index: usize,
        wanted: &slate_configuration::Actuator,
    ) -> Result<Option<Actuator>, Failed> {
        let commanded = self.commanded_interface(index, wanted)?;
        self.guests(wanted)?;
        let Some(descriptor) = commanded.or_else(|| self.linked_interface(index)) else {
            return self.without_commander(wanted).map(|()| None);
        };
        self.check_readers(index, wanted, descriptor)?;
        let gate = self.gate(wanted, descriptor)?.stop_latch(&self.builder.resources.stop);
        let (command, state) = self.gate_properties(index, wanted, descriptor)?;
        let ports = wanted.commands.iter().map(|url| url.value.path_in(""));
        let guests = wanted.modules.iter().map(|module| module.value.clone());
        let commanders = ports.chain(guests).collect();
        let resources = &mut *self.builder.resources;
        resources.index += 1;
        let own = (resources.index, Arc::clone(&resources.means.clock));
        Ok(Some(Actuator::new(&wanted.name.value, commanders, Gate::new(gate), command, state, own)))
    }

    /// Returns the common interface of an actuator's command ports.
    /// `None` if none of them exists yet.
    fn commanded_interface(
        &mut self,
        index: usize,
        wanted: &slate_configuration::Actuator,
    ) -> Result<Option<&'static Descriptor>, Failed> {
        let mut descriptor = None;
        for url in &wanted.commands {
            let path = url.value.path_in("");
            let Some((module, port)) = self.commander(&path) else {
                if self.plan.is_dormant(&path) {
                    continue;
                }
                let help = self.command_help(&path);
                return self.refuse(url.span, format!("`/{path}` is no command"), &help);
            };
            let earlier = &self.plan.configuration.actuators()[..index];
            let names = |actuator: &&slate_configuration::Actuator| {
                actuator.commands.iter().any(|command| command.value.path_in("") == path)
            };
            if let Some(other) = earlier.iter().find(names) {
                let message = format!("`/{path}` commands `{}` already", other.name.value);
                return self.refuse(url.span, message, "give each actuator a command port of its own");
            }
            let own = self.plan.port(module, port).descriptor;
            if descriptor.is_some_and(|first: &Descriptor| first.hash != own.hash) {
                let message = format!("`/{path}` is {}, unlike the first command", own.name);
                return self.refuse(url.span, message, "all commanders of an actuator speak one interface");
            }
            descriptor = Some(own);
        }
        Ok(descriptor)
    }

    /// Returns the help for a path that is no command: the nearest command.
    fn command_help(&self, path: &str) -> String {
        let modules = &self.plan.survey.modules;
        let commands: Vec<_> = modules
            .iter()
            .flat_map(|surveyed| {
                let ports = surveyed.description.ports.iter();
                let commands = ports.filter(|port| port.direction == Direction::Command);
                commands.map(|port| format!("{}/{}", surveyed.module.name.value, port.name))
            })
            .collect();
        let near = slate_blackboard::nearest_names(path, commands.iter().map(String::as_str));
        let Some(near) = near.first() else {
            return "name a Command port of a module, such as `/r2/execute/wheels`".into();
        };
        let robot_of = |path: &str| path.split_once('/').map_or("", |(robot, _)| robot).to_owned();
        let (robot, other) = (robot_of(path), robot_of(near));
        let belongs = |name: &str| name.strip_prefix(&robot).is_some_and(|rest| rest.starts_with('/'));
        if robot == other || modules.iter().any(|surveyed| belongs(&surveyed.module.name.value)) {
            return format!("name a Command port of a module: did you mean `/{near}`?");
        }
        format!(
            "robot `{robot}` has no modules: did you mean `/{near}`, or is [robots.{other}.modules] misspelt?"
        )
    }

    /// Returns the command port that a URL of an actuator names.
    fn commander(&self, path: &str) -> Option<(usize, usize)> {
        self.plan.survey.modules.iter().enumerate().find_map(|(m, surveyed)| {
            let rest = path.strip_prefix(surveyed.module.name.value.as_str())?.strip_prefix('/')?;
            let port = surveyed.description.ports.iter().position(|port| port.name == rest)?;
            (surveyed.description.ports[port].direction == Direction::Command).then_some((m, port))
        })
    }

    /// Complains about an actuator without commanders.
    /// Commanders that do not exist yet count.
    fn without_commander(&mut self, wanted: &slate_configuration::Actuator) -> Result<(), Failed> {
        let is_dormant = |module: &slate_configuration::Spanned<String>| self.plan.is_dormant(&module.value);
        if !wanted.commands.is_empty() || wanted.modules.iter().any(is_dormant) {
            return Ok(());
        }
        let message = format!("actuator `{}` has no commander", wanted.name.value);
        self.refuse(wanted.name.span, message, "say `command = \"robot/execute/wheels\"`")
    }

    /// Checks that the readers of an actuator's command have its interface.
    fn check_readers(
        &mut self,
        index: usize,
        wanted: &slate_configuration::Actuator,
        descriptor: &Descriptor,
    ) -> Result<(), Failed> {
        for joint in self.plan.readers(LinkSource::Command(index)).filter(|joint| joint.is_plain()) {
            let (module, Wire::Port(port)) = joint.port else { continue };
            let own = self.plan.port(module, port).descriptor;
            if own.hash != descriptor.hash {
                let message = Mistake::Ends.of(format!(
                    "`{}` is {} but `/{}/command` is {}",
                    joint.link.to.value, own.name, wanted.name.value, descriptor.name
                ));
                let help = "both ends of a link carry the same interface";
                return self.refuse(joint.link.from.span, message, help);
            }
        }
        Ok(())
    }

    /// Returns the writers of a gate's command and of its state.
    fn gate_properties(
        &mut self,
        index: usize,
        wanted: &slate_configuration::Actuator,
        descriptor: &'static Descriptor,
    ) -> Result<(Writer, Writer), Failed> {
        let name = &wanted.name.value;
        let (_, budget) = self.plan.demand(LinkSource::Command(index), &format!("{name}/command"));
        let readers = self.plan.readers(LinkSource::Gate(index)).count() as u16;
        let state_budget = Budget { latest: SPARE_READERS + readers, queues: 1, window: 1 };
        let board = &self.builder.resources.board;
        let command = board.add_channel(
            &format!("{name}/command"),
            "Command that passed the gate.",
            descriptor,
            Store { capacity: 0, depth: 1, budget },
            Access::Output,
        );
        let state = board.add_channel(
            &format!("{name}/gate"),
            "State of the gate.",
            GateState::DESCRIPTOR,
            Store { capacity: 0, depth: 1, budget: state_budget },
            Access::Output,
        );
        if let Ok(command) = &command {
            command.set_part(GATE);
        }
        match (command, state) {
            (Ok(command), Ok(state)) => new_writer(&command).zip(new_writer(&state)).ok_or(Failed),
            (Err(error), _) | (_, Err(error)) => {
                self.refuse(wanted.name.span, error.to_string(), "rename the actuator")
            }
        }
    }

    /// Complains about a place of the configuration.
    fn refuse<T>(
        &mut self,
        span: slate_configuration::Span,
        message: impl Into<slate_configuration::Message>,
        help: &str,
    ) -> Result<T, Failed> {
        self.builder.complaints.add(span, message, help);
        Err(Failed)
    }

    /// Checks that modules which choose an actuator at run time have the aspect.
    fn guests(&mut self, wanted: &slate_configuration::Actuator) -> Result<(), Failed> {
        for module in &wanted.modules {
            if self.plan.is_dormant(&module.value) {
                continue;
            }
            let surveyed =
                self.plan.survey.modules.iter().find(|other| other.module.name.value == module.value);
            let aspects = surveyed.map(|surveyed| {
                let hashes = surveyed.description.ports.iter().map(|port| port.descriptor.hash);
                hashes.filter(|hash| *hash == Actuators::DESCRIPTOR.hash).count()
            });
            let message = match aspects {
                None => format!("there is no module `{}`", module.value),
                Some(0) => format!("`{}` has no aspect Actuators", module.value),
                Some(_) => continue,
            };
            let help = "name modules with a port `Aspect<Actuators>`; a Command port is named by `command`";
            return self.refuse(module.span, message, help);
        }
        Ok(())
    }

    /// Returns the interface that a reader of the actuator's command expects.
    fn linked_interface(&self, actuator: usize) -> Option<&'static Descriptor> {
        let joint = self.plan.readers(LinkSource::Command(actuator)).find(|joint| joint.is_plain())?;
        match joint.port {
            (module, Wire::Port(port)) => Some(self.plan.port(module, port).descriptor),
            (_, Wire::Enabled | Wire::Params) => None,
        }
    }

    fn gate(
        &mut self,
        wanted: &slate_configuration::Actuator,
        descriptor: &'static Descriptor,
    ) -> Result<GateConfiguration, Failed> {
        let name = &wanted.name.value;
        let mut gate = GateConfiguration::new(name, descriptor).time_to_live(wanted.time_to_live.value);
        let described = described_limits(self.plan.survey, wanted);
        let described = described.filter(|described| described.command.hash == descriptor.hash);
        let limits = described.iter().flat_map(|described| &described.limits);
        for limit in limits.clone() {
            let Some(value) = wanted.safe.get(&limit.field.value) else { continue };
            if value.as_f64().is_some_and(|safe| !(limit.low..=limit.high).contains(&safe)) {
                self.builder.complaints.add(
                    value.span,
                    format!("the safe `{}` is out of the limits of the RobotModel", limit.field.value),
                    format!("choose a value from {} to {}", limit.low, limit.high),
                );
                return Err(Failed);
            }
        }
        for limit in wanted.limits.iter().chain(limits) {
            gate = gate.limit(&limit.field.value, limit.low, limit.high).map_err(|error| {
                self.builder.complaints.add(
                    limit.field.span,
                    error.to_string(),
                    "see the fields of the command's interface",
                );
                Failed
            })?;
        }
        for limit in &wanted.rate_limits {
            gate = gate.rate_limit(&limit.field.value, limit.per_second).map_err(|error| {
                self.builder.complaints.add(
                    limit.field.span,
                    error.to_string(),
                    "see the fields of the command's interface",
                );
                Failed
            })?;
        }
        if !wanted.safe.is_empty() {
            let value = slate_configuration::Spanned {
                value: slate_configuration::Value::Table(wanted.safe.clone()),
                span: wanted.name.span,
            };
            let bytes = value_bytes(descriptor, &value, &mut self.builder.complaints).ok_or(Failed)?;
            gate = gate.safe(&bytes).map_err(|error| {
                self.builder.complaints.add(
                    wanted.name.span,
                    error.to_string(),
                    "the safe command must itself be within the limits",
                );
                Failed
            })?;
        }
        Ok(gate)
    }
}
