//! Which ports are joined, and whether both ends fit.

use slate_module::{Direction, PortDescription};

use super::{Absent, Complaints, Joint, Survey, Surveyed, Target, Wire, suggest};
use crate::agent::parameters;
use crate::configuration::{Configuration, Link};

pub(super) fn survey_links<'a>(
    configuration: &'a Configuration,
    dormant: &[&'a str],
    survey: &mut Survey<'a>,
    complaints: &mut Complaints<'a>,
) {
    for link in configuration.links() {
        if let Some(agent) = link.from.value.agent().filter(|agent| *agent != configuration.agent_name()) {
            let message = format!("`{}` belongs to agent `{agent}`", link.from.value);
            complaints.add(
                link.from.span,
                message,
                format!("this agent is `{}`; links join its own ports", configuration.agent_name()),
            );
            continue;
        }
        let modules = &survey.modules;
        if split_module(modules, &link.to.value).is_none() && owner(dormant, &link.to.value).is_some() {
            continue;
        }
        let from = link.from.value.path_in("");
        let Some(port) = find_own_port(modules, link, complaints) else { continue };
        let absent = split_module(modules, &from).map_or_else(|| owner(dormant, &from), |_| None);
        let target = match absent {
            Some(module) => {
                let absent = Absent { path: from.clone(), module: module.into() };
                let known = survey.absent.iter().position(|other| *other == absent);
                Some(Target::Absent(known.unwrap_or_else(|| {
                    survey.absent.push(absent);
                    survey.absent.len() - 1
                })))
            }
            None => find_target(configuration, modules, link, &from, complaints),
        };
        let Some(target) = target else { continue };
        let joint = Joint { link, port, target };
        if check_joint(modules, &joint, &from, complaints) {
            survey.joints.push(joint);
        }
    }
}

/// The module whose name begins the path: the longest.
fn owner<'n>(names: &[&'n str], path: &str) -> Option<&'n str> {
    let owns = |name: &&&str| path.strip_prefix(**name).is_some_and(|rest| rest.starts_with('/'));
    names.iter().filter(owns).max_by_key(|name| name.len()).copied()
}

/// The module whose name begins the path, and the rest of the path: the longest name wins.
pub(super) fn split_module<'p>(modules: &[Surveyed<'_>], path: &'p str) -> Option<(usize, &'p str)> {
    let mut end = path.len();
    while let Some(slash) = path[..end].rfind('/') {
        if let Some(index) = modules.iter().position(|surveyed| surveyed.module.name.value == path[..slash]) {
            return Some((index, &path[slash + 1..]));
        }
        end = slash;
    }
    None
}

fn find_own_port<'a>(
    modules: &[Surveyed<'a>],
    link: &Link,
    complaints: &mut Complaints<'a>,
) -> Option<(usize, Wire)> {
    let to = &link.to.value;
    let Some((module, name)) = split_module(modules, to) else {
        let help = suggest(to, modules.iter().map(|surveyed| surveyed.module.name.value.as_str()));
        complaints.add(link.to.span, format!("no module owns `{to}`"), help);
        return None;
    };
    if name == "enabled" {
        return Some((module, Wire::Enabled));
    }
    let ports = &modules[module].description.ports;
    let linkable = |port: &&PortDescription| {
        matches!(port.direction, Direction::Input | Direction::Queue | Direction::Outbox)
    };
    match ports.iter().position(|port| port.name == name) {
        Some(port) if linkable(&&ports[port]) => Some((module, Wire::Port(port))),
        Some(port) if ports[port].direction == Direction::Inbox => {
            let help = "link each sender's outbox to it: \"sender/outbox\" = \"receiver/inbox\"";
            complaints.add(
                link.to.span,
                format!("`{to}` is an inbox, which any number of senders may share"),
                help,
            );
            None
        }
        Some(port) if is_service(&ports[port]) => {
            complaints.add(link.to.span, format!("`{to}` is a service"), SERVICE);
            None
        }
        Some(_) => {
            let help = "a link names the input first: \"reader/input\" = \"writer/output\"";
            complaints.add(link.to.span, format!("`{to}` is an output"), help);
            None
        }
        None => {
            let help = suggest(name, ports.iter().filter(linkable).map(|port| port.name.as_str()));
            complaints.add(
                link.to.span,
                format!("`{}` has no port `{name}`", modules[module].module.name.value),
                help,
            );
            None
        }
    }
}

/// Whether a port is about a service, and not about values.
fn is_service(port: &PortDescription) -> bool {
    matches!(port.direction, Direction::Aspect | Direction::Provider)
}

/// What to do about a link to a service.
const SERVICE: &str = "leave the link out: who needs a service finds the one that provides it";

