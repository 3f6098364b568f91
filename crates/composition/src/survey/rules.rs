//! The rules of attachment, for links of every kind: whole values and fields, queues and messages, parameters and switches.

use std::collections::{BTreeMap, BTreeSet};

use slate_configuration::{Configuration, Mistake, Span};
use slate_module::{Direction, PortDescription};

use super::block::{
    ACTUATION, Block, MEASUREMENT, PLAN, Provenance, REFLEX, TRUTH, is_fact, is_referee, role_permits,
};
use super::commander::decides;
use super::names::{join, split_module, split_port};
use super::{Implied, LinkSource, ResolvedLink, Survey, Surveyed, Wire, scope};
use crate::complaints::Complaints;

/// Reports each link that violates the architecture.
pub(super) fn check_rules<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    complaints: &mut Complaints<'a>,
) {
    for surveyed in &survey.modules {
        check_block(surveyed, complaints);
    }
    for joint in &survey.joints {
        // A violation at the end in another agent makes the link wait.
        if (!matches!(joint.target, LinkSource::Remote(_)) || sends(survey, joint))
            && let Some((span, message, help)) = refusal(configuration, survey, joint)
        {
            complaints.add(span, Mistake::Attachment.of(message.replace("`//", "`slate://")), help);
        }
    }
    check_single_plan(configuration, survey, complaints);
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
        return sent(configuration, survey, joint, (module, port), &path);
    }
    let span = joint.link.from.span;
    let name = target_name(configuration, survey, joint.target);
    let role = port.map_or("", |port| port.role.as_str());
    let provenances = provenances(configuration, survey, joint);
    if let Some(block) = Block::of(&own.description) {
        let (message, help) = read(survey, (module, block, role), (&path, &name), &provenances)?;
        return Some((span, message, help));
    }
    let known = provenances.iter().find(|(origin, _)| *origin == Provenance::Truth);
    if role != TRUTH
        && !is_referee(&own.description)
        && let Some((_, writer)) = known
    {
        let (message, help) = truth(survey, &path, (&name, *writer));
        return Some((span, message, help));
    }
    let passes_gate =
        |origin: Provenance| matches!(origin, Provenance::Block(block) if block != Block::Actuator);
    let passes_by = provenances.iter().any(|(origin, _)| passes_gate(*origin));
    (role == ACTUATION && passes_by).then(|| {
        let message =
            format!("only Execute reaches actuators, through their gates: `/{path}` can't read `/{name}`");
        (span, message, "link it to a gate, \"/robot/wheels/command\", or to an Actuator".into())
    })
}

/// Why a block may not read these values (`name`) at a port (`path`), and what to do about it.
fn read(
    survey: &Survey<'_>,
    (module, block, role): (usize, Block, &str),
    (path, name): (&str, &str),
    provenances: &[(Provenance, Option<usize>)],
) -> Option<(String, String)> {
    let module_name = |module: usize| survey.modules[module].module.name.value.as_str();
    let own = module_name(module);
    let is_own =
        |writer: Option<usize>| writer.is_some_and(|writer| scope(module_name(writer)) == scope(own));
    // A block may read its own outputs.
    let others = || provenances.iter().copied().filter(|(_, writer)| *writer != Some(module));
    let wrong = others()
        .find(|(origin, writer)| !block.may_read(*origin, is_own(*writer)) || !role_permits(role, *origin));
    match wrong {
        Some((Provenance::Truth, writer)) => Some(truth(survey, path, (name, writer))),
        Some((origin, writer)) => {
            let (reads, what) = (block.reads(), origin.name());
            let message = format!("{reads}: `/{path}` can't read `/{name}`, {what}");
            let help = match role {
                MEASUREMENT if block.may_read(origin, is_own(writer)) => {
                    "link it to a Sensor, or make it an `Input`"
                }
                _ => block.advice(origin),
            };
            Some((message, help.into()))
        }
        None => {
            others().filter(|(origin, _)| !block.may_read_abroad(*origin)).find_map(|(origin, writer)| {
                let (robot, other) = two_robots(own, module_name(writer?))?;
                let message = format!(
                    "{OWN_ROBOT}: `/{path}` can't read `/{name}`, {} of robot `{other}`",
                    origin.name()
                );
                Some((message, abroad_help(origin, robot, other)))
            })
        }
    }
}

/// Rule of links between blocks of two robots.
const OWN_ROBOT: &str = "a block reads blocks of its own robot";

/// The robots of two modules, if both are of one and of different ones.
fn two_robots<'n>(one: &'n str, other: &'n str) -> Option<(&'n str, &'n str)> {
    let robot = |name: &'n str| name.split_once('/').map(|(robot, _)| robot);
    let (one, other) = (robot(one)?, robot(other)?);
    (one != other).then_some((one, other))
}

/// What to do instead of a link from a robot's block to one of another robot.
fn abroad_help(origin: Provenance, own: &str, other: &str) -> String {
    match origin {
        Provenance::Block(Block::Knowledge) => format!(
            "link a port of the Knowledge of `{own}` to it, and read that: robots tell each other facts through Knowledge"
        ),
        _ => format!(
            "give `{own}` a Sensor that reads it, as `{other}` is a part of its world; or let its Knowledge read the Knowledge of `{other}`"
        ),
    }
}

/// A link to ground truth, or to what a referee (`writer`) makes of it.
fn truth(survey: &Survey<'_>, path: &str, (name, writer): (&str, Option<usize>)) -> (String, String) {
    let relays = writer.is_some_and(|writer| is_referee(&survey.modules[writer].description));
    let what = if relays { ", which a referee makes of it" } else { "" };
    let message = format!(
        "only ports of referees read ground truth, those with the role `truth`: `/{path}` can't read `/{name}`{what}"
    );
    let help =
        "a robot knows what its Sensors measure: link one, such as the positioning system or the odometry";
    (message, help.into())
}

