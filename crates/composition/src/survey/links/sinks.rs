//! Ports of this agent that links belong to.
//! A sink is the input that a link fills, or the outbox whose messages it carries.

use slate_blackboard::Url;
use slate_module::{Direction, PortDescription};

use super::missing_slash::without_slash;
use crate::diagnostic_collector::{DiagnosticCollector, suggest};
use crate::survey::names::{SERVICE, deep_name, is_service, owner, split_module, split_port};
use crate::survey::{LinkEnd, Survey};
use slate_configuration::{Configuration, ErrorCode, Link, Message, Span};

/// End of a link in this agent: an input, a field of one, or an outbox.
#[derive(Clone, Debug)]
pub(super) struct LinkSink {
    pub module: usize,
    pub link_end: LinkEnd,
    pub field: String,
    /// Flag of an outbox: the link leads from it to an inbox.
    pub sends: bool,
}

impl LinkSink {
    /// Returns the other end of the link and its place in the configuration.
    pub fn far(&self, link: &Link) -> (Url, Span) {
        match link.destination().filter(|_| self.sends) {
            Some(inbox) => (inbox, link.to.span),
            None => (link.from.value.clone(), link.from.span),
        }
    }
}

/// Finds the port that a link belongs to.
/// `None` if its module is not loaded, or after an error.
pub(super) fn sink<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    dormant: &[&str],
    link: &'a Link,
    collector: &mut DiagnosticCollector<'a>,
) -> Option<LinkSink> {
    let (to, modules) = (&link.to.value, &survey.modules);
    // A mailbox stands there in the place of a module that does not run.
    let is_played = survey.played.iter().any(|played| played.is_mailbox && played.path == *to);
    if is_played || link.destination().is_some_and(|url| url.agent().is_some()) {
        return sender(survey, dormant, link, collector);
    }
    let Some((module, rest)) = split_module(modules, to) else {
        if owner(dormant, to).is_some() {
            // Its kind is known once its module is loaded; an outbox here means an inbox there.
            return outbox(survey, link).ok();
        }
        let (message, help) = unowned(configuration, survey, link);
        collector.add(link.to.span, message, help);
        return None;
    };
    let (name, field) = split_port(&modules[module].description.ports, rest);
    let sink = |link_end| Some(LinkSink { module, link_end, field: field.to_owned(), sends: false });
    let own = &modules[module].module.name.value;
    match name {
        "enabled" if matches!(field, "" | "value") => {
            return Some(LinkSink { module, link_end: LinkEnd::Enabled, field: String::new(), sends: false });
        }
        "params" if !field.is_empty() => return sink(LinkEnd::Params),
        "params" => {
            let names =
                modules[module].description.parameters.iter().map(|parameter| parameter.name.as_str());
            let help = format!("link one of them: {}", names.collect::<Vec<_>>().join(", "));
            collector.add(
                link.to.span,
                ErrorCode::Ends.of(format!("`{to}` is all parameters of `{own}`")),
                help,
            );
            return None;
        }
        _ => {}
    }
    let ports = &modules[module].description.ports;
    let linkable = |port: &&PortDescription| {
        matches!(port.direction, Direction::Input | Direction::Queue | Direction::Inbox)
    };
    let Some(at) = ports.iter().position(|port| port.name == name) else {
        let name = deep_name(ports, name, rest);
        let help = suggest(name, ports.iter().filter(linkable).map(|port| port.name.as_str()));
        collector.add(link.to.span, ErrorCode::Name.of(format!("`{own}` has no port `{name}`")), help);
        return None;
    };
    if ports[at].direction == Direction::Inbox && field.is_empty() {
        return sender(survey, dormant, link, collector);
    }
    let (message, help) = match &ports[at] {
        port if port.direction == Direction::Input || linkable(&port) && field.is_empty() => {
            return sink(LinkEnd::Port(at));
        }
        port if linkable(&port) => (
            format!("`{own}/{name}` takes whole values, and no fields of them"),
            "link the whole, or make it a plain input".to_owned(),
        ),
        port if is_service(port) => (format!("`{to}` is a service"), SERVICE.to_owned()),
        port => {
            let what = if port.direction == Direction::Outbox { "sends messages" } else { "is an output" };
            let message = format!("`{to}` {what}, and a link names its destination first");
            (message, format!("write {}", swapped_line(configuration, survey, link)))
        }
    };
    collector.add(link.to.span, ErrorCode::Ends.of(message), help);
    None
}

/// Returns the error and the help for a destination that belongs to no module.
fn unowned<'a>(configuration: &'a Configuration, survey: &Survey<'a>, link: &'a Link) -> (Message, String) {
    let to = &link.to.value;
    let is_of = |name: &str| to.strip_prefix(name) == Some("/command");
    if configuration.actuators().iter().any(|actuator| is_of(&actuator.name.value)) {
        let message = format!("`{to}` is the command of an actuator, and a link names its destination first");
        let right = swapped_line(configuration, survey, link);
        return (ErrorCode::Ends.of(message), format!("destination = source: did you mean {right}?"));
    }
    let names = survey.modules.iter().map(|surveyed| surveyed.module.name.value.as_str());
    let help = without_slash(configuration, survey, link.to.span, to).unwrap_or_else(|| suggest(to, names));
    (ErrorCode::Name.of(format!("no module owns `{to}`")), help)
}

