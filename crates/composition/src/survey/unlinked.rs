//! Warnings of unlinked ports, for lack of which the robot stands still.
//! The agent runs nevertheless.

use slate_module::role::{ACTUATION, ACTUATOR_STATUS, CHANGE, MEASUREMENT, PERCEPT, PLAN, REFLEX};
use slate_module::{Direction, PortDescription};
use slate_sorted::SortedMap;

use super::block::{Block, binds, is_percept};
use super::commander::{commands_actuator, decides, is_of_actuator};
use super::knowledge_inputs::known_output;
use super::limits::{partial_limits, wide_limits};
use super::names::{in_scope, line};
use super::reflex_warnings::{undelivered_reflex, unmeasured};
use super::robot_crossing::crossing;
use super::switched_off::switched_off;
use super::{LinkEnd, LinkSource, Survey, scope};
use slate_configuration::{Configuration, Diagnostic, ErrorCode, empty_robots};

/// Warns of ports and actuators without a counterpart.
pub fn unlinked_warnings(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    // A module that is switched off does nothing, with or without a link.
    let enabled = survey.modules.iter().enumerate().filter(|(_, surveyed)| surveyed.module.enabled.value);
    for (module, surveyed) in enabled {
        for port in 0..surveyed.description.ports.len() {
            if let Some((message, help)) = unlinked_port(configuration, survey, module, port) {
                let message = ErrorCode::Loose.of(message);
                found.push(configuration.diagnostic(surveyed.module.name.span, message, Some(help)));
            }
        }
    }
    found.extend(switched_off(configuration, survey));
    found.extend(crossing(configuration, survey));
    found.extend(unguarded(configuration, survey));
    found.extend(wide_limits(configuration, survey));
    found.extend(partial_limits(configuration, survey));
    found.extend(empty_robots(configuration).into_iter().map(|robot| {
        let message = ErrorCode::EmptyRobot.of(format!("robot `{}` has no modules", robot.value));
        let help = format!("add its blocks in [robots.{0}.modules], or remove [robots.{0}]", robot.value);
        configuration.diagnostic(robot.span, message, Some(help))
    }));
    // Another agent may read it.
    if configuration.share().is_none() {
        found.extend(unread_gates(configuration, survey));
    }
    found
}

fn unlinked_port(
    configuration: &Configuration,
    survey: &Survey<'_>,
    module: usize,
    port: usize,
) -> Option<(String, String)> {
    let surveyed = &survey.modules[module];
    let own = &surveyed.description.ports[port];
    let path = format!("{}/{}", surveyed.module.name.value, own.name);
    let is_linked = survey.links.iter().any(|resolved| resolved.port == (module, LinkEnd::Port(port)))
        || reads(own) && configuration.is_filled(&path)
        || configuration.is_bridged(&path);
    let is_reflex = Block::of(&surveyed.description) == Some(Block::Reactive);
    if is_reflex && own.role == REFLEX {
        return undelivered_reflex(survey, (module, port), &path);
    }
    if is_reflex
        && !is_linked
        && let Some(found) = unmeasured(survey, module, own, &path)
    {
        return Some(found);
    }
    if is_linked || surveyed.inputs.contains_key(&port) {
        return None;
    }
    // Also where it is left out: without what Knowledge has for it, such as its rules, a reflex stops the robot.
    if let Some(output) = known_output(survey, (module, port)).filter(|_| is_reflex) {
        let message = format!("input `{path}` has no source, and Knowledge has that for the reflex");
        let help = format!("{}, or set `enabled = false` of its module", line(&path, &output));
        return Some((message, help));
    }
    if configuration.is_left_out(&path) {
        return None;
    }
    match own.direction {
        Direction::Outbox if !own.role.is_empty() => unreceived(configuration, survey, module, own, &path),
        Direction::Inbox if awaits_commands(configuration, survey, module, port) => {
            Some(unsent(survey, module, own, &path))
        }
        Direction::Input | Direction::Queue if is_needed(survey, module, own) => {
            Some((format!("input `{path}` has no source"), source_help(survey, module, own, &path)))
        }
        Direction::Queue if own.role == CHANGE => unanalyzed(survey, module, own, &path),
        Direction::Input if decides_outcome(configuration, &surveyed.module.name.value) => {
            let message =
                format!("input `{path}` has no source, and its module decides the mission's outcome");
            Some((message, source_help(survey, module, own, &path)))
        }
        Direction::Input | Direction::Queue if is_idle(configuration, survey, module, port) => {
            let name = &surveyed.module.name.value;
            let message = format!("input `{path}` has no source, and nothing else feeds `{name}`");
            Some((message, source_help(survey, module, own, &path)))
        }
        Direction::Output
            if Block::of(&surveyed.description) == Some(Block::Actuator) && own.role != ACTUATOR_STATUS =>
        {
            unread_output(configuration, survey, (module, port), &path)
        }
        Direction::Command => {
            if is_of_actuator(configuration, &path) {
                return None;
            }
            let help = format!("name it in an actuator: command = \"/{path}\"");
            Some((format!("command `{path}` has no actuator"), help))
        }
        _ => None,
    }
}

