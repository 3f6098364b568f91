//! Names in a path: modules, their ports, and fields.

use slate_blackboard::is_within;
use slate_module::{Direction, PortDescription};

use super::{Survey, Surveyed, scope};

/// Returns the module with the longest name that begins the path.
pub(super) fn owner<'n>(names: &[&'n str], path: &str) -> Option<&'n str> {
    let owns = |name: &&&str| path.strip_prefix(**name).is_some_and(|rest| rest.starts_with('/'));
    names.iter().filter(owns).max_by_key(|name| name.len()).copied()
}

/// Splits a path into the module with the longest matching name and the rest.
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

/// Splits a path in a module into the name of a port and a field.
/// The longest matching name wins, as names of ports may have slashes. If no port matches, the name is that before the
/// first slash.
pub(super) fn split_port<'p>(ports: &[PortDescription], path: &'p str) -> (&'p str, &'p str) {
    let names = ports.iter().map(|port| port.name.as_str());
    let longest = names.filter(|name| is_within(path, name)).map(str::len).max();
    match longest {
        Some(length) => (&path[..length], path[length..].trim_start_matches('/')),
        None => path.split_once('/').unwrap_or((path, "")),
    }
}

/// Returns the module and the port that a path belongs to.
pub fn port_at(survey: &Survey<'_>, path: &str) -> Option<(usize, usize)> {
    let (module, rest) = split_module(&survey.modules, path)?;
    let ports = &survey.modules[module].description.ports;
    let name = split_port(ports, rest).0;
    Some((module, ports.iter().position(|port| port.name == name)?))
}

/// Returns the name of a missing port for messages.
/// It is the whole path if names of ports begin with its first part.
pub(super) fn deep_name<'p>(ports: &[PortDescription], first: &'p str, rest: &'p str) -> &'p str {
    let is_deep = ports.iter().any(|port| port.name != first && is_within(&port.name, first));
    if is_deep { rest } else { first }
}

/// Joins a path and the path of a field below it.
pub(super) fn join(path: &str, field: &str) -> String {
    if field.is_empty() { path.to_owned() } else { format!("{path}/{field}") }
}

/// Returns whether a port is one of services and not of values.
pub(super) fn is_service(port: &PortDescription) -> bool {
    matches!(port.direction, Direction::Aspect | Direction::Provider)
}

/// Help for a link to a service.
pub(super) const SERVICE: &str = "leave the link out: services are connected to their users without links";

/// Returns the matching ports of modules of the same robot.
pub(super) fn in_scope(
    survey: &Survey<'_>,
    module: usize,
    fits: impl Fn(&PortDescription) -> bool,
) -> Vec<String> {
    let robot = scope(&survey.modules[module].module.name.value);
    let own = survey.modules.iter().filter(|surveyed| scope(&surveyed.module.name.value) == robot);
    own.flat_map(|surveyed| {
        let ports = surveyed.description.ports.iter().filter(|port| fits(port));
        ports.map(|port| format!("{}/{}", surveyed.module.name.value, port.name)).collect::<Vec<_>>()
    })
    .collect()
}

/// Returns the configuration line of a suitable link.
pub(super) fn line(to: &str, from: &str) -> String {
    format!("write \"/{to}\" = \"/{from}\"")
}
