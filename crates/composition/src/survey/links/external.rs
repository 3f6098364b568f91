//! Links to and from programs that are not agents: checks of the end in this agent.

use slate_blackboard::is_within;
use slate_configuration::{Configuration, ErrorCode, ExternalDirection, ExternalLink, Message};
use slate_module::role::FACT;
use slate_module::{Direction, PortDescription};

use super::messages::roles;
use super::sinks::LinkSink;
use super::sources::LinkSources;
use crate::diagnostic_collector::{DiagnosticCollector, suggest};
use crate::link::{FieldPlace, NoField};
use crate::survey::block::{Block, FACT_HELP, Provenance, binds, role_permits};
use crate::survey::names::{deep_name, owner, port_at, split_module, split_port};
use crate::survey::{LinkEnd, LinkSource, Survey};

/// Error of a link and help for the user.
type EndError = (Message, String);

/// Checks the links that fill inputs.
pub(super) fn check_arriving<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    dormant: &[&str],
    sinks: &[Option<LinkSink>],
    collector: &mut DiagnosticCollector<'a>,
) {
    let mut filled: Vec<(usize, usize, String, &str)> = Vec::new();
    for (sink, link) in sinks.iter().zip(configuration.links()) {
        if let Some(LinkSink { module, link_end: LinkEnd::Port(port), field, sends: false }) = sink {
            filled.push((*module, *port, field.clone(), &link.to.value));
        }
    }
    for link in configuration.external_links() {
        if link.direction != ExternalDirection::In {
            continue;
        }
        let (module, port, field) = match input(survey, dormant, link) {
            Ok(Some(found)) => found,
            Ok(None) => continue,
            Err((message, help)) => {
                collector.add(link.path.span, message, help);
                continue;
            }
        };
        let meets = |other: &&(usize, usize, String, &str)| {
            (other.0, other.1) == (module, port)
                && (is_within(&other.2, &field) || is_within(&field, &other.2))
        };
        if let Some((.., other)) = filled.iter().find(meets) {
            let message = format!("`{}` is linked already, by `{other}`", link.path.value);
            let help = "an input has one source: link each field once, or the whole input";
            collector.add(link.path.span, ErrorCode::TwoSources.of(message), help);
        }
        filled.push((module, port, field, &link.path.value));
    }
}

/// Returns the input and the field that a link fills.
/// `None` if its module is not loaded.
fn input(
    survey: &Survey<'_>,
    dormant: &[&str],
    link: &ExternalLink,
) -> Result<Option<(usize, usize, String)>, EndError> {
    let (path, from) = (&link.path.value, &link.other.value);
    let Some((module, rest)) = split_module(&survey.modules, path) else {
        if owner(dormant, path).is_some() {
            return Ok(None);
        }
        let names = survey.modules.iter().map(|surveyed| surveyed.module.name.value.as_str());
        return Err((ErrorCode::Name.of(format!("no module owns `{path}`")), suggest(path, names)));
    };
    let surveyed = &survey.modules[module];
    let (ports, own) = (&surveyed.description.ports, &surveyed.module.name.value);
    let (name, field) = split_port(ports, rest);
    if matches!(name, "enabled" | "params") {
        let message = format!("`{path}` can't follow `{from}`: only inputs do");
        return Err((ErrorCode::Ends.of(message), "link an input, or let the program set it".into()));
    }
    let reads = |port: &&PortDescription| matches!(port.direction, Direction::Input | Direction::Queue);
    let Some(at) = ports.iter().position(|port| port.name == name) else {
        let name = deep_name(ports, name, rest);
        let help = suggest(name, ports.iter().filter(reads).map(|port| port.name.as_str()));
        return Err((ErrorCode::Name.of(format!("`{own}` has no input `{name}`")), help));
    };
    let port = &ports[at];
    match port.direction {
        Direction::Input => {}
        Direction::Queue if field.is_empty() => {}
        Direction::Queue => {
            let message = format!("`{own}/{name}` takes whole values, and no fields of them");
            return Err((ErrorCode::Ends.of(message), "link the whole, or make it a plain input".into()));
        }
        Direction::Output | Direction::Debug => {
            let message = format!("`{path}` is an output, and a link names its destination first");
            return Err((ErrorCode::Ends.of(message), format!("write \"{from}\" = \"/{path}\"")));
        }
        _ => {
            let message = format!("`{path}` is not an input with values, as `{from}` has them");
            return Err((ErrorCode::Ends.of(message), "link an input or a queue input".into()));
        }
    }
    if !field.is_empty() {
        let place = FieldPlace::find(port.descriptor, field).map_err(|NoField { message, help }| {
            (ErrorCode::Name.of(format!("`/{path}`: {message}")), help)
        })?;
        if place.may_be_missing() {
            let message = format!("`{path}` is an item of a list, which may be shorter");
            return Err((ErrorCode::Ends.of(message), "link the whole list".into()));
        }
    }
    match attachment_refusal(survey, (module, at), path, &format!("`{from}`")) {
        Some(refusal) => Err(refusal),
        None => Ok(Some((module, at, field.to_owned()))),
    }
}

/// Returns the attachment rule that forbids another program as source of an input.
pub fn bridge_refusal(survey: &Survey<'_>, path: &str) -> Option<Message> {
    attachment_refusal(survey, port_at(survey, path)?, path, "another program").map(|(message, _)| message)
}

/// Returns the error for a port that may not read a source outside the agent.
/// Only drivers may; a robot's blocks read it through a Sensor. The message names the source as `from` does.
fn attachment_refusal(
    survey: &Survey<'_>,
    (module, port): (usize, usize),
    path: &str,
    from: &str,
) -> Option<EndError> {
    let description = &survey.modules[module].description;
    let role = description.ports[port].role.as_str();
    if binds(role) {
        let message = roles(path, role, from, ("", None));
        let help = "only Monitor -> Analyze -> Plan -> Execute can be attached, and reflexes to Execute";
        return Some((ErrorCode::Attachment.of(message), help.into()));
    }
    let origin = Provenance::Module;
    let block = Block::of(description)?;
    if block.may_read(origin, false) && role_permits(role, origin) {
        return None;
    }
    let message = format!("{}: `/{path}` can't read {from}, which is of no block", block.reads());
    let help = if role == FACT { FACT_HELP } else { block.help(origin) };
    Some((ErrorCode::Attachment.of(message), help.into()))
}

/// Checks the links that carry properties out.
pub(super) fn check_leaving(configuration: &Configuration, sources: &mut LinkSources<'_, '_>) {
    let links = configuration.external_links().iter();
    for link in links.filter(|link| link.direction == ExternalDirection::Out) {
        let (path, to, span) = (&link.path.value, &link.other.value, link.path.span);
        let Some((target, field)) = sources.end(span, path) else { continue };
        let refusal = if !field.is_empty() && !matches!(target, LinkSource::Absent(_)) {
            Some((
                format!("`{to}` receives whole values, and `/{path}` is a part of one"),
                "link the property",
            ))
        } else if sources.is_inbox(target) {
            Some((format!("`/{path}` receives messages, and has no value for `{to}`"), "link an output"))
        } else {
            None
        };
        if let Some((message, help)) = refusal {
            sources.report(span, ErrorCode::Ends.of(message), help);
        }
    }
}
