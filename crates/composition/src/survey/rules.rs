//! The rules of attachment, for links of every kind: whole values and fields, queues and messages, parameters and switches.

use std::collections::BTreeSet;

use slate_configuration::{Configuration, Mistake, Span};
use slate_module::Direction;

use super::block::{ACTUATION, Block, Provenance, TRUTH, is_fact};
use super::names::{join, split_module, split_port};
use super::{Implied, LinkSource, ResolvedLink, Survey, Surveyed, Wire, scope};
use crate::complaints::Complaints;

/// Complains of each link that passes the architecture by.
pub(super) fn check_rules<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    complaints: &mut Complaints<'a>,
) {
    for surveyed in &survey.modules {
        check_block(surveyed, complaints);
    }
    for joint in &survey.joints {
        // What is wrong at the end in another agent makes a link wait.
        if (!matches!(joint.target, LinkSource::Remote(_)) || sends(survey, joint))
            && let Some((span, message, help)) = refusal(configuration, survey, joint)
        {
            complaints.add(span, Mistake::Attachment.of(message), help);
        }
    }
    check_gates(configuration, survey, complaints);
}

/// How messages call the source of a link.
fn target_name(configuration: &Configuration, survey: &Survey<'_>, target: LinkSource) -> String {
    match target {
        LinkSource::Remote(remote) => survey.remote[remote].name(),
        other => survey.path(configuration, other),
    }
}

/// A module is one block.
fn check_block<'a>(surveyed: &Surveyed<'a>, complaints: &mut Complaints<'a>) {
    let blocks = Block::all(&surveyed.description);
    if let [first, second, ..] = blocks[..] {
        let name = &surveyed.module.name.value;
        let message = format!("`{name}` is {} and {}, as its ports say", first.name(), second.name());
        complaints.add(surveyed.module.name.span, Mistake::Attachment.of(message), "make two modules of it");
    }
}

/// Whether messages go over a link.
fn sends(survey: &Survey<'_>, joint: &ResolvedLink<'_>) -> bool {
    let (module, wire) = joint.port;
    matches!(wire, Wire::Port(port)
        if survey.modules[module].description.ports[port].direction == Direction::Outbox)
}

/// Why a link is against the rules, and what to do about it.
pub(super) fn refusal(
    configuration: &Configuration,
    survey: &Survey<'_>,
    joint: &ResolvedLink<'_>,
) -> Option<(Span, String, String)> {
    let (module, wire) = joint.port;
    let own = &survey.modules[module];
    let port = match wire {
        Wire::Port(port) => Some(&own.description.ports[port]),
        Wire::Enabled | Wire::Params => None,
    };
    let path = join(&survey.wire_path(module, wire), &joint.field);
    if let Some(port) = port.filter(|port| port.direction == Direction::Outbox) {
        return sent(configuration, survey, joint, (module, &port.role), &path);
    }
    let span = joint.link.from.span;
    let name = target_name(configuration, survey, joint.target);
    let role = port.map_or("", |port| port.role.as_str());
    let reader = Block::of(&own.description);
    let provenances = provenances(configuration, survey, joint);
    if let Some(block) = reader {
        let wrong = provenances.into_iter().find(|(origin, writer)| {
            // Its own outputs tell it nothing new.
            *writer != Some(module) && !block.may_read(*origin)
        });
        let (origin, _) = wrong?;
        return Some(match origin {
            Provenance::Truth => truth(span, &path, &name),
            _ => {
                let (reads, what) = (block.reads(), origin.name());
                let message = format!("{reads}: `/{path}` can't read `/{name}`, {what}");
                (span, message, block.way(origin).into())
            }
        });
    }
    let origin = |wanted: fn(Provenance) -> bool| provenances.iter().any(|(origin, _)| wanted(*origin));
    if role != TRUTH && origin(|origin| origin == Provenance::Truth) {
        return Some(truth(span, &path, &name));
    }
    let passes_gate =
        |origin: Provenance| matches!(origin, Provenance::Block(block) if block != Block::Actuator);
    (role == ACTUATION && origin(passes_gate)).then(|| {
        let message =
            format!("only Execute reaches actuators, through their gates: `/{path}` can't read `/{name}`");
        (span, message, "link it to a gate, \"/robot/wheels/command\", or to an Actuator".into())
    })
}

fn truth(span: Span, path: &str, name: &str) -> (Span, String, String) {
    let message = format!(
        "only ports of referees read ground truth, those with the role `truth`: `/{path}` can't read `/{name}`"
    );
    let help =
        "a robot knows what its Sensors measure: link one, such as the positioning system or the odometry";
    (span, message, help.into())
}

/// Why a message is against the rules.
fn sent(
    configuration: &Configuration,
    survey: &Survey<'_>,
    joint: &ResolvedLink<'_>,
    (module, role): (usize, &str),
    path: &str,
) -> Option<(Span, String, String)> {
    let sender = Block::of(&survey.modules[module].description);
    let origin = sender.map_or(Provenance::Module, Provenance::Block);
    let receiver = match joint.target {
        LinkSource::Port(receiver, _) => Block::of(&survey.modules[receiver].description),
        // Talking to other robots is an action, whatever listens there.
        LinkSource::Remote(_) => None,
        _ => return None,
    };
    let name = target_name(configuration, survey, joint.target);
    let span = joint.link.from.span;
    match receiver {
        Some(block) if !block.may_read(origin) => {
            let message = format!("{}: `/{path}` can't send to `/{name}`", block.reads());
            Some((span, message, block.way(origin).into()))
        }
        Some(_) => None,
        // A role of its own says where it leads.
        None if !role.is_empty() => None,
        None => {
            let passes_execute =
                !matches!(sender, None | Some(Block::Execute | Block::Sensor | Block::Actuator));
            passes_execute.then(|| {
                let message =
                    format!(
                    "only Execute sends to other agents and to modules that are no blocks: `/{path}` can't send to `/{name}`"
                );
                (span, message, "let an action send it".into())
            })
        }
    }
}

