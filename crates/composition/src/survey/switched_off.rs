//! Warnings of blocks that are switched off although their robot needs them.

use slate_configuration::{Configuration, Diagnostic, ErrorCode};
use slate_module::Direction;
use slate_module::role::{ACTUATOR_STATUS, MEASUREMENT, PLAN};

use super::block::Block;
use super::commander::commands_actuator;
use super::{LinkEnd, LinkSource, Survey, scope};

/// Warns of blocks that the configuration switches off and no link switches on.
pub fn switched_off(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for (module, surveyed) in survey.modules.iter().enumerate() {
        if surveyed.module.enabled.value || is_switched(survey, module) {
            continue;
        }
        let name = &surveyed.module.name.value;
        let Some(missing_function) = missing_function(configuration, survey, module) else { continue };
        let message = ErrorCode::SwitchedOff.of(format!("`{name}` is switched off: {missing_function}"));
        let help = format!("set `enabled = true` of `{name}`, or remove it");
        found.push(configuration.diagnostic(surveyed.module.enabled.span, message, Some(help)));
    }
    found
}

/// Returns whether a link controls a module's switch.
fn is_switched(survey: &Survey<'_>, module: usize) -> bool {
    survey.links.iter().any(|resolved| resolved.port == (module, LinkEnd::Enabled))
}

/// Returns the function that a robot lacks without a module.
/// `None` if the robot can do without it.
fn missing_function(configuration: &Configuration, survey: &Survey<'_>, module: usize) -> Option<String> {
    let surveyed = &survey.modules[module];
    let robot = scope(&surveyed.module.name.value);
    if robot.is_empty() {
        return None;
    }
    match Block::of(&surveyed.description)? {
        Block::Execute if commands_actuator(configuration, survey, module) => {
            Some(format!("nothing commands the actuators of robot `{robot}`"))
        }
        Block::Plan => {
            let execute = receivers(survey, module).find(|execute| {
                commands_actuator(configuration, survey, *execute)
                    && !senders(survey, *execute).any(|plan| survey.modules[plan].module.enabled.value)
            })?;
            let execute = &survey.modules[execute].module.name.value;
            Some(format!("`{execute}` gets no plan, and only reflexes move robot `{robot}`"))
        }
        Block::Actuator => {
            let driver = readers(survey, module).next()?;
            Some(format!("no command reaches `{driver}`"))
        }
        Block::Sensor if readers(survey, module).next().is_some() => {
            Some(format!("robot `{robot}` lacks its measurements"))
        }
        Block::Knowledge if readers(survey, module).next().is_some() => {
            Some(format!("robot `{robot}` has no Knowledge"))
        }
        _ => None,
    }
}

/// Returns the inputs of enabled modules that read a module.
fn readers<'s>(survey: &'s Survey<'_>, module: usize) -> impl Iterator<Item = String> + 's {
    let reads = survey.links.iter().filter(move |resolved| {
        let own = &survey.modules[module].description;
        // A Sensor's measurement, an Actuator's command, and whatever another block writes.
        matches!(resolved.target, LinkSource::Port(source, port) if source == module
            && own.ports[port].role != ACTUATOR_STATUS
            && (own.ports[port].role == MEASUREMENT || Block::of(own) != Some(Block::Sensor)))
    });
    let is_enabled = |reader: usize| survey.modules[reader].module.enabled.value;
    reads
        .filter(move |resolved| is_enabled(resolved.port.0))
        .map(|resolved| survey.end_path(resolved.port.0, resolved.port.1))
}

/// Returns the modules that take the plans of a Plan.
fn receivers<'s>(survey: &'s Survey<'_>, plan: usize) -> impl Iterator<Item = usize> + 's {
    let own = survey.links.iter().filter(move |resolved| resolved.port.0 == plan);
    own.filter_map(|resolved| match resolved.target {
        LinkSource::Port(receiver, inbox)
            if survey.modules[receiver].description.ports[inbox].role == PLAN =>
        {
            Some(receiver)
        }
        _ => None,
    })
}

/// Returns the modules that send plans to an Execute.
fn senders<'s>(survey: &'s Survey<'_>, execute: usize) -> impl Iterator<Item = usize> + 's {
    survey.links.iter().filter_map(move |resolved| {
        let (sender, LinkEnd::Port(port)) = resolved.port else { return None };
        let own = &survey.modules[sender].description.ports[port];
        let sends = own.direction == Direction::Outbox && own.role == PLAN;
        (sends && matches!(resolved.target, LinkSource::Port(receiver, _) if receiver == execute))
            .then_some(sender)
    })
}
