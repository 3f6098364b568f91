//! Attachment rules for all links: values, fields, queues, parameters and switches.
//! They hold for messages, too.

use slate_configuration::{Configuration, ErrorCode, Span};
use slate_module::role::{DRIVER_STATUS, FACT, PLAN, REFLEX, TRUTH};
use slate_module::{Direction, PortDescription};
use slate_sorted::SortedMap;

use super::actuation;
use super::block::{Block, FACT_HELP, Provenance, is_referee, is_sensed, remote_sender, role_permits};
use super::commander::decides;
use super::knowledge_inputs;
use super::manual_values::check_values;
use super::names::{join, split_module};
use super::origins::{ValueOrigin, origins, passed_by};
use super::robot_crossing;
use super::{LinkEnd, LinkSource, ResolvedLink, Survey, Surveyed, duplicates, scope};
use crate::diagnostic_collector::DiagnosticCollector;

/// Reports each link that violates the architecture.
pub(super) fn check_rules<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    collector: &mut DiagnosticCollector<'a>,
) {
    for surveyed in &survey.modules {
        check_block(surveyed, collector);
    }
    for resolved in &survey.links {
        // A violation at the end in another agent makes the link wait.
        if (!matches!(resolved.target, LinkSource::Remote(_)) || sends(survey, resolved))
            && let Some((span, message, help)) = refusal(configuration, survey, resolved)
        {
            collector.add(span, ErrorCode::Attachment.of(message.replace("`//", "`slate://")), help);
        }
    }
    check_values(configuration, survey, collector);
    check_single_plan(configuration, survey, collector);
    check_gates(configuration, survey, collector);
}

/// Returns the name of the source of a link in messages.
fn target_name(configuration: &Configuration, survey: &Survey<'_>, target: LinkSource) -> String {
    match target {
        LinkSource::Remote(remote) => survey.remote[remote].name(),
        other => survey.path(configuration, other),
    }
}

/// Checks that a module is one block only.
fn check_block<'a>(surveyed: &Surveyed<'a>, collector: &mut DiagnosticCollector<'a>) {
    let blocks = Block::all(&surveyed.description);
    if let [first, second, ..] = blocks[..] {
        let name = &surveyed.module.name.value;
        let message = format!("`{name}` is {} and {}, by its ports", first.name(), second.name());
        collector.add(surveyed.module.name.span, ErrorCode::Attachment.of(message), "make two modules of it");
    }
}

/// Returns whether a link carries messages.
fn sends(survey: &Survey<'_>, resolved: &ResolvedLink<'_>) -> bool {
    let (module, link_end) = resolved.port;
    matches!(link_end, LinkEnd::Port(port)
        if survey.modules[module].description.ports[port].direction == Direction::Outbox)
}

/// Returns the error and the help for a link against the rules.
pub(super) fn refusal(
    configuration: &Configuration,
    survey: &Survey<'_>,
    resolved: &ResolvedLink<'_>,
) -> Option<(Span, String, String)> {
    let (module, link_end) = resolved.port;
    let own = &survey.modules[module];
    let port = match link_end {
        LinkEnd::Port(port) => Some(&own.description.ports[port]),
        LinkEnd::Enabled | LinkEnd::Params => None,
    };
    let path = join(&survey.end_path(module, link_end), &resolved.field);
    if let Some(port) = port.filter(|port| port.direction == Direction::Outbox) {
        return message_refusal(configuration, survey, resolved, (module, port), &path);
    }
    let span = resolved.link.from.span;
    // A fact and a percept that is handed on have the name of their block.
    let name = match passed_by(configuration, survey, resolved.link) {
        Some(_) => resolved.link.from.value.path_in(""),
        None => target_name(configuration, survey, resolved.target),
    };
    let role = port.map_or("", |port| port.role.as_str());
    let origins = origins(configuration, survey, resolved);
    let refused = match Block::of(&own.description) {
        Some(block) => read(survey, (module, block, role), (&path, &name), &origins),
        None => {
            let is_known = role == TRUTH || is_referee(&own.description);
            let known = origins.iter().filter(|_| !is_known);
            let mut known = known.filter(|origin| origin.provenance == Provenance::Truth);
            known.next().map(|origin| truth(survey, &path, (&name, origin.writer)))
        }
    };
    let refused = refused
        .or_else(|| actuation::refusal(configuration, survey, resolved, (&path, &name), &origins))
        .or_else(|| knowledge_inputs::refusal(survey, resolved, (&path, &name), &origins))
        .or_else(|| robot_crossing::refusal(survey, resolved, (&path, &name)));
    refused.map(|(message, help)| (span, message, help))
}

