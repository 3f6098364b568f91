//! Which ports are joined, and what becomes of values on the way.

mod fit;
mod remote;
mod sinks;
mod sources;
mod words;

use slate_blackboard::is_within;
use slate_module::PortDescription;

use super::{Complaints, Joint, Survey, Surveyed, Wire};
use crate::catalogue::Catalogue;
pub use remote::{elsewhere, path as remote_path};
use sinks::Sink;
use slate_configuration::Mistake;
use slate_configuration::{Configuration, Link};
use sources::Sources;

pub(super) fn survey_links<'a>(
    configuration: &'a Configuration,
    dormant: &[&'a str],
    catalogue: &Catalogue,
    survey: &mut Survey<'a>,
    complaints: &mut Complaints<'a>,
) {
    let own: Vec<Option<Sink>> = configuration
        .links()
        .iter()
        .map(|link| sinks::sink(configuration, survey, dormant, link, complaints))
        .collect();
    check_overlaps(configuration, &own, survey, complaints);
    survey.remote = remote::all(configuration, catalogue);
    survey.carriers.clone_from(&catalogue.carriers);
    survey.has_jpeg = catalogue.has_jpeg;
    let mut sources = Sources::new(configuration, dormant, survey, &own, complaints);
    let mut joints: Vec<_> = (0..own.len()).filter_map(|link| sources.joint(link)).collect();
    let Sources { absent, misfits, .. } = sources;
    joints.sort_by_cached_key(|joint| join(&survey.wire_path(joint.port.0, joint.port.1), &joint.field));
    survey.absent = absent;
    survey.misfits = misfits;
    survey.joints = joints;
}

/// Of the links that fill parts of one port, none may fill what another one fills.
fn check_overlaps<'a>(
    configuration: &'a Configuration,
    sinks: &[Option<Sink>],
    survey: &Survey<'a>,
    complaints: &mut Complaints<'a>,
) {
    for (i, sink) in sinks.iter().enumerate() {
        let Some(sink) = sink else { continue };
        let earlier = sinks[..i].iter().zip(configuration.links());
        let other = earlier.filter_map(|(other, link)| Some((other.as_ref()?, link))).find(|(other, _)| {
            (other.module, other.wire) == (sink.module, sink.wire)
                && (is_within(&other.field, &sink.field) || is_within(&sink.field, &other.field))
        });
        let Some((_, other)) = other else { continue };
        let name = &survey.modules[sink.module].module.name.value;
        let Link { to, from, .. } = &configuration.links()[i];
        if sink.sends {
            let message = format!("`{}` sends to `{}` already", from.value, other.to.value);
            complaints.add(from.span, Mistake::TwoSources.of(message), "an outbox sends to one inbox");
            continue;
        }
        let message = Mistake::TwoSources
            .of(format!("`{}` of `{name}` is linked already, by `{}`", to.value, other.to.value));
        complaints.add(to.span, message, "link each field once, or the whole input");
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

/// The port whose name begins a path in a module, and the rest, which is a field: the longest name wins, as names of ports
/// may have slashes. Without one, the first name of the path.
fn split_port<'p>(ports: &[PortDescription], path: &'p str) -> (&'p str, &'p str) {
    let names = ports.iter().map(|port| port.name.as_str());
    let longest = names.filter(|name| is_within(path, name)).map(str::len).max();
    match longest {
        Some(length) => (&path[..length], path[length..].trim_start_matches('/')),
        None => path.split_once('/').unwrap_or((path, "")),
    }
}

/// What a path that no port has is called: all of it, where names of ports begin like it.
fn deep_name<'p>(ports: &[PortDescription], first: &'p str, rest: &'p str) -> &'p str {
    let is_deep = ports.iter().any(|port| port.name != first && is_within(&port.name, first));
    if is_deep { rest } else { first }
}

/// A path and the path of a field below it.
fn join(path: &str, field: &str) -> String {
    if field.is_empty() { path.to_owned() } else { format!("{path}/{field}") }
}

/// Whether a port is about a service, and not about values.
fn is_service(port: &PortDescription) -> bool {
    use slate_module::Direction;
    matches!(port.direction, Direction::Aspect | Direction::Provider)
}

/// What to do about a link to a service.
const SERVICE: &str = "leave the link out: who needs a service finds the one that provides it";

/// How a port is called in messages.
fn wire_name<'s>(survey: &'s Survey<'_>, module: usize, wire: Wire) -> &'s str {
    match wire {
        Wire::Port(port) => &survey.modules[module].description.ports[port].name,
        Wire::Enabled => "enabled",
        Wire::Params => "params",
    }
}

impl Survey<'_> {
    /// The path of a port, or of what is linked like one.
    pub fn wire_path(&self, module: usize, wire: Wire) -> String {
        join(&self.modules[module].module.name.value, wire_name(self, module, wire))
    }
}

impl Joint<'_> {
    /// Whether the port is linked as a whole to a value of its own type.
    pub fn is_plain(&self) -> bool {
        matches!(self.way, super::Way::Plain)
    }
}