fn find_target<'a>(
    configuration: &Configuration,
    modules: &[Surveyed<'a>],
    link: &Link,
    from: &str,
    complaints: &mut Complaints<'a>,
) -> Option<Target> {
    let command = configuration.actuators().iter().position(|actuator| {
        from.strip_prefix(actuator.name.value.as_str()).is_some_and(|rest| rest == "/command")
    });
    if let Some(actuator) = command {
        return Some(Target::Command(actuator));
    }
    let Some((module, name)) = split_module(modules, from) else {
        let actuators = configuration.actuators().iter().map(|actuator| actuator.name.value.as_str());
        let names: Vec<_> =
            modules.iter().map(|surveyed| surveyed.module.name.value.as_str()).chain(actuators).collect();
        let help = suggest(from, names.iter().copied());
        complaints.add(link.from.span, format!("nothing is called `/{from}`"), help);
        return None;
    };
    let ports = &modules[module].description.ports;
    let source = |port: &&PortDescription| {
        !is_service(port)
            && !matches!(port.direction, Direction::Input | Direction::Queue | Direction::Outbox)
    };
    if ports.iter().any(|port| port.name == name && port.direction == Direction::Command) {
        let help = "link to the command that passed its gate: `<actuator>/command`";
        complaints.add(link.from.span, format!("`/{from}` is a command that has not passed its gate"), help);
        return None;
    }
    match ports.iter().position(|port| port.name == name) {
        Some(port) if source(&&ports[port]) => Some(Target::Port(module, port)),
        Some(port) if is_service(&ports[port]) => {
            complaints.add(link.from.span, format!("`/{from}` is a service"), SERVICE);
            None
        }
        Some(_) => {
            complaints.add(
                link.from.span,
                format!("`/{from}` is itself an input"),
                "link to the output that it reads",
            );
            None
        }
        None => {
            let help = suggest(name, ports.iter().filter(source).map(|port| port.name.as_str()));
            complaints.add(
                link.from.span,
                format!("`{}` has no output `{name}`", modules[module].module.name.value),
                help,
            );
            None
        }
    }
}

/// Types, roles and directions of both ends.
fn check_joint<'a>(
    modules: &[Surveyed<'a>],
    joint: &Joint<'_>,
    from: &str,
    complaints: &mut Complaints<'a>,
) -> bool {
    let (to, link) = (&joint.link.to.value, joint.link);
    let (module, Wire::Port(port)) = joint.port else {
        let fits = match joint.target {
            Target::Port(m, p) => {
                modules[m].description.ports[p].descriptor.hash == parameters::enabled_descriptor().hash
            }
            Target::Command(_) => false,
            Target::Absent(_) => true,
        };
        if !fits {
            complaints.add(
                link.from.span,
                format!("`{to}` takes an Enabled"),
                "link it to an output of that interface",
            );
        }
        return fits;
    };
    let own = &modules[module].description.ports[port];
    let Target::Port(target_module, target_port) = joint.target else {
        // The interface of what is absent is checked when it comes, and an actuator's is that of its commanders.
        return matches!(joint.target, Target::Absent(_)) || own.direction == Direction::Input || {
            complaints.add(
                link.to.span,
                format!("`{to}` can't take an actuator's command"),
                "link a plain input to it",
            );
            false
        };
    };
    let target = &modules[target_module].description.ports[target_port];
    let messages = (own.direction == Direction::Outbox, target.direction == Direction::Inbox);
    if messages.0 != messages.1 {
        let (message, help) = if messages.0 {
            (format!("`{to}` sends messages, but `/{from}` is a value"), "link an outbox to an inbox")
        } else {
            (format!("`/{from}` receives messages, but `{to}` reads a value"), "link an input to an output")
        };
        complaints.add(link.from.span, message, help);
        return false;
    }
    if own.descriptor.hash != target.descriptor.hash {
        let message = if own.descriptor.name == target.descriptor.name {
            format!(
                "`{to}` and `/{from}` are different versions of {}: {:016x} and {:016x}",
                own.descriptor.name, own.descriptor.hash, target.descriptor.hash
            )
        } else {
            format!("`{to}` is {} but `/{from}` is {}", own.descriptor.name, target.descriptor.name)
        };
        complaints.add(link.from.span, message, "both ends of a link carry the same interface");
        return false;
    }
    if own.role != target.role {
        let name = |role: &str| if role.is_empty() { "plain".to_owned() } else { format!("a {role}") };
        let message = format!("`{to}` is {} but `/{from}` is {}", name(&own.role), name(&target.role));
        let help = "only Monitor -> Analyze -> Plan -> Execute can be attached, and reflexes to Execute";
        complaints.add(link.from.span, message, help);
        return false;
    }
    true
}