/// Warns of an outbox without a receiver.
/// Not if all inboxes for it are left out.
fn unreceived(
    configuration: &Configuration,
    survey: &Survey<'_>,
    module: usize,
    own: &PortDescription,
    path: &str,
) -> Option<(String, String)> {
    let fits = |other: &PortDescription| other.direction == Direction::Inbox && other.role == own.role;
    let inboxes = in_scope(survey, module, fits);
    if !inboxes.is_empty() && inboxes.iter().all(|inbox| configuration.is_left_out(inbox)) {
        return None;
    }
    let help = match &inboxes[..] {
        [] => format!("no block of its robot takes a {}", own.role),
        inboxes => line(&inboxes[0], path),
    };
    Some((format!("outbox `{path}` has no receiver"), help))
}

/// Warns of an inbox of commands without a sender.
fn unsent(survey: &Survey<'_>, module: usize, own: &PortDescription, path: &str) -> (String, String) {
    let fits = |other: &PortDescription| other.direction == Direction::Outbox && other.role == own.role;
    let help = match &in_scope(survey, module, fits)[..] {
        [] => format!(
            "add a {} to the robot, or write \"/{path}\" = false if it is to have no sender",
            block_that_sends(&own.role)
        ),
        outboxes => line(path, &outboxes[0]),
    };
    (format!("inbox `{path}` has no sender, and commands an actuator"), help)
}

/// Warns of an input of a Plan that no Analyze fills.
/// The robot has a percept or a measurement of that type.
fn unanalyzed(
    survey: &Survey<'_>,
    module: usize,
    own: &PortDescription,
    path: &str,
) -> Option<(String, String)> {
    let measures = |other: &PortDescription| {
        other.direction == Direction::Output
            && (other.role == PERCEPT || other.role == MEASUREMENT)
            && other.descriptor.hash == own.descriptor.hash
    };
    let measured = in_scope(survey, module, measures).into_iter().next()?;
    let what = own.descriptor.name;
    let message = format!("input `{path}` has no source, although `{measured}` has a {what}");
    let help = format!(
        "add an Analyze whose change is a {what}, or write \"/{path}\" = false if the Plan is to do without it"
    );
    Some((message, help))
}

/// Returns whether an inbox has senders.
/// Modules that are not loaded count, too.
fn has_sender(configuration: &Configuration, survey: &Survey<'_>, module: usize, port: usize) -> bool {
    let path = survey.path(configuration, LinkSource::Port(module, port));
    let is_target = survey.links.iter().any(|resolved| resolved.target == LinkSource::Port(module, port));
    is_target || configuration.links().iter().any(|link| link.to.value == path)
}

/// Returns whether an unlinked inbox is the only source of an Execute's actions.
/// It is the inbox of plans, or that of reflexes if none is for plans.
fn awaits_commands(configuration: &Configuration, survey: &Survey<'_>, module: usize, port: usize) -> bool {
    let surveyed = &survey.modules[module];
    let robot = scope(&surveyed.module.name.value);
    // A module that is not loaded may be the sender, and so may one of another agent.
    let of_robot = configuration.modules().iter().filter(|own| scope(&own.name.value) == robot).count();
    let known = survey.modules.iter().filter(|own| scope(&own.module.name.value) == robot).count();
    if of_robot > known || configuration.share().is_some() || has_sender(configuration, survey, module, port)
    {
        return false;
    }
    let ports = &surveyed.description.ports;
    let role = ports[port].role.as_str();
    let takes_plans = ports.iter().any(|port| port.direction == Direction::Inbox && port.role == PLAN);
    (role == PLAN || role == REFLEX && !takes_plans) && commands_actuator(configuration, survey, module)
}

/// Returns whether the port is the first input of a module without any source.
/// The module reads sensors (a Monitor or a ReactiveModel) or commands an actuator.
fn is_idle(configuration: &Configuration, survey: &Survey<'_>, module: usize, port: usize) -> bool {
    let surveyed = &survey.modules[module];
    let ports = &surveyed.description.ports;
    let is_fed = |(port, own): (usize, &PortDescription)| {
        let path = survey.path(configuration, LinkSource::Port(module, port));
        let has_value = surveyed.inputs.contains_key(&port) || configuration.is_left_out(&path);
        // Tools and other agents may send to an inbox.
        own.direction == Direction::Inbox || reads(own) && (has_value || configuration.is_filled(&path))
    };
    let senses = ports.iter().any(|port| match port.direction {
        Direction::Input => is_percept(port),
        Direction::Output => is_percept(port) || port.role == MEASUREMENT,
        Direction::Outbox => port.role == REFLEX,
        _ => false,
    });
    surveyed.module.enabled.value
        && ports.iter().position(reads) == Some(port)
        && (senses || commands_actuator(configuration, survey, module))
        && !ports.iter().enumerate().any(is_fed)
}

