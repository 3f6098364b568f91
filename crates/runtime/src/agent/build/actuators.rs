//! The gates in front of the actuators.

use std::sync::Arc;

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::{Access, BoardError, Store};
use slate_module::aspect::{Actuators, Service};
use slate_module::{Direction, Interface};
use slate_safety::{Gate, GateConfiguration, GateState};

use super::{Builder, Failed, SPARE_READERS, new_writer};
use crate::actuators::Actuator;
use crate::configuration;
use slate_composition::parameters::value_bytes;
use slate_composition::{Complaints, Target, Wire};
use slate_configuration::Mistake;

impl Builder<'_, '_> {
    /// Makes the gates that are not there yet and whose commands are known.
    pub(super) fn actuators(&mut self) {
        let configuration = self.configuration;
        for (i, wanted) in configuration.actuators().iter().enumerate() {
            if self.ground.actuators.contains_key(&wanted.name.value) {
                continue;
            }
            // What is wrong was complained about.
            if let Ok(Some(actuator)) = self.actuator(i, wanted) {
                for wake in self.wakes(&format!("{}/command", wanted.name.value)) {
                    actuator.wakes(wake);
                }
                self.ground.actuators.insert(wanted.name.value.clone(), Arc::new(actuator));
            }
        }
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
    ) -> Result<Option<Actuator>, Failed> {
        let name = &wanted.name.value;
        let mut descriptor = None;
        for url in &wanted.commands {
            let path = url.value.path_in("");
            let Some((module, port)) = self.commander(&path) else {
                if self.is_dormant(&path) {
                    continue;
                }
                let help = "name a Command port of a module, such as `r2/execute/wheels`";
                self.complaints.add(url.span, format!("`/{path}` is no command"), help);
                return Err(Failed);
            };
            let earlier = &self.configuration.actuators()[..index];
            let names = |actuator: &&configuration::Actuator| {
                actuator.commands.iter().any(|command| command.value.path_in("") == path)
            };
            if let Some(other) = earlier.iter().find(names) {
                self.complaints.add(
                    url.span,
                    format!("`/{path}` commands `{}` already", other.name.value),
                    "give each actuator a command port of its own",
                );
                return Err(Failed);
            }
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
        self.guests(wanted)?;
        let Some(descriptor) = descriptor.or_else(|| self.linked_interface(index)) else {
            if !wanted.commands.is_empty()
                || wanted.modules.iter().any(|module| self.is_dormant(&module.value))
            {
                // Its commanders are not there yet.
                return Ok(None);
            }
            self.complaints.add(
                wanted.name.span,
                format!("actuator `{name}` has no commander"),
                "say `command = \"robot/execute/wheels\"`",
            );
            return Err(Failed);
        };
        for joint in self
            .survey
            .joints
            .iter()
            .filter(|joint| joint.target == Target::Command(index) && joint.is_plain())
        {
            if let (module, Wire::Port(port)) = joint.port
                && self.survey.modules[module].description.ports[port].descriptor.hash != descriptor.hash
            {
                let own = self.survey.modules[module].description.ports[port].descriptor.name;
                self.complaints.add(
                    joint.link.from.span,
                    Mistake::Ends.of(format!(
                        "`{}` is {own} but `/{name}/command` is {}",
                        joint.link.to.value, descriptor.name
                    )),
                    "both ends of a link carry the same interface",
                );
                return Err(Failed);
            }
        }
        let gate = self.gate(name, descriptor, wanted)?.stop_latch(&self.ground.stop);
        let (_, budget) = self.demand(Target::Command(index), &format!("{name}/command"));
        let command = self.ground.board.add_channel(
            &format!("{name}/command"),
            "What passed the gate.",
            descriptor,
            Store { capacity: 0, depth: 1, budget },
            Access::Output,
        );
        let state = self.ground.board.add_channel(
            &format!("{name}/gate"),
            "How the gate stands.",
            GateState::DESCRIPTOR,
            Store { capacity: 0, depth: 1, budget: Budget { latest: SPARE_READERS, queues: 1, window: 1 } },
            Access::Output,
        );
        let complain = |complaints: &mut Complaints<'_>, error: BoardError| {
            complaints.add(wanted.name.span, error.to_string(), "rename the actuator");
            Failed
        };
        let command = command.map_err(|error| complain(&mut self.complaints, error))?;
        let state = state.map_err(|error| complain(&mut self.complaints, error))?;
        self.ground.index += 1;
        match (new_writer(&command), new_writer(&state)) {
            (Some(writer), Some(state)) => {
                let ports = wanted.commands.iter().map(|url| url.value.path_in(""));
                let guests = wanted.modules.iter().map(|module| module.value.clone());
                let commanders = ports.chain(guests).collect();
                let own = (self.ground.index, Arc::clone(&self.ground.means.clock));
                Ok(Some(Actuator::new(name, commanders, Gate::new(gate), writer, state, own)))
            }
            _ => Err(Failed),
        }
    }

    /// Whether a path is of a module that is not there yet.
    fn is_dormant(&self, path: &str) -> bool {
        self.configuration.modules().iter().any(|module| {
            let name = module.name.value.as_str();
            let rest = path.strip_prefix(name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/')) && !self.is_there(name)
        })
    }

    /// Modules that command an actuator which they choose at run time have the aspect for it.
    fn guests(&mut self, wanted: &configuration::Actuator) -> Result<(), Failed> {
        for module in &wanted.modules {
            if self.is_dormant(&module.value) {
                continue;
            }
            let surveyed = self.survey.modules.iter().find(|other| other.module.name.value == module.value);
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
            self.complaints.add(module.span, message, help);
            return Err(Failed);
        }
        Ok(())
    }

    /// What a module that follows the actuator's command takes it to be.
    fn linked_interface(&self, actuator: usize) -> Option<&'static Descriptor> {
        let joint = self.readers(Target::Command(actuator)).find(|joint| joint.is_plain())?;
        match joint.port {
            (module, Wire::Port(port)) => Some(self.port(module, port).descriptor),
            (_, Wire::Enabled | Wire::Params) => None,
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
}
