//! Inputs that only Knowledge may fill: rules of reflexes, and the RobotModel.

use slate_blackboard::interface::Descriptor;
use slate_configuration::{Configuration, ErrorCode, Message};
use slate_module::Direction;

use super::block::{Block, Provenance, has_robot_model, is_for_reflexes};
use super::origins::ValueOrigin;
use super::{LinkEnd, LinkSource, ResolvedLink, Survey, scope};

/// Returns the output of the robot's Knowledge that matches an input of a block.
/// Their types determine it.
pub(super) fn known_output(survey: &Survey<'_>, (module, port): (usize, usize)) -> Option<String> {
    let surveyed = &survey.modules[module];
    let own = &surveyed.description.ports[port];
    let is_model = has_robot_model(own.descriptor);
    let is_for_knowledge = match Block::of(&surveyed.description) {
        Some(Block::Reactive) => true,
        None | Some(Block::Knowledge) => false,
        Some(_) => is_model,
    };
    if own.direction != Direction::Input || !is_for_knowledge {
        return None;
    }
    let fits = |descriptor: &Descriptor| {
        descriptor.hash == own.descriptor.hash || is_model && has_robot_model(descriptor)
    };
    let robot = scope(&surveyed.module.name.value);
    let mut knowledge = survey.modules.iter().filter(|other| {
        scope(&other.module.name.value) == robot && Block::of(&other.description) == Some(Block::Knowledge)
    });
    knowledge.find_map(|knowledge| {
        let mut ports = knowledge.description.ports.iter();
        let output = ports.find(|port| is_for_reflexes(port) && fits(port.descriptor))?;
        Some(format!("{}/{}", knowledge.module.name.value, output.name))
    })
}

fn help(path: &str, output: &str) -> String {
    format!(
        "link it, \"/{path}\" = \"/{output}\", and change that by the parameters of Knowledge, which checks them"
    )
}

/// Returns the error and the help for a manual value of an input of Knowledge's.
/// Only Knowledge may fill that input.
pub(super) fn value_refusal(
    configuration: &Configuration,
    survey: &Survey<'_>,
    (module, port): (usize, usize),
) -> Option<(Message, String)> {
    let output = known_output(survey, (module, port))?;
    let path = survey.path(configuration, LinkSource::Port(module, port));
    let message = format!("`/{path}` can't be set past Knowledge: `/{output}` has it");
    Some((ErrorCode::Attachment.of(message), help(&path, &output)))
}

/// Returns the error and the help if the input `path` must not read `name`.
/// The input is one that only Knowledge may fill.
pub(super) fn refusal(
    survey: &Survey<'_>,
    resolved: &ResolvedLink<'_>,
    (path, name): (&str, &str),
    origins: &[ValueOrigin<'_>],
) -> Option<(String, String)> {
    let (module, LinkEnd::Port(port)) = resolved.port else { return None };
    let output = known_output(survey, (module, port))?;
    let descriptor = survey.modules[module].description.ports[port].descriptor;
    let is_wrong = |origin: &ValueOrigin<'_>| match origin.provenance {
        Provenance::Rule | Provenance::Block(Block::Knowledge) | Provenance::Unknown => false,
        // A whole measurement, too; a part would be a threshold that is not validated.
        Provenance::Block(Block::Sensor) => has_robot_model(descriptor) || !resolved.field.is_empty(),
        _ => true,
    };
    let wrong = origins.iter().find(|origin| is_wrong(origin))?;
    let what = wrong.provenance.name();
    let message = format!("`/{path}` can't be filled past Knowledge: it can't read `/{name}`, {what}");
    Some((message, help(path, &output)))
}