/// Why a message is against the rules.
fn sent(
    configuration: &Configuration,
    survey: &Survey<'_>,
    joint: &ResolvedLink<'_>,
    (module, port): (usize, &PortDescription),
    path: &str,
) -> Option<(Span, String, String)> {
    let own = &survey.modules[module];
    let sender = Block::of(&own.description);
    let origin = Provenance::of_port(&own.description, port);
    let name = target_name(configuration, survey, joint.target);
    let span = joint.link.from.span;
    let from = scope(&own.module.name.value);
    let to = match joint.target {
        LinkSource::Port(receiver, _) => scope(&survey.modules[receiver].module.name.value),
        LinkSource::Remote(remote) => scope(scope(&survey.remote[remote].path.path)),
        _ => return None,
    };
    if matches!(port.role.as_str(), PLAN | REFLEX) && !from.is_empty() && !to.is_empty() && from != to {
        let block = sender.map_or("a module", Block::name);
        let message = format!(
            "{block} acts through the Execute of its own robot: `/{path}` of robot `{from}` can't send to `/{name}` of robot `{to}`"
        );
        let help = format!(
            "send to the Execute of `{from}`, or make the block one of `{to}`; robots tell each other facts, through Knowledge"
        );
        return Some((span, message, help));
    }
    let receiver = match joint.target {
        LinkSource::Port(receiver, _) => Block::of(&survey.modules[receiver].description),
        // Talking to other robots is an action, whatever listens there.
        _ => None,
    };
    match receiver {
        // Actions may command a Sensor: to look elsewhere, or at another rate.
        Some(Block::Sensor) if sender == Some(Block::Execute) => None,
        Some(block) if origin == Provenance::Truth => {
            let message = format!("{}: `/{path}`, of a referee, can't send to `/{name}`", block.reads());
            Some((span, message, "what a referee knows is ground truth: only referees may have it".into()))
        }
        Some(block) if !block.may_read(origin, from == to) => {
            let message = format!("{}: `/{path}` can't send to `/{name}`", block.reads());
            Some((span, message, block.advice(origin).into()))
        }
        // Talking to another robot is an action.
        Some(block) if sender != Some(Block::Execute) && !block.may_read_abroad(origin) => {
            let LinkSource::Port(receiver, _) = joint.target else { return None };
            let (to, from) = two_robots(&survey.modules[receiver].module.name.value, &own.module.name.value)?;
            let message =
                format!("{OWN_ROBOT}: `/{path}` of robot `{from}` can't send to `/{name}` of robot `{to}`");
            Some((span, message, abroad_help(origin, to, from)))
        }
        Some(_) => None,
        // A role of its own says where it leads.
        None if !port.role.is_empty() => None,
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

/// Origins of a link's value, each with the module that writes it.
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
    // What a program outside fills an input with is that of a driver.
    if configuration.external_links().iter().any(|link| link.fills(&survey.wire_path(module, wire))) {
        found.push((Provenance::Module, Some(module)));
    }
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

/// Provenance of a property of another agent.
fn remote_origin(survey: &Survey<'_>, remote: usize) -> Provenance {
    let remote = &survey.remote[remote];
    if remote.path.agent == slate_configuration::TEAM {
        return Provenance::Block(Block::Knowledge);
    }
    remote.property.as_ref().map_or(Provenance::Unknown, |property| Provenance::of_part(&property.part))
}

/// An Execute takes the actions of one Plan.
fn check_single_plan<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    complaints: &mut Complaints<'a>,
) {
    let mut plans: BTreeMap<(usize, usize), &ResolvedLink<'_>> = BTreeMap::new();
    for joint in &survey.joints {
        let LinkSource::Port(receiver, inbox) = joint.target else { continue };
        if survey.modules[receiver].description.ports[inbox].role != PLAN || !sends(survey, joint) {
            continue;
        }
        let Some(first) = plans.insert((receiver, inbox), joint) else { continue };
        let path = |joint: &ResolvedLink<'_>| survey.wire_path(joint.port.0, joint.port.1);
        let message = Mistake::Second.of(format!(
            "a robot has one Plan: `/{}` can't take the actions of both `/{}` and `/{}`",
            survey.path(configuration, joint.target),
            path(first),
            path(joint)
        ));
        let help = "remove one of the two senders; one Plan chooses among several plans by a StrategyModel";
        complaints.add(joint.link.from.span, message, help);
    }
}

/// Execute alone commands the actuators of a robot that has blocks which decide.
fn check_gates<'a>(configuration: &'a Configuration, survey: &Survey<'a>, complaints: &mut Complaints<'a>) {
    for actuator in configuration.actuators() {
        let robot = scope(&actuator.name.value);
        if !decides(survey, robot) {
            continue;
        }
        for command in &actuator.commands {
            let path = command.value.path_in("");
            let Some((module, _)) = split_module(&survey.modules, &path) else { continue };
            let commander = &survey.modules[module];
            let is_own = scope(&commander.module.name.value) == robot;
            if !is_own || Block::of(&commander.description) != Some(Block::Execute) {
                let name = &actuator.name.value;
                let message = Mistake::Attachment.of(format!(
                    "its own Execute alone commands a robot with blocks: `/{path}` can't command `{name}`"
                ));
                let help = "name a port of its Execute; make any other source of motion a ReactiveModel, or use teleoperation";
                complaints.add(command.span, message, help);
            }
        }
    }
}