/// Returns whether a port is an input.
fn reads(port: &PortDescription) -> bool {
    matches!(port.direction, Direction::Input | Direction::Queue)
}

/// Returns whether a module provides the mission's outcome.
fn decides_outcome(configuration: &Configuration, module: &str) -> bool {
    configuration.mission().is_some_and(|mission| {
        let outcome = &mission.outcome.value;
        let is_own = outcome.agent().is_none_or(|agent| agent == configuration.agent_name());
        is_own && outcome.path_in("").strip_prefix(module).is_some_and(|rest| rest.starts_with('/'))
    })
}

/// Returns the block that sends messages of a role.
fn block_that_sends(role: &str) -> &'static str {
    if role == PLAN { "Plan" } else { "ReactiveModel" }
}

/// Returns help for an input without a source.
fn source_help(survey: &Survey<'_>, module: usize, own: &PortDescription, path: &str) -> String {
    let fits = |other: &PortDescription| {
        let writes = matches!(other.direction, Direction::Output | Direction::Debug);
        let is_alike = writes && other.role == own.role || own.role == PERCEPT && is_percept(other);
        is_alike && other.descriptor.hash == own.descriptor.hash
    };
    match &in_scope(survey, module, fits)[..] {
        // A queue and what a block tells have no constant value.
        [] if own.direction == Direction::Queue || !own.role.is_empty() => {
            format!("link it, or write \"/{path}\" = false if it is to have no value")
        }
        [] => format!(
            "link it, set `inputs.{}` of its module, or write \"/{path}\" = false if it is to have no value",
            own.name
        ),
        [output] => line(path, output),
        outputs => {
            let names: Vec<_> = outputs.iter().map(|output| format!("`/{output}`")).collect();
            format!("link it to one of {}", names.join(", "))
        }
    }
}

/// Returns whether a module is useless without a link of the port.
/// The port is required, an Analyze lacks its Monitor, or a Plan notices no change. The sensors that a Monitor needs
/// are checked at load, and Knowledge also describes robots with fewer sensors.
fn is_needed(survey: &Survey<'_>, module: usize, port: &PortDescription) -> bool {
    if !binds(&port.role) && !port.role.is_empty() {
        return port.required;
    }
    let notices = || {
        let ports = &survey.modules[module].description.ports;
        let alike = |resolved: &super::ResolvedLink<'_>| {
            let LinkEnd::Port(other) = resolved.port.1 else { return false };
            resolved.port.0 == module && ports[other].role == port.role
        };
        survey.links.iter().any(alike)
    };
    let is_traffic = binds(&port.role);
    port.required || is_traffic && (port.direction == Direction::Input || !notices())
}

/// Warns of actuators whose commands pass the gate and reach no driver.
fn unread_gates(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for (index, actuator) in configuration.actuators().iter().enumerate() {
        let name = &actuator.name.value;
        let command = format!("{name}/command");
        let is_read = survey.links.iter().any(|resolved| resolved.target == LinkSource::Command(index));
        // Also by a module that is not loaded.
        let is_named = configuration
            .links()
            .iter()
            .any(|link| slate_blackboard::is_within(&link.from.value.path_in(""), &command))
            || configuration.is_sent_outside(&command)
            || configuration.is_bridged(&command);
        if is_read || is_named {
            continue;
        }
        let free = driver(configuration, survey, name);
        let help = match free {
            Some(input) => line(&input, &command),
            None => format!("link the input of its driver to it: \"driver/input\" = \"/{command}\""),
        };
        let message = ErrorCode::Loose.of(format!("`{name}` reaches nothing: no link reads `{command}`"));
        found.push(configuration.diagnostic(actuator.name.span, message, Some(help)));
    }
    found
}