/// What a link's value comes from, each with the module that writes it.
fn provenances(
    configuration: &Configuration,
    survey: &Survey<'_>,
    joint: &ResolvedLink<'_>,
) -> Vec<(Provenance, Option<usize>)> {
    let mut found = Vec::new();
    if let Some(knowledge) = fact_of(configuration, survey, joint) {
        found.push((Provenance::Block(Block::Knowledge), Some(knowledge)));
        return found;
    }
    collect(configuration, survey, (joint.target, &joint.from), &mut BTreeSet::new(), &mut found);
    found
}

/// Adds what writes a source: the sources of its own links, for an input, a parameter or a switch.
fn collect(
    configuration: &Configuration,
    survey: &Survey<'_>,
    (target, field): (LinkSource, &str),
    seen: &mut BTreeSet<(usize, Wire, String)>,
    found: &mut Vec<(Provenance, Option<usize>)>,
) {
    let (module, wire) = match target {
        LinkSource::Port(module, port) => {
            let description = &survey.modules[module].description;
            let own = &description.ports[port];
            if !matches!(own.direction, Direction::Input | Direction::Queue) {
                found.push((Provenance::of_port(description, own), Some(module)));
                return;
            }
            (module, Wire::Port(port))
        }
        LinkSource::Implied(module, Implied::Params) => (module, Wire::Params),
        LinkSource::Implied(module, Implied::Enabled) => (module, Wire::Enabled),
        LinkSource::Implied(module, Implied::State | Implied::Timing | Implied::Histogram) => {
            found.push((Provenance::Health, Some(module)));
            return;
        }
        LinkSource::Host(_) => {
            found.push((Provenance::Health, None));
            return;
        }
        LinkSource::Command(_) => {
            found.push((Provenance::Gate, None));
            return;
        }
        LinkSource::Remote(remote) => {
            found.push((remote_origin(survey, remote), None));
            return;
        }
        LinkSource::Absent(_) | LinkSource::Played(_) => {
            found.push((Provenance::Unknown, None));
            return;
        }
    };
    if !seen.insert((module, wire, field.to_owned())) {
        return;
    }
    let fills = |joint: &&ResolvedLink<'_>| {
        joint.port == (module, wire) && (wire != Wire::Params || meets(&joint.field, field))
    };
    let before = found.len();
    for joint in survey.joints.iter().filter(fills) {
        if let Some(knowledge) = fact_of(configuration, survey, joint) {
            found.push((Provenance::Block(Block::Knowledge), Some(knowledge)));
        } else {
            collect(configuration, survey, (joint.target, &joint.from), seen, found);
        }
    }
    if found.len() == before {
        found.push((Provenance::Hand, None));
    }
}

/// The Knowledge whose fact a link reads: wherever that fact's own link leads, it is Knowledge that has it.
fn fact_of(configuration: &Configuration, survey: &Survey<'_>, joint: &ResolvedLink<'_>) -> Option<usize> {
    let url = &joint.link.from.value;
    let path = url.path_in("");
    let is_own = url.agent().is_none_or(|agent| agent == configuration.agent_name());
    let (module, rest) = split_module(&survey.modules, &path).filter(|_| is_own)?;
    let ports = &survey.modules[module].description.ports;
    let name = split_port(ports, rest).0;
    ports.iter().any(|port| port.name == name && is_fact(port)).then_some(module)
}

/// Whether one field is in the other.
fn meets(one: &str, other: &str) -> bool {
    slate_blackboard::is_within(one, other) || slate_blackboard::is_within(other, one) || other.is_empty()
}

/// What a property of another agent is.
fn remote_origin(survey: &Survey<'_>, remote: usize) -> Provenance {
    let remote = &survey.remote[remote];
    if remote.path.agent == slate_configuration::TEAM {
        return Provenance::Block(Block::Knowledge);
    }
    remote.property.as_ref().map_or(Provenance::Unknown, |property| Provenance::of_part(&property.part))
}

/// Execute alone commands the actuators of a robot that has blocks which decide.
fn check_gates<'a>(configuration: &'a Configuration, survey: &Survey<'a>, complaints: &mut Complaints<'a>) {
    let decides = |surveyed: &&Surveyed<'_>| {
        matches!(Block::of(&surveyed.description), Some(Block::Plan | Block::Execute | Block::Reactive))
    };
    let deciding: BTreeSet<&str> =
        survey.modules.iter().filter(decides).map(|surveyed| scope(&surveyed.module.name.value)).collect();
    for actuator in configuration.actuators() {
        let robot = scope(&actuator.name.value);
        if !deciding.contains(robot) {
            continue;
        }
        for command in &actuator.commands {
            let path = command.value.path_in("");
            let Some((module, _)) = split_module(&survey.modules, &path) else { continue };
            if Block::of(&survey.modules[module].description) != Some(Block::Execute) {
                let name = &actuator.name.value;
                let message = Mistake::Attachment.of(format!(
                    "Execute alone commands a robot with blocks: `/{path}` can't command `{name}`"
                ));
                let help = "name a port of its Execute; what else is to move the robot is a ReactiveModel, or a person";
                complaints.add(command.span, message, help);
            }
        }
    }
}
