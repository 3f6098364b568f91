//! Rules for links that move a robot: commands come from the robot's own gate.
//! If the robot has blocks, they thus come from its own Execute.

use slate_configuration::{Configuration, ErrorCode, Message};
use slate_module::role::{ACTUATION, COMMAND};
use slate_module::{Direction, PortDescription};

use super::block::{Block, Provenance};
use super::names::{split_module, split_port};
use super::origins::ValueOrigin;
use super::{LinkEnd, LinkSource, ResolvedLink, Survey, commander, scope};

/// Port that moves a robot.
struct ActuatedPort<'s> {
    /// Robot that the port moves.
    /// `None` if neither the module nor the port is named after one; it may then be any robot.
    robot: Option<&'s str>,
    /// Existence of deciding blocks in the robot's scope or in none.
    /// A block without a scope may belong to the robot.
    decides: bool,
    /// Existence of deciding blocks in the robot's own scope.
    has_own_blocks: bool,
    /// Exclusive command by the gate.
    /// True if the robot has deciding blocks or a gate for such commands.
    is_guarded: bool,
}

impl<'s> ActuatedPort<'s> {
    /// Describes a port that moves a robot; `None` for any other port.
    fn of(
        configuration: &'s Configuration,
        survey: &'s Survey<'_>,
        (module, port): (usize, usize),
    ) -> Option<Self> {
        let description = &survey.modules[module].description.ports[port];
        if !matches!(description.role.as_str(), COMMAND | ACTUATION) {
            return None;
        }
        let robot = robot_of(configuration, survey, module, description);
        // A module of no robot may belong to any robot.
        let may_be_of = |other: &str| robot.is_none_or(|robot| other == robot || other.is_empty());
        let mut modules = survey.modules.iter().map(|surveyed| scope(&surveyed.module.name.value));
        let decides = modules.any(|robot| may_be_of(robot) && commander::decides(survey, robot));
        let gates = configuration.actuators().iter().enumerate();
        let mut gates = gates.filter(|(_, gate)| may_be_of(scope(&gate.name.value)));
        let carries = |gate: usize| {
            let interface = gate_interface(configuration, survey, gate);
            interface.is_none_or(|interface| interface == description.descriptor.hash)
        };
        let is_guarded = description.role == COMMAND || decides || gates.any(|(gate, _)| carries(gate));
        let has_own_blocks = robot.is_some_and(|robot| commander::decides(survey, robot));
        Some(Self { robot, decides, has_own_blocks, is_guarded })
    }

    /// Returns whether a gate or an Actuator of `robot` may command the port.
    /// An empty name is that of no robot, `None` that of another agent.
    fn is_moved_by(&self, robot: Option<&str>) -> bool {
        match (self.robot, robot) {
            (Some(own), Some(other)) => own == other || other.is_empty() && !self.has_own_blocks,
            _ => true,
        }
    }

    fn name(&self) -> String {
        self.robot.map_or("a robot".into(), |robot| format!("robot `{robot}`"))
    }

    fn help(&self) -> String {
        let gate = self.robot.map_or("robot/wheels".into(), |robot| format!("{robot}/wheels"));
        format!(
            "link it to its gate, such as \"/{gate}/command\", or to an Actuator behind it; a person drives by teleoperation"
        )
    }
}

/// Returns the robot that a port moves.
/// The name of its module or its own one determines it.
fn robot_of<'s>(
    configuration: &'s Configuration,
    survey: &'s Survey<'_>,
    module: usize,
    port: &'s PortDescription,
) -> Option<&'s str> {
    let own = scope(&survey.modules[module].module.name.value);
    if !own.is_empty() {
        return Some(own);
    }
    let modules = survey.modules.iter().map(|surveyed| scope(&surveyed.module.name.value));
    let gates = configuration.actuators().iter().map(|actuator| scope(&actuator.name.value));
    let is_prefix = |robot: &&str| port.name.strip_prefix(robot).is_some_and(|rest| rest.starts_with('/'));
    let known = modules.chain(gates).filter(|robot| !robot.is_empty()).filter(is_prefix);
    known
        .max_by_key(|robot| robot.len())
        .or_else(|| Some(scope(&port.name)).filter(|robot| !robot.is_empty()))
}