/// Warns of an Actuator's output that no driver reads.
/// The help is the line that would link it.
fn unread_output(
    configuration: &Configuration,
    survey: &Survey<'_>,
    (module, port): (usize, usize),
    path: &str,
) -> Option<(String, String)> {
    let is_read = survey.links.iter().any(|resolved| resolved.target == LinkSource::Port(module, port));
    let mut links = configuration.links().iter();
    // Another agent may read it.
    if is_read
        || configuration.share().is_some()
        || configuration.is_sent_outside(path)
        || links.any(|link| slate_blackboard::is_within(&link.from.value.path_in(""), path))
    {
        return None;
    }
    let output = &survey.modules[module].description.ports[port];
    let robot = scope(&survey.modules[module].module.name.value);
    let help = match free_input(survey, output.descriptor.hash, &format!("{robot}/{}", output.name)) {
        Some(input) => line(&input, path),
        None => format!("link the input of its driver to it: \"driver/input\" = \"/{path}\""),
    };
    Some((format!("`{path}` reaches nothing: no link reads it"), help))
}

/// Warns of driver inputs that lack the role that protects them.
/// Actuators and gates of a robot drive them, and any other output could be linked to them as well.
fn unguarded(configuration: &Configuration, survey: &Survey<'_>) -> Vec<Diagnostic> {
    // By Actuator, of which some outputs may report, or by gate.
    let mut readers: SortedMap<String, Vec<(usize, usize)>> = SortedMap::new();
    for resolved in &survey.links {
        let LinkEnd::Port(port) = resolved.port.1 else { continue };
        let moves = match resolved.target {
            LinkSource::Port(module, port) => {
                let surveyed = &survey.modules[module];
                let is_actuator = Block::of(&surveyed.description) == Some(Block::Actuator)
                    && surveyed.description.ports[port].role != ACTUATOR_STATUS;
                is_actuator.then(|| surveyed.module.name.value.clone())
            }
            LinkSource::Command(actuator) => {
                let gate = &configuration.actuators()[actuator].name.value;
                decides(survey, scope(gate)).then(|| gate.clone())
            }
            _ => None,
        };
        if let Some(moves) = moves {
            readers.entry(moves).or_default().push((resolved.port.0, port));
        }
    }
    let mut found = Vec::new();
    for (actuator, readers) in readers {
        let description = |module: usize| &survey.modules[module].description;
        let is_guarded = |(module, port): &(usize, usize)| {
            description(*module).ports[*port].role == ACTUATION || Block::of(description(*module)).is_some()
        };
        let Some((module, port)) = readers.first().filter(|_| !readers.iter().any(is_guarded)) else {
            continue;
        };
        let input = survey.path(configuration, LinkSource::Port(*module, *port));
        let message = ErrorCode::Unguarded.of(format!(
            "`{input}` is moved by `{actuator}` and lacks the role `{ACTUATION}`: anything could be linked to it past the gate"
        ));
        let help = format!(
            "write #[role(\"{ACTUATION}\")] above `{}` in the ports of `{}`",
            description(*module).ports[*port].name,
            survey.modules[*module].module.kind.value
        );
        found.push(configuration.diagnostic(survey.modules[*module].module.name.span, message, Some(help)));
    }
    found
}

/// Finds an unlinked input for an actuator's commands.
/// It has the actuator's name, or is the only one of its interface.
fn driver(configuration: &Configuration, survey: &Survey<'_>, actuator: &str) -> Option<String> {
    let wanted = configuration.actuators().iter().find(|own| own.name.value == actuator)?;
    let interface = wanted.commands.iter().find_map(|command| {
        let path = command.value.path_in("");
        survey.modules.iter().find_map(|surveyed| {
            let rest = path.strip_prefix(surveyed.module.name.value.as_str())?.strip_prefix('/')?;
            surveyed.description.ports.iter().find(|port| port.name == rest).map(|port| port.descriptor.hash)
        })
    })?;
    free_input(survey, interface, actuator)
}

/// Finds an unlinked input of an interface for a robot's port.
/// It has that name with its robot, that name alone, or is the only one.
fn free_input(survey: &Survey<'_>, interface: u64, name: &str) -> Option<String> {
    let mut free = Vec::new();
    for (module, surveyed) in survey.modules.iter().enumerate() {
        for (port, own) in surveyed.description.ports.iter().enumerate() {
            let is_linked =
                survey.links.iter().any(|resolved| resolved.port == (module, LinkEnd::Port(port)));
            // A driver of several robots names its inputs after them.
            let is_of_another = own.name.split_once('/').is_some_and(|(robot, _)| robot != scope(name));
            if own.direction == Direction::Input
                && own.descriptor.hash == interface
                && !is_linked
                && !is_of_another
            {
                free.push(format!("{}/{}", surveyed.module.name.value, own.name));
            }
        }
    }
    let own = name.rsplit('/').next().unwrap_or(name);
    let called = |name: &str| free.iter().find(|path| path.ends_with(&format!("/{name}"))).cloned();
    called(name).or_else(|| called(own)).or_else(|| <[String; 1]>::try_from(free).ok().map(|[one]| one))
}
