//! Ports that should lead somewhere and do not: the agent runs, and its robot stands still.

use slate_module::{Direction, PortDescription};

use super::{LinkSource, Survey, Wire, scope};
use slate_configuration::{Configuration, Diagnostic};

/// Warnings of ports and actuators that lead nowhere.
pub fn loose(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for (module, surveyed) in survey.modules.iter().enumerate() {
        for port in 0..surveyed.description.ports.len() {
            if let Some((message, help)) = loose_port(configuration, survey, module, port) {
                found.push(configuration.diagnostic(surveyed.module.name.span, message, Some(help)));
            }
        }
    }
    // Another agent may read it.
    if configuration.share().is_none() {
        found.extend(loose_gates(configuration, survey));
    }
    found
}

fn loose_port(
    configuration: &Configuration,
    survey: &Survey<'_>,
    module: usize,
    port: usize,
) -> Option<(String, String)> {
    let surveyed = &survey.modules[module];
    let own = &surveyed.description.ports[port];
    let path = format!("{}/{}", surveyed.module.name.value, own.name);
    let is_linked = survey.joints.iter().any(|joint| joint.port == (module, Wire::Port(port)));
    if is_linked || surveyed.inputs.contains_key(&port) || configuration.is_left_out(&path) {
        return None;
    }
    match own.direction {
        Direction::Outbox if !own.role.is_empty() => {
            let fits =
                |other: &PortDescription| other.direction == Direction::Inbox && other.role == own.role;
            let inboxes = in_scope(survey, module, fits);
            if !inboxes.is_empty() && inboxes.iter().all(|inbox| configuration.is_left_out(inbox)) {
                return None;
            }
            let help = match &inboxes[..] {
                [] => format!("no block of its robot takes a {}", own.role),
                inboxes => line(&inboxes[0], &path),
            };
            Some((format!("outbox `{path}` has no receiver"), help))
        }
        Direction::Input | Direction::Queue if is_needed(survey, module, own) => {
            let fits = |other: &PortDescription| {
                let writes = matches!(other.direction, Direction::Output | Direction::Debug);
                writes && other.role == own.role && other.descriptor.hash == own.descriptor.hash
            };
            let outputs = in_scope(survey, module, fits);
            let help = match &outputs[..] {
                [] => format!("link it, or write \"/{path}\" = false if it is to have no value"),
                outputs => line(&path, &outputs[0]),
            };
            Some((format!("`{path}` reads nothing"), help))
        }
        Direction::Command => {
            let url = |url: &slate_blackboard::Url| url.path_in("") == path;
            let mut commands = configuration.actuators().iter().flat_map(|actuator| &actuator.commands);
            if commands.any(|command| url(&command.value)) {
                return None;
            }
            let help = format!("name it in an actuator: command = \"/{path}\"");
            Some((format!("`{path}` commands no actuator"), help))
        }
        _ => None,
    }
}

/// Whether a module does nothing without it: it is required, an Analyze is without a Monitor, or a Plan notices nothing at all.
fn is_needed(survey: &Survey<'_>, module: usize, port: &PortDescription) -> bool {
    let notices = || {
        let ports = &survey.modules[module].description.ports;
        let alike = |joint: &super::ResolvedLink<'_>| {
            let Wire::Port(other) = joint.port.1 else { return false };
            joint.port.0 == module && ports[other].role == port.role
        };
        survey.joints.iter().any(alike)
    };
    port.required || !port.role.is_empty() && (port.direction == Direction::Input || !notices())
}

/// The ports of the modules of the same robot that fit.
fn in_scope(survey: &Survey<'_>, module: usize, fits: impl Fn(&PortDescription) -> bool) -> Vec<String> {
    let robot = scope(&survey.modules[module].module.name.value);
    let own = survey.modules.iter().filter(|surveyed| scope(&surveyed.module.name.value) == robot);
    own.flat_map(|surveyed| {
        let ports = surveyed.description.ports.iter().filter(|port| fits(port));
        ports.map(|port| format!("{}/{}", surveyed.module.name.value, port.name)).collect::<Vec<_>>()
    })
    .collect()
}

/// Actuators whose commands pass the gate and reach nothing.
fn loose_gates(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for (index, actuator) in configuration.actuators().iter().enumerate() {
        let name = &actuator.name.value;
        let command = format!("{name}/command");
        let is_read = survey.joints.iter().any(|joint| joint.target == LinkSource::Command(index));
        // Also by a module that is not loaded.
        let is_named = configuration
            .links()
            .iter()
            .any(|link| slate_blackboard::is_within(&link.from.value.path_in(""), &command));
        if is_read || is_named {
            continue;
        }
        let free = driver(configuration, survey, name);
        let help = match free {
            Some(input) => line(&input, &command),
            None => format!("link the input of its driver to it: \"driver/input\" = \"/{command}\""),
        };
        let message = format!("`{name}` reaches nothing: no link reads `{command}`");
        found.push(configuration.diagnostic(actuator.name.span, message, Some(help)));
    }
    found
}

/// An input without a link that takes such commands and is called like the actuator, or the only one.
fn driver(configuration: &Configuration, survey: &Survey<'_>, actuator: &str) -> Option<String> {
    let wanted = configuration.actuators().iter().find(|own| own.name.value == actuator)?;
    let interface = wanted.commands.iter().find_map(|command| {
        let path = command.value.path_in("");
        survey.modules.iter().find_map(|surveyed| {
            let rest = path.strip_prefix(surveyed.module.name.value.as_str())?.strip_prefix('/')?;
            surveyed.description.ports.iter().find(|port| port.name == rest).map(|port| port.descriptor.hash)
        })
    })?;
    let mut free = Vec::new();
    for (module, surveyed) in survey.modules.iter().enumerate() {
        for (port, own) in surveyed.description.ports.iter().enumerate() {
            let is_linked = survey.joints.iter().any(|joint| joint.port == (module, Wire::Port(port)));
            if own.direction == Direction::Input && own.descriptor.hash == interface && !is_linked {
                free.push(format!("{}/{}", surveyed.module.name.value, own.name));
            }
        }
    }
    let like = |path: &&String| path.ends_with(&format!("/{actuator}"));
    free.iter().find(like).cloned().or_else(|| <[String; 1]>::try_from(free).ok().map(|[one]| one))
}

/// The line of a link that would do.
fn line(to: &str, from: &str) -> String {
    format!("write \"/{to}\" = \"/{from}\"")
}