/// Returns the interface of the commands that a gate takes.
/// `None` if the modules that send them are not loaded.
fn gate_interface(configuration: &Configuration, survey: &Survey<'_>, gate: usize) -> Option<u64> {
    configuration.actuators()[gate].commands.iter().find_map(|command| {
        let path = command.value.path_in("");
        let (module, rest) = split_module(&survey.modules, &path)?;
        let ports = &survey.modules[module].description.ports;
        let name = split_port(ports, rest).0;
        ports.iter().find(|port| port.name == name).map(|port| port.descriptor.hash)
    })
}

/// Returns the error and the help for a constant value that bypasses a gate.
pub(super) fn value_refusal(
    configuration: &Configuration,
    survey: &Survey<'_>,
    (module, port): (usize, usize),
) -> Option<(Message, String)> {
    let actuated_port =
        ActuatedPort::of(configuration, survey, (module, port)).filter(|port| port.is_guarded)?;
    let path = survey.path(configuration, LinkSource::Port(module, port));
    let message = format!("`/{path}` can't be set, as it moves {} past its gate", actuated_port.name());
    Some((ErrorCode::PastGate.of(message), actuated_port.help()))
}

/// Returns the error and the help for an illegal link that moves a robot.
/// `path` reads `name`.
pub(super) fn refusal(
    configuration: &Configuration,
    survey: &Survey<'_>,
    resolved: &ResolvedLink<'_>,
    (path, name): (&str, &str),
    origins: &[ValueOrigin<'_>],
) -> Option<(String, String)> {
    let (module, LinkEnd::Port(port)) = resolved.port else { return None };
    let actuated_port = ActuatedPort::of(configuration, survey, (module, port))?;
    let is_actuation = survey.modules[module].description.ports[port].role == ACTUATION;
    for origin in origins {
        let permitted = match origin.provenance {
            // Known once it is there, and judged then.
            Provenance::Unknown => true,
            Provenance::Gate | Provenance::Block(Block::Actuator) => {
                if actuated_port.is_guarded && !actuated_port.is_moved_by(origin.robot) {
                    let own = actuated_port.name();
                    let message = format!(
                        "{own} is moved by its own gate: `/{path}` can't read `/{name}`, of another robot"
                    );
                    return Some((message, actuated_port.help()));
                }
                true
            }
            // The table of blocks has the inputs of an Actuator.
            _ if !is_actuation => true,
            Provenance::Block(_) | Provenance::Rule => false,
            Provenance::Module => {
                !actuated_port.is_guarded
                    || !actuated_port.decides && reads_gate(configuration, survey, &actuated_port, origin)
            }
            Provenance::Hand | Provenance::Health | Provenance::GateState | Provenance::Truth => {
                !actuated_port.is_guarded
            }
        };
        if !permitted {
            let commander = if actuated_port.decides { "Execute" } else { "a gate" };
            let through = if actuated_port.decides { ", through their gates" } else { "" };
            let what = origin.provenance.name();
            let message = format!(
                "only {commander} reaches actuators{through}: `/{path}` can't read `/{name}`, {what}"
            );
            return Some((message, actuated_port.help()));
        }
    }
    (actuated_port.is_guarded && !passes_all(survey, resolved)).then(|| {
        let message = format!("`/{path}` moves {}, and its link could withhold a stop", actuated_port.name());
        (message, "link it without `every` and `when`, and to the gate or the Actuator itself".into())
    })
}

/// Returns whether the writer is a driver behind a gate of that robot.
fn reads_gate(
    configuration: &Configuration,
    survey: &Survey<'_>,
    actuated_port: &ActuatedPort<'_>,
    origin: &ValueOrigin<'_>,
) -> bool {
    let is_gate = |target: LinkSource| match target {
        LinkSource::Command(gate) => {
            actuated_port.is_moved_by(Some(scope(&configuration.actuators()[gate].name.value)))
        }
        _ => false,
    };
    origin.writer.is_some_and(|writer| {
        survey.links.iter().any(|resolved| resolved.port.0 == writer && is_gate(resolved.target))
    })
}

/// Returns whether a link passes every command, including the safe one of a stop.
fn passes_all(survey: &Survey<'_>, resolved: &ResolvedLink<'_>) -> bool {
    let is_input = match resolved.target {
        LinkSource::Port(module, port) => {
            let port = &survey.modules[module].description.ports[port];
            matches!(port.direction, Direction::Input | Direction::Queue)
        }
        _ => false,
    };
    resolved.filter.is_none() && !is_input
}