/// Returns the error and the help for a block that may not read these values.
/// `name` is the source and `path` the port.
fn read(
    survey: &Survey<'_>,
    (module, block, role): (usize, Block, &str),
    (path, name): (&str, &str),
    origins: &[ValueOrigin<'_>],
) -> Option<(String, String)> {
    let module_name = |module: usize| survey.modules[module].module.name.value.as_str();
    let own = module_name(module);
    let may_read =
        |origin: &ValueOrigin<'_>| block.may_read(origin.provenance, origin.robot == Some(scope(own)));
    // A block may read its own outputs.
    let others = || origins.iter().filter(|origin| origin.writer != Some(module));
    let wrong = others().find(|origin| !permits(block, role, origin, may_read(origin)));
    match wrong {
        Some(ValueOrigin { provenance: Provenance::Truth, writer, .. }) => {
            Some(truth(survey, path, (name, *writer)))
        }
        Some(origin) => {
            let (reads, what) = (block.reads(), origin.provenance.name());
            let message = format!("{reads}: `/{path}` can't read `/{name}`, {what}");
            let help = match role {
                role if is_sensed(role) && may_read(origin) => "link it to a Sensor, or make it an `Input`",
                FACT if may_read(origin) => FACT_HELP,
                _ => block.help(origin.provenance),
            };
            Some((message, help.into()))
        }
        None => {
            let other_robot = others().filter(|origin| !block.may_read_other_robot(origin.provenance));
            other_robot.into_iter().find_map(|ValueOrigin { provenance: origin, writer, .. }| {
                let (robot, other) = two_robots(own, module_name((*writer)?))?;
                let message = format!(
                    "{OWN_ROBOT_RULE}: `/{path}` can't read `/{name}`, {} of robot `{other}`",
                    origin.name()
                );
                Some((message, other_robot_help(*origin, robot, other)))
            })
        }
    }
}

/// Returns whether a port of a block accepts a value of an origin.
/// `may_read` is the verdict of [`Block::may_read`].
fn permits(block: Block, role: &str, origin: &ValueOrigin<'_>, may_read: bool) -> bool {
    let is_status =
        block == Block::Actuator && role == DRIVER_STATUS && origin.provenance == Provenance::Module;
    is_status || may_read && role_permits(role, origin.provenance)
}

/// Rule of links between blocks of two robots.
const OWN_ROBOT_RULE: &str = "a block reads blocks of its own robot";

/// Returns the robots of two modules if both have one and they differ.
fn two_robots<'n>(one: &'n str, other: &'n str) -> Option<(&'n str, &'n str)> {
    let robot = |name: &'n str| name.split_once('/').map(|(robot, _)| robot);
    let (one, other) = (robot(one)?, robot(other)?);
    (one != other).then_some((one, other))
}

/// Returns the help in place of a link between blocks of two robots.
fn other_robot_help(origin: Provenance, own: &str, other: &str) -> String {
    match origin {
        Provenance::Block(Block::Knowledge) | Provenance::Rule => format!(
            "link a port of the Knowledge of `{own}` to it, and read that: robots tell each other facts through Knowledge"
        ),
        _ => format!(
            "give `{own}` a Sensor that reads it, as `{other}` is a part of its world; or let its Knowledge read the Knowledge of `{other}`"
        ),
    }
}

/// Returns the error and the help for a link to ground truth.
/// Also for one to a value that a referee (`writer`) derives from it.
fn truth(survey: &Survey<'_>, path: &str, (name, writer): (&str, Option<usize>)) -> (String, String) {
    let relays = writer.is_some_and(|writer| is_referee(&survey.modules[writer].description));
    let what = if relays { ", which a referee makes of it" } else { "" };
    let message = format!(
        "only ports of referees read ground truth, those with the role `truth`: `/{path}` can't read `/{name}`{what}"
    );
    let help = "a robot's knowledge comes from its Sensors: link one, such as the positioning system or the odometry";
    (message, help.into())
}

