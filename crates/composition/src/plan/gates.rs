//! Gates of the actuators: the commands that they take, and their limits.

use slate_blackboard::interface::Descriptor;
use slate_configuration::{Actuator, ErrorCode, Message, Span, Spanned, Value};
use slate_module::Direction;
use slate_module::aspect::{Actuators, Service};
use slate_safety::GateConfiguration;

use super::{BuildPlan, PlanRefusal};
use crate::LinkEnd;
use crate::diagnostic_collector::DiagnosticCollector;
use crate::parameters::value_bytes;
use crate::survey::{LinkSource, described_limits};

/// Gate that an actuator gets.
#[derive(Debug)]
pub struct PlannedGate {
    /// Interface of the commands.
    pub descriptor: &'static Descriptor,
    /// Limits, time to live and safe command.
    pub configuration: GateConfiguration,
}

/// Returns the gate of an actuator, by its index.
/// Errors are added to `collector`.
/// `None` after a refusal, and while no commander of the actuator is loaded.
pub fn planned_gate(
    plan: BuildPlan<'_, '_>,
    index: usize,
    collector: &mut DiagnosticCollector<'_>,
) -> Option<PlannedGate> {
    GatePlanner { plan, collector }.gate_of(index, &plan.configuration.actuators()[index]).ok()?
}

/// Planner of the actuators' gates.
struct GatePlanner<'a, 's, 'c, 'd> {
    plan: BuildPlan<'a, 's>,
    collector: &'c mut DiagnosticCollector<'d>,
}

impl GatePlanner<'_, '_, '_, '_> {
    fn gate_of(&mut self, index: usize, wanted: &Actuator) -> Result<Option<PlannedGate>, PlanRefusal> {
        let commanded = self.commanded_interface(index, wanted)?;
        self.check_commanding_modules(wanted)?;
        let Some(descriptor) = commanded.or_else(|| self.linked_interface(index)) else {
            return self.without_commander(wanted).map(|()| None);
        };
        self.check_readers(index, wanted, descriptor)?;
        let configuration = self.gate(wanted, descriptor)?;
        Ok(Some(PlannedGate { descriptor, configuration }))
    }

    /// Returns the common interface of an actuator's command ports.
    /// `None` if none of them exists yet.
    fn commanded_interface(
        &mut self,
        index: usize,
        wanted: &Actuator,
    ) -> Result<Option<&'static Descriptor>, PlanRefusal> {
        let mut descriptor = None;
        for url in &wanted.commands {
            let path = url.value.path_in("");
            let Some((module, port)) = self.commander(&path) else {
                if self.plan.is_dormant(&path) {
                    continue;
                }
                let help = self.command_help(&path);
                return self.refuse(url.span, format!("`/{path}` is not a command"), &help);
            };
            let earlier = &self.plan.configuration.actuators()[..index];
            let names = |actuator: &&Actuator| {
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

    /// Returns the help for a path that is not a command: the nearest command.
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
    fn without_commander(&mut self, wanted: &Actuator) -> Result<(), PlanRefusal> {
        let is_dormant = |module: &Spanned<String>| self.plan.is_dormant(&module.value);
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
        wanted: &Actuator,
        descriptor: &Descriptor,
    ) -> Result<(), PlanRefusal> {
        for resolved in self.plan.readers(LinkSource::Command(index)).filter(|resolved| resolved.is_plain()) {
            let (module, LinkEnd::Port(port)) = resolved.port else { continue };
            let own = self.plan.port(module, port).descriptor;
            if own.hash != descriptor.hash {
                let message = ErrorCode::Ends.of(format!(
                    "`{}` is {} but `/{}/command` is {}",
                    resolved.link.to.value, own.name, wanted.name.value, descriptor.name
                ));
                let help = "both ends of a link carry the same interface";
                return self.refuse(resolved.link.from.span, message, help);
            }
        }
        Ok(())
    }

    /// Complains about a place of the configuration.
    fn refuse<T>(&mut self, span: Span, message: impl Into<Message>, help: &str) -> Result<T, PlanRefusal> {
        self.collector.add(span, message, help);
        Err(PlanRefusal)
    }

    /// Checks that modules which choose an actuator at run time have the aspect.
    fn check_commanding_modules(&mut self, wanted: &Actuator) -> Result<(), PlanRefusal> {
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
        let resolved =
            self.plan.readers(LinkSource::Command(actuator)).find(|resolved| resolved.is_plain())?;
        match resolved.port {
            (module, LinkEnd::Port(port)) => Some(self.plan.port(module, port).descriptor),
            (_, LinkEnd::Enabled | LinkEnd::Params) => None,
        }
    }

    fn gate(
        &mut self,
        wanted: &Actuator,
        descriptor: &'static Descriptor,
    ) -> Result<GateConfiguration, PlanRefusal> {
        let name = &wanted.name.value;
        let mut gate = GateConfiguration::new(name, descriptor).time_to_live(wanted.time_to_live.value);
        let described = described_limits(self.plan.survey, wanted);
        let described = described.filter(|described| described.command.hash == descriptor.hash);
        let limits = described.iter().flat_map(|described| &described.limits);
        for limit in limits.clone() {
            let Some(value) = wanted.safe.get(&limit.field.value) else { continue };
            if value.as_f64().is_some_and(|safe| !(limit.low..=limit.high).contains(&safe)) {
                self.collector.add(
                    value.span,
                    format!("the safe `{}` is out of the limits of the RobotModel", limit.field.value),
                    format!("choose a value from {} to {}", limit.low, limit.high),
                );
                return Err(PlanRefusal);
            }
        }
        for limit in wanted.limits.iter().chain(limits) {
            gate = gate.limit(&limit.field.value, limit.low, limit.high).map_err(|error| {
                self.collector.add(
                    limit.field.span,
                    error.to_string(),
                    "see the fields of the command's interface",
                );
                PlanRefusal
            })?;
        }
        for limit in &wanted.rate_limits {
            gate = gate.rate_limit(&limit.field.value, limit.per_second).map_err(|error| {
                self.collector.add(
                    limit.field.span,
                    error.to_string(),
                    "see the fields of the command's interface",
                );
                PlanRefusal
            })?;
        }
        if !wanted.safe.is_empty() {
            let value = Spanned { value: Value::Table(wanted.safe.clone()), span: wanted.name.span };
            let bytes = value_bytes(descriptor, &value, self.collector).ok_or(PlanRefusal)?;
            gate = gate.safe(&bytes).map_err(|error| {
                self.collector.add(
                    wanted.name.span,
                    error.to_string(),
                    "the safe command must itself be within the limits",
                );
                PlanRefusal
            })?;
        }
        Ok(gate)
    }
}