/// Returns the outbox whose messages an inbox takes.
fn sender<'a>(
    survey: &Survey<'a>,
    dormant: &[&str],
    link: &'a Link,
    collector: &mut DiagnosticCollector<'a>,
) -> Option<LinkSink> {
    let (to, from, span) = (&link.to.value, &link.from.value, link.from.span);
    let path = from.path_in("");
    let inbox = link.destination();
    if let (Some(agent), Some(other)) = (from.agent(), inbox.as_ref().and_then(Url::agent)) {
        let message = format!("`{to}` belongs to agent `{other}`, and `{from}` to agent `{agent}`");
        let help =
            format!("a link belongs to the agent that reads or sends: --agent {other}, or --agent {agent}");
        collector.add(span, ErrorCode::OtherAgent.of(message), help);
        return None;
    }
    if let Some(agent) = from.agent() {
        let message = format!("`{to}` is an inbox, and its sender belongs to agent `{agent}`");
        let help =
            format!("write the link in the configuration of `{agent}`, with this agent's inbox in front");
        collector.add(span, ErrorCode::OtherAgent.of(message), help);
        return None;
    }
    let refusal = match outbox(survey, link) {
        Ok(sink) => return Some(sink),
        Err(refusal) => refusal,
    };
    if owner(dormant, &path).is_none() {
        collector.add(span, refusal.0, refusal.1);
    }
    None
}

/// Returns the outbox that a link names as its source.
/// The error names the port found instead and gives help.
fn outbox(survey: &Survey<'_>, link: &Link) -> Result<LinkSink, (Message, String)> {
    let (to, path) = (&link.to.value, link.from.value.path_in(""));
    let Some((module, rest)) = split_module(&survey.modules, &path) else {
        let names = survey.modules.iter().map(|surveyed| surveyed.module.name.value.as_str());
        return Err((ErrorCode::Name.of(format!("nothing is called `/{path}`")), suggest(&path, names)));
    };
    let ports = &survey.modules[module].description.ports;
    let (name, field) = split_port(ports, rest);
    let outboxes = || ports.iter().filter(|port| port.direction == Direction::Outbox);
    match ports.iter().position(|port| port.name == name) {
        Some(port) if ports[port].direction == Direction::Outbox && field.is_empty() => {
            Ok(LinkSink { module, link_end: LinkEnd::Port(port), field: String::new(), sends: true })
        }
        Some(_) => {
            let inbox = link.destination().filter(|url| url.agent().is_some());
            Err(match inbox.as_ref().and_then(|url| url.agent()) {
                Some(agent) => {
                    let message =
                        format!("`{to}` belongs to agent `{agent}`, and `/{path}` is not an outbox");
                    let help = "write the link in the configuration of that agent; only messages are sent there from here";
                    (ErrorCode::OtherAgent.of(message), help.into())
                }
                None => {
                    let message = format!("`{to}` receives messages, but `/{path}` is a value");
                    (ErrorCode::Ends.of(message), "link an outbox to an inbox".into())
                }
            })
        }
        None => {
            let own = &survey.modules[module].module.name.value;
            let help = suggest(name, outboxes().map(|port| port.name.as_str()));
            Err((ErrorCode::Name.of(format!("`{own}` has no outbox `{name}`")), help))
        }
    }
}

/// Returns the correct line for a link with swapped ends.
/// It lists all senders to the same inbox.
fn swapped_line<'a>(configuration: &'a Configuration, survey: &Survey<'a>, link: &'a Link) -> String {
    let sends = |link: &&Link| {
        let port = split_module(&survey.modules, &link.to.value);
        port.is_some_and(|(module, name)| {
            let ports = &survey.modules[module].description.ports;
            ports.iter().any(|port| port.name == name && port.direction == Direction::Outbox)
        })
    };
    let same = |other: &&Link| sends(&link) && sends(other) && other.from.value == link.from.value;
    let senders: Vec<_> =
        configuration.links().iter().filter(same).map(|link| written(configuration, link.to.span)).collect();
    let source = match &senders[..] {
        [] | [_] => written(configuration, link.to.span),
        _ => format!("[{}]", senders.join(", ")),
    };
    format!("{} = {source}", written(configuration, link.from.span))
}

/// Returns a name as written, in quotes.
fn written(configuration: &Configuration, span: Span) -> String {
    let text = configuration.text_at(span).trim();
    if text.starts_with(['"', '\'']) { text.to_owned() } else { format!("\"{text}\"") }
}