/// Returns the error and the help for messages against the rules.
fn message_refusal(
    configuration: &Configuration,
    survey: &Survey<'_>,
    resolved: &ResolvedLink<'_>,
    (module, port): (usize, &PortDescription),
    path: &str,
) -> Option<(Span, String, String)> {
    let own = &survey.modules[module];
    let sender = Block::of(&own.description);
    let origin = Provenance::of_port(&own.description, port);
    let name = target_name(configuration, survey, resolved.target);
    let span = resolved.link.from.span;
    let from = scope(&own.module.name.value);
    let to = match resolved.target {
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
    // In this agent, the roles of both ports say so.
    let only = remote_sender(port.descriptor).filter(|only| sender != Some(*only));
    if let (Some(only), LinkSource::Remote(_)) = (only, resolved.target) {
        let message =
            format!("{} alone sends {} to `/{name}`: `/{path}` can't", only.name(), port.descriptor.name);
        let help = "make it one of that robot, or tell the other robot a fact, through Knowledge";
        return Some((span, message, help.into()));
    }
    let receiver = match resolved.target {
        LinkSource::Port(receiver, _) => Block::of(&survey.modules[receiver].description),
        // Talking to other robots is an action, whatever listens there.
        _ => None,
    };
    match receiver {
        // Actions may command a Sensor: to look elsewhere, or at another rate.
        Some(Block::Sensor) if sender == Some(Block::Execute) => None,
        Some(block) if origin == Provenance::Truth => {
            let message = format!("{}: `/{path}`, of a referee, can't send to `/{name}`", block.reads());
            Some((span, message, "the output of a referee is ground truth: only referees may read it".into()))
        }
        Some(block) if !block.may_read(origin, from == to) => {
            let message = format!("{}: `/{path}` can't send to `/{name}`", block.reads());
            Some((span, message, block.help(origin).into()))
        }
        // Talking to another robot is an action.
        Some(block) if sender != Some(Block::Execute) && !block.may_read_other_robot(origin) => {
            let LinkSource::Port(receiver, _) = resolved.target else { return None };
            let (to, from) = two_robots(&survey.modules[receiver].module.name.value, &own.module.name.value)?;
            let message = format!(
                "{OWN_ROBOT_RULE}: `/{path}` of robot `{from}` can't send to `/{name}` of robot `{to}`"
            );
            Some((span, message, other_robot_help(origin, to, from)))
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
                    "only Execute sends to other agents and to modules that are not blocks: `/{path}` can't send to `/{name}`"
                );
                (span, message, "let an action send it".into())
            })
        }
    }
}

/// Checks that an Execute takes the actions of one Plan only.
fn check_single_plan<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    collector: &mut DiagnosticCollector<'a>,
) {
    let mut plans: SortedMap<(usize, usize), &ResolvedLink<'_>> = SortedMap::new();
    // Two Plans of a robot are an error of their own.
    let duplicates = duplicates(configuration, &survey.modules);
    for resolved in &survey.links {
        let LinkSource::Port(receiver, inbox) = resolved.target else { continue };
        if survey.modules[receiver].description.ports[inbox].role != PLAN || !sends(survey, resolved) {
            continue;
        }
        let Some(first) = plans.insert((receiver, inbox), resolved) else { continue };
        if duplicates.iter().any(|(_, second)| *second == first.port.0 || *second == resolved.port.0) {
            continue;
        }
        let path = |resolved: &ResolvedLink<'_>| survey.end_path(resolved.port.0, resolved.port.1);
        let message = ErrorCode::Second.of(format!(
            "a robot has one Plan: `/{}` can't take the actions of both `/{}` and `/{}`",
            survey.path(configuration, resolved.target),
            path(first),
            path(resolved)
        ));
        let help = "remove one of the two senders; one Plan chooses among several plans by a StrategyModel";
        collector.add(resolved.link.from.span, message, help);
    }
}

/// Checks that only Execute commands the actuators of a robot with deciding blocks.
fn check_gates<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    collector: &mut DiagnosticCollector<'a>,
) {
    for actuator in configuration.actuators() {
        let robot = scope(&actuator.name.value);
        if !decides(survey, robot) {
            continue;
        }
        let ports = actuator.commands.iter().map(|command| (command.value.path_in(""), command.span));
        // Modules that choose an actuator by its name.
        let commanding_modules =
            actuator.modules.iter().map(|module| (format!("{}/", module.value), module.span));
        for (path, span) in ports.chain(commanding_modules) {
            let Some((module, _)) = split_module(&survey.modules, &path) else { continue };
            let commander = &survey.modules[module];
            let is_own = scope(&commander.module.name.value) == robot;
            if !is_own || Block::of(&commander.description) != Some(Block::Execute) {
                let (name, path) = (&actuator.name.value, path.trim_end_matches('/'));
                let message = ErrorCode::Attachment.of(format!(
                    "its own Execute alone commands a robot with blocks: `/{path}` can't command `{name}`"
                ));
                let help = "name a port of its Execute; make any other source of motion a ReactiveModel, or use teleoperation";
                collector.add(span, message, help);
            }
        }
    }
}
