//! What a link fills.

use slate_module::{Direction, PortDescription};

use super::{SERVICE, is_service, owner, split_module, split_port};
use crate::survey::{Complaints, Survey, Wire, suggest};
use slate_configuration::Link;
use slate_configuration::Mistake;

/// What a link fills: a port, or a field of it.
#[derive(Clone, Debug)]
pub(super) struct Sink {
    pub module: usize,
    pub wire: Wire,
    pub field: String,
}

/// Finds it; nothing when it is of a module that is not loaded, or after a complaint.
pub(super) fn sink<'a>(
    survey: &Survey<'a>,
    dormant: &[&str],
    link: &Link,
    complaints: &mut Complaints<'a>,
) -> Option<Sink> {
    let (to, modules) = (&link.to.value, &survey.modules);
    let Some((module, rest)) = split_module(modules, to) else {
        if owner(dormant, to).is_none() {
            let help = suggest(to, modules.iter().map(|surveyed| surveyed.module.name.value.as_str()));
            complaints.add(link.to.span, Mistake::Name.of(format!("no module owns `{to}`")), help);
        }
        return None;
    };
    let (name, field) = split_port(&modules[module].description.ports, rest);
    let sink = |wire| Some(Sink { module, wire, field: field.to_owned() });
    let own = &modules[module].module.name.value;
    match name {
        "enabled" if matches!(field, "" | "value") => {
            return Some(Sink { module, wire: Wire::Enabled, field: String::new() });
        }
        "params" if !field.is_empty() => return sink(Wire::Params),
        "params" => {
            let names =
                modules[module].description.parameters.iter().map(|parameter| parameter.name.as_str());
            let help = format!("link one of them: {}", names.collect::<Vec<_>>().join(", "));
            complaints.add(
                link.to.span,
                Mistake::Ends.of(format!("`{to}` is all parameters of `{own}`")),
                help,
            );
            return None;
        }
        _ => {}
    }
    let ports = &modules[module].description.ports;
    let linkable = |port: &&PortDescription| {
        matches!(port.direction, Direction::Input | Direction::Queue | Direction::Outbox)
    };
    let Some(at) = ports.iter().position(|port| port.name == name) else {
        let help = suggest(name, ports.iter().filter(linkable).map(|port| port.name.as_str()));
        complaints.add(link.to.span, Mistake::Name.of(format!("`{own}` has no port `{name}`")), help);
        return None;
    };
    let (message, help) = match &ports[at] {
        port if port.direction == Direction::Input || linkable(&port) && field.is_empty() => {
            return sink(Wire::Port(at));
        }
        port if linkable(&port) => (
            format!("`{own}/{name}` takes whole values, and no fields of them"),
            "link the whole, or make it a plain input",
        ),
        port if port.direction == Direction::Inbox => (
            format!("`{to}` is an inbox, which any number of senders may share"),
            "link each sender's outbox to it: \"sender/outbox\" = \"receiver/inbox\"",
        ),
        port if is_service(port) => (format!("`{to}` is a service"), SERVICE),
        _ => (
            format!("`{to}` is an output"),
            "a link names the input first: \"reader/input\" = \"writer/output\"",
        ),
    };
    complaints.add(link.to.span, Mistake::Ends.of(message), help);
    None
}
