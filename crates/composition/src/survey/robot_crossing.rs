//! Links by which a block of one robot drives another, or measures for it.
//!
//! Driving is warned of, as one program may have two robots; a measurement of another robot is refused.

use slate_module::{Direction, PortDescription};

use super::block::Block;
use super::commander::commands_actuator;
use super::{LinkEnd, LinkSource, Survey, scope};
use slate_configuration::{Configuration, Diagnostic, ErrorCode};

/// Warns of commands that cross from one robot to another.
pub fn crossing(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let mut found = crossing_messages(configuration, survey);
    found.extend(crossing_commands(configuration));
    found
}

/// Warns of messages to another robot's Execute, and of commands to its driver.
fn crossing_messages(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let name = |module: usize| survey.modules[module].module.name.value.as_str();
    let warn = |resolved: &super::ResolvedLink<'_>| {
        let (own, link_end) = resolved.port;
        let LinkEnd::Port(port) = link_end else { return None };
        let (from, to, source, destination) = match resolved.target {
            LinkSource::Port(other, inbox) => {
                let is_inbox = survey.modules[other].description.ports[inbox].direction == Direction::Inbox;
                if !is_inbox || !commands_actuator(configuration, survey, other) {
                    return None;
                }
                let source = survey.path(configuration, LinkSource::Port(own, port));
                (scope(name(own)), scope(name(other)), source, survey.path(configuration, resolved.target))
            }
            LinkSource::Command(actuator) => {
                let destination = survey.path(configuration, LinkSource::Port(own, port));
                let driven = driven_robot(survey, own, port);
                let actuator = &configuration.actuators()[actuator].name.value;
                (scope(actuator), driven, format!("{actuator}/command"), destination)
            }
            _ => return None,
        };
        let crosses = !from.is_empty() && !to.is_empty() && from != to;
        crosses.then(|| {
            let message = format!("`{source}` of robot `{from}` drives robot `{to}` by `{destination}`");
            configuration.diagnostic(
                resolved.link.to.span,
                ErrorCode::OtherRobot.of(message),
                Some(help(from, to)),
            )
        })
    };
    survey.links.iter().filter_map(warn).collect()
}

/// Returns the robot that an input of a driver moves.
/// It is the driver's own robot, or the one in the name of a simulator's port.
fn driven_robot<'a>(survey: &'a Survey<'_>, module: usize, port: usize) -> &'a str {
    let surveyed = &survey.modules[module];
    let own = scope(&surveyed.module.name.value);
    let named = surveyed.description.ports[port].name.split_once('/').map_or("", |(robot, _)| robot);
    let is_robot = survey.modules.iter().any(|other| scope(&other.module.name.value) == named);
    if own.is_empty() && is_robot { named } else { own }
}

/// Warns of actuators whose commands come from a block of another robot.
fn crossing_commands(configuration: &Configuration) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for actuator in configuration.actuators() {
        let to = scope(&actuator.name.value);
        for command in &actuator.commands {
            let path = command.value.path_in("");
            let modules = configuration.modules().iter().map(|module| module.name.value.as_str());
            let owns = |name: &&str| path.strip_prefix(*name).is_some_and(|rest| rest.starts_with('/'));
            let from = modules.filter(owns).max_by_key(|name| name.len()).map_or("", scope);
            if !from.is_empty() && !to.is_empty() && from != to {
                let name = &actuator.name.value;
                let message = format!("`{path}` of robot `{from}` drives robot `{to}` by actuator `{name}`");
                let message = ErrorCode::OtherRobot.of(message);
                found.push(configuration.diagnostic(command.span, message, Some(help(from, to))));
            }
        }
    }
    found
}

fn help(from: &str, to: &str) -> String {
    format!("link a block of `{to}`, unless `{from}` is to drive both")
}

/// Returns the error and the help for a Sensor that reads another robot's device.
/// `name` is the device and `path` the port. Refused only if the Sensor's own robot has the same device.
pub fn refusal(
    survey: &Survey<'_>,
    resolved: &super::ResolvedLink<'_>,
    (path, name): (&str, &str),
) -> Option<(String, String)> {
    let LinkSource::Port(device, output) = resolved.target else { return None };
    let (reader, device) = (&survey.modules[resolved.port.0], &survey.modules[device]);
    if Block::of(&reader.description) != Some(Block::Sensor) || Block::of(&device.description).is_some() {
        return None;
    }
    let (robot, ports) = (scope(&reader.module.name.value), &device.description.ports);
    let (other, part) = ports[output].name.split_once('/').filter(|(other, _)| *other != robot)?;
    let is_own = |port: &&PortDescription| port.name.split_once('/') == Some((robot, part));
    let own = ports.iter().find(is_own)?;
    let message = format!(
        "a Sensor measures by the devices of its own robot: `/{path}` can't read `/{name}`, a device of robot `{other}`"
    );
    let device = &device.module.name.value;
    Some((message, format!("write \"/{path}\" = \"/{device}/{}\", or leave the link out", own.name)))
}
