//! Limits of gates, written or from the RobotModel.
//! Numbers of a command without a written limit have that of the actuator in the RobotModel, where Execute finds its
//! settings (RoCS, 4.2).

use slate_blackboard::interface::{Descriptor, Kind, Primitive};
use slate_configuration::{Actuator, Configuration, Diagnostic, ErrorCode, Limit, Spanned};
use slate_module::{Direction, Hardware};

use super::block::Block;
use super::{Survey, scope};

/// Limits of a gate that are not written, from the RobotModel.
#[derive(Debug)]
pub struct DescribedLimits<'s> {
    /// Name of the description, such as `pioneer_p3dx`.
    pub robot: &'s str,
    /// Interface of the command.
    pub command: &'static Descriptor,
    /// Limits of the numbers that share the first one's unit and have no written limit.
    pub limits: Vec<Limit>,
}

/// Tolerance of a written limit, relative to the width of the RobotModel's limits.
const ROUNDING: f64 = 1e-3;

/// Returns the limits of a gate that the configuration does not write.
/// They come from the actuator of the same name in the robot's RobotModel.
pub fn described_limits<'s>(survey: &'s Survey<'_>, actuator: &Actuator) -> Option<DescribedLimits<'s>> {
    let (model, command, [low, high]) = described(survey, actuator)?;
    let is_written = |name: &str| actuator.limits.iter().any(|limit| limit.field.value == name);
    let fields = numbers(command).filter(|name| !is_written(name));
    let limit = |name: &str| {
        let field = Spanned { value: name.into(), span: actuator.name.span };
        Limit { field, low, high }
    };
    let limits: Vec<_> = fields.map(limit).collect();
    (!limits.is_empty()).then_some(DescribedLimits { robot: &model.robot, command, limits })
}

/// Returns the RobotModel with a gate's device, the command and its limits.
fn described<'s>(
    survey: &'s Survey<'_>,
    actuator: &Actuator,
) -> Option<(&'s Hardware, &'static Descriptor, [f64; 2])> {
    let robot = scope(&actuator.name.value);
    let knowledge = survey.modules.iter().find(|surveyed| {
        !robot.is_empty()
            && scope(&surveyed.module.name.value) == robot
            && Block::of(&surveyed.description) == Some(Block::Knowledge)
    })?;
    let model = knowledge.description.hardware.first()?;
    let device = model.actuator(actuator.name.value.rsplit('/').next()?)?;
    let mut ports = survey.modules.iter().flat_map(|surveyed| &surveyed.description.ports);
    let command = ports
        .find(|port| port.direction == Direction::Command && port.descriptor.name == device.interface)?;
    Some((model, command.descriptor, device.limits?))
}

/// Returns the numbers of a command that an actuator's limits bind.
/// These are the first one, and those of the same unit.
fn numbers(command: &Descriptor) -> impl Iterator<Item = &'static str> {
    let mut fields = command.fields.iter().filter(|field| is_number(&field.kind)).peekable();
    let unit = fields.peek().map_or("", |first| first.unit);
    fields.filter(move |field| field.unit == unit).map(|field| field.name)
}

fn is_number(kind: &Kind) -> bool {
    matches!(kind, Kind::Primitive(primitive) if *primitive != Primitive::Bool)
}

/// Warns of written limits that are wider than those of the RobotModel.
pub(super) fn wide_limits(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for actuator in configuration.actuators() {
        let Some((model, command, [least, greatest])) = described(survey, actuator) else { continue };
        let slack = ROUNDING * (greatest - least);
        let is_wide = |limit: &&Limit| limit.low < least - slack || limit.high > greatest + slack;
        let is_number = |limit: &&Limit| numbers(command).any(|name| name == limit.field.value);
        for limit in actuator.limits.iter().filter(is_number).filter(is_wide) {
            let message = format!(
                "the limits of `{}` at the gate `{}`, {} to {}, are wider than those of the RobotModel, a `{}`: {least} to {greatest}",
                limit.field.value, actuator.name.value, limit.low, limit.high, model.robot
            );
            let help = "remove them, and the gate has those of the RobotModel, or make them narrower";
            let message = ErrorCode::WideLimits.of(message);
            found.push(configuration.diagnostic(limit.field.span, message, Some(help.into())));
        }
    }
    found
}

/// Warns of numbers without a limit beside limited ones of the same unit.
pub(super) fn partial_limits(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for actuator in configuration.actuators() {
        let Some(first) = actuator.limits.first() else { continue };
        let Some(command) = commanded(survey, actuator) else { continue };
        if described_limits(survey, actuator).is_some() {
            continue;
        }
        let is_limited = |name: &str| actuator.limits.iter().any(|limit| limit.field.value == name);
        let units: Vec<_> =
            command.fields.iter().filter(|field| is_limited(field.name)).map(|field| field.unit).collect();
        let numbers = command.fields.iter().filter(|field| is_number(&field.kind));
        let free = numbers.filter(|field| units.contains(&field.unit) && !is_limited(field.name));
        let free: Vec<_> = free.map(|field| format!("`{}`", field.name)).collect();
        if !free.is_empty() {
            let has = if free.len() == 1 { "has" } else { "have" };
            let message = format!("{} of the gate `{}` {has} no limit", free.join(", "), actuator.name.value);
            let help = format!("add a range for each to `limits`, as for `{}`", first.field.value);
            let message = ErrorCode::PartialLimits.of(message);
            found.push(configuration.diagnostic(first.field.span, message, Some(help)));
        }
    }
    found
}

/// Returns the interface of the commands that pass a gate.
fn commanded(survey: &Survey<'_>, actuator: &Actuator) -> Option<&'static Descriptor> {
    let port = |path: String| {
        survey.modules.iter().find_map(|surveyed| {
            let name = path.strip_prefix(&surveyed.module.name.value)?.strip_prefix('/')?;
            let mut ports = surveyed.description.ports.iter();
            ports.find(|port| port.name == name && port.direction == Direction::Command)
        })
    };
    actuator.commands.iter().find_map(|url| port(url.value.path_in(""))).map(|port| port.descriptor)
}
