//! Links that need not be written: types and roles of a robot's blocks determine them.
//!
//! An input of a block looks for outputs of its own robot's scope, and a block that meets the world also for those that a
//! simulator or driver outside offers for the robot of that name, whose type and role are its own. One is linked, several are an
//! error, and without one there is no link.

use slate_module::{Description, Direction, PortDescription};

use super::{Surveyed, module, scope};
use crate::catalogue::Catalogue;
use crate::complaints::Complaints;
use slate_configuration::{Configuration, Link, Mistake};

/// Outputs of a simulator for referees and reports, not for the robot.
const FOR_REFEREES: [&str; 2] = ["truth", "clearance"];

/// A block of MAPE-K, as its ports show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    Monitor,
    Analyze,
    Plan,
    Execute,
    Knowledge,
    Reactive,
}

impl Block {
    fn of(description: &Description) -> Option<Self> {
        let has = |direction, role: &str| {
            description.ports.iter().any(|port| port.direction == direction && port.role == role)
        };
        if has(Direction::Output, "percept") {
            Some(Self::Monitor)
        } else if has(Direction::Output, "change") {
            Some(Self::Analyze)
        } else if has(Direction::Outbox, "plan") {
            Some(Self::Plan)
        } else if has(Direction::Inbox, "plan") {
            Some(Self::Execute)
        } else if has(Direction::Outbox, "reflex") {
            Some(Self::Reactive)
        } else {
            (description.unique == "knowledge").then_some(Self::Knowledge)
        }
    }

    /// Whether it reads sensors itself.
    fn meets_the_world(self) -> bool {
        !matches!(self, Self::Analyze | Self::Plan)
    }
}

/// What keeps the links that it has, also when that is none.
pub struct LinkKeeping<'s> {
    /// Whether a module is there already.
    pub stays: &'s dyn Fn(&str) -> bool,
    /// The configuration until now. A port of which it said something, and now nothing is said, gets a link again.
    pub before: Option<&'s Configuration>,
}

impl LinkKeeping<'_> {
    /// Whether a port of a module without an inferred link stays without it, though these others fit.
    fn stays_open(&self, module: &str, port: &str, found: &[String]) -> bool {
        let is_free = |before: &Configuration| {
            before.says_of_port(port) || found.iter().any(|other| before.is_left_out(other))
        };
        (self.stays)(module) && !self.before.is_some_and(is_free)
    }
}

/// A configuration with the links that are inferred for modules that arrive, and for ports of which nothing is said any
/// more; others keep what they have.
pub fn infer<'a>(
    configuration: &'a Configuration,
    catalogue: &Catalogue,
    keeping: &LinkKeeping<'_>,
    complaints: &mut Complaints<'a>,
) -> Configuration {
    let fresh =
        configuration.without_inferred(|port| !of_any(configuration, port).is_some_and(keeping.stays));
    if !configuration.modules().iter().any(|module| !scope(&module.name.value).is_empty()) {
        return fresh;
    }
    // Mistakes in modules are reported when they are surveyed.
    let mut unsaid = Complaints::new(configuration);
    let known = configuration.modules().iter().filter(|module| !catalogue.is_dormant(&module.kind.value));
    let modules: Vec<_> = known
        .filter_map(|module| module::survey_module(configuration, module, catalogue, &mut unsaid))
        .collect();
    let mut links = Vec::new();
    for surveyed in &modules {
        let name = surveyed.module.name.value.as_str();
        let Some(block) = Block::of(&surveyed.description).filter(|_| !scope(name).is_empty()) else {
            continue;
        };
        for port in &surveyed.description.ports {
            let path = format!("{name}/{}", port.name);
            let has = fresh.links().iter().find(|link| link.is_inferred() && has_port(link, &path, port));
            if fresh.says_of_port(&path) {
                continue;
            }
            let mut found = candidates(&modules, surveyed, block, port);
            if port.direction == Direction::Outbox {
                // Inboxes that are to have no senders but those that are written.
                found.retain(|inbox| !fresh.is_left_out(inbox));
            }
            if has.is_none() && keeping.stays_open(name, &path, &found) {
                continue;
            }
            match (&found[..], has) {
                ([], _) | ([_], Some(_)) => {}
                ([one], None) => links.extend(link(&path, one, port, surveyed)),
                (several, _) => ambiguous(surveyed, &path, port, several, complaints),
            }
        }
    }
    fresh.with_inferred(links)
}

/// The module that a port is of: the longest name.
fn of_any<'c>(configuration: &'c Configuration, port: &str) -> Option<&'c str> {
    let names = configuration.modules().iter().map(|module| module.name.value.as_str());
    names
        .filter(|name| port.strip_prefix(name).is_some_and(|rest| rest.starts_with('/')))
        .max_by_key(|name| name.len())
}

fn has_port(link: &Link, path: &str, port: &PortDescription) -> bool {
    match port.direction {
        Direction::Outbox => link.from.value.path_in("") == path,
        _ => link.to.value == path,
    }
}

fn link(path: &str, other: &str, port: &PortDescription, surveyed: &Surveyed<'_>) -> Option<Link> {
    let at = surveyed.module.name.span;
    match port.direction {
        Direction::Outbox => Link::inferred(other, path, true, at),
        _ => Link::inferred(path, other, false, at),
    }
}

/// The ports that one could be linked to by type and role.
fn candidates(
    modules: &[Surveyed<'_>],
    surveyed: &Surveyed<'_>,
    block: Block,
    port: &PortDescription,
) -> Vec<String> {
    let wanted: &[Direction] = match port.direction {
        Direction::Input | Direction::Queue => &[Direction::Output],
        // Messages without a role go to whom the configuration says.
        Direction::Outbox if !port.role.is_empty() => &[Direction::Inbox],
        _ => return Vec::new(),
    };
    let robot = scope(&surveyed.module.name.value);
    let fits = |other: &&PortDescription| {
        wanted.contains(&other.direction)
            && other.role == port.role
            && other.descriptor.hash == port.descriptor.hash
    };
    let mut found = Vec::new();
    for other in modules {
        let name = &other.module.name.value;
        let is_own = scope(name) == robot && *name != surveyed.module.name.value;
        let offers = |port: &&PortDescription| {
            let sensor = port.name.strip_prefix(robot).and_then(|rest| rest.strip_prefix('/'));
            sensor.is_some_and(|sensor| !FOR_REFEREES.contains(&sensor))
        };
        let ports = other.description.ports.iter().filter(fits);
        let ports =
            ports.filter(|port| is_own || block.meets_the_world() && scope(name).is_empty() && offers(port));
        found.extend(ports.map(|port| format!("{name}/{}", port.name)));
    }
    found
}

/// Refuses to choose.
fn ambiguous(
    surveyed: &Surveyed<'_>,
    path: &str,
    port: &PortDescription,
    several: &[String],
    complaints: &mut Complaints<'_>,
) {
    let what = if port.direction == Direction::Outbox { "send to" } else { "read" };
    let names: Vec<_> = several.iter().map(|name| format!("`{name}`")).collect();
    let lines: Vec<_> = several
        .iter()
        .map(|other| match port.direction {
            Direction::Outbox => format!("\"/{other}\" = \"/{path}\""),
            _ => format!("\"/{path}\" = \"/{other}\""),
        })
        .collect();
    let message = format!("`{path}` could {what} {}", names.join(" or "));
    let help = format!("write one of these links: {}; or \"/{path}\" = false", lines.join(", or "));
    complaints.add(surveyed.module.name.span, Mistake::Ends.of(message), help);
}
