//! Links that need not be written: types and roles of a robot's blocks determine them.
//!
//! An input of a block looks for outputs of its own robot's scope, and a block that meets the world also for those that a
//! simulator or driver outside offers for the robot of that name, whose type and role are its own. One is linked, several are an
//! error, and without one there is no link.

use slate_module::{Direction, PortDescription};

use super::block::{Block, COMMAND, MEASUREMENT, Provenance, TRUTH, binds, is_fact};
use super::{Surveyed, module, scope};
use crate::catalogue::Catalogue;
use crate::complaints::Complaints;
use slate_configuration::{Configuration, Link, Mistake};

/// Modules and ports that keep their links, also the absence of one.
pub struct LinkKeeping<'s> {
    /// Whether a module is there already.
    pub stays: &'s dyn Fn(&str) -> bool,
    /// The configuration until now. A port of which it said something, and now nothing is said, gets a link again.
    pub before: Option<&'s Configuration>,
}

impl LinkKeeping<'_> {
    /// Whether a port of a module without an inferred link stays without it, though these others fit.
    fn stays_open(&self, module: &str, (path, port): (&str, &PortDescription), found: &[String]) -> bool {
        let is_free = |before: &Configuration| {
            says_of(before, path, port) || found.iter().any(|other| before.is_left_out(other))
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
            if says_of(&fresh, &path, port) {
                continue;
            }
            let mut found = candidates(&fresh, &modules, surveyed, block, port);
            if port.direction == Direction::Outbox {
                // Inboxes that are to have no senders but those that are written.
                found.retain(|inbox| !fresh.is_left_out(inbox));
            }
            if has.is_none() && keeping.stays_open(name, (&path, port), &found) {
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

/// Whether a configuration says something of a port.
fn says_of(configuration: &Configuration, path: &str, port: &PortDescription) -> bool {
    match port.direction {
        Direction::Outbox => configuration.says_of_outbox(path),
        _ => configuration.says_of_port(path),
    }
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
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    surveyed: &Surveyed<'_>,
    block: Block,
    port: &PortDescription,
) -> Vec<String> {
    let reads = matches!(port.direction, Direction::Input | Direction::Queue);
    // Messages without a role go to whom the configuration says.
    if !reads && (port.direction != Direction::Outbox || port.role.is_empty())
        || port.role == TRUTH
        || is_fact(port)
    {
        return Vec::new();
    }
    let own = surveyed.module.name.value.as_str();
    let robot = scope(own);
    if block == Block::Actuator && port.role == COMMAND {
        return commands(configuration, modules, robot, port);
    }
    let mut found: Vec<LinkCandidate> = Vec::new();
    for other in modules.iter().filter(|other| other.module.name.value != own) {
        let name = other.module.name.value.as_str();
        let is_own = scope(name) == robot;
        let is_outside = block == Block::Sensor && scope(name).is_empty();
        if !is_own && !is_outside {
            continue;
        }
        if is_own && block == Block::Sensor && Block::of(&other.description).is_some() {
            // A Sensor reads devices, and no block that interprets them.
            continue;
        }
        for offered in &other.description.ports {
            let path = format!("{name}/{}", offered.name);
            // Outside of a robot, what is named after it.
            let is_named = || offered.name.strip_prefix(robot).is_some_and(|rest| rest.starts_with('/'));
            let fits = if reads {
                readable(configuration, (&path, is_own), block, port, other, offered)
            } else {
                takes(port, offered)
            };
            if fits && (is_own || is_named()) && offered.descriptor.hash == port.descriptor.hash {
                found.push(LinkCandidate {
                    path,
                    is_own,
                    is_sensor: offered.role == MEASUREMENT,
                    is_device: Block::of(&other.description).is_none(),
                    is_fact: is_fact(offered),
                });
            }
        }
    }
    // A device is read by its Sensor, and all others read that.
    if block == Block::Sensor && found.iter().any(|candidate| !candidate.is_own) {
        found.retain(|candidate| !candidate.is_own);
    } else if found.iter().any(|candidate| candidate.is_own && candidate.is_sensor) {
        found.retain(|candidate| candidate.is_own && !candidate.is_device);
    }
    if found.iter().any(|candidate| !candidate.is_fact) {
        found.retain(|candidate| !candidate.is_fact);
    }
    found.into_iter().map(|candidate| candidate.path).collect()
}

/// A port that another one could be linked to.
struct LinkCandidate {
    path: String,
    /// Whether it is of the same robot.
    is_own: bool,
    /// Whether a Sensor writes it.
    is_sensor: bool,
    /// Whether a module that is no block writes it.
    is_device: bool,
    /// Whether it is a fact of Knowledge, which is second to what is written for all.
    is_fact: bool,
}

/// Whether a port is one of those that an input of a block looks for.
fn readable(
    configuration: &Configuration,
    (path, is_own): (&str, bool),
    block: Block,
    port: &PortDescription,
    other: &Surveyed<'_>,
    offered: &PortDescription,
) -> bool {
    if is_fact(offered) {
        // A fact with an origin.
        return !binds(&port.role) && block != Block::Knowledge && configuration.says_of_port(path);
    }
    offered.direction == Direction::Output
        && if binds(&port.role) || port.role == MEASUREMENT {
            offered.role == port.role
        } else {
            matches!(offered.role.as_str(), "" | MEASUREMENT)
                && block.may_read(Provenance::of_port(&other.description, offered), is_own)
        }
}

/// Whether an inbox is one of those that an outbox looks for.
fn takes(port: &PortDescription, offered: &PortDescription) -> bool {
    offered.direction == Direction::Inbox && offered.role == port.role
}

/// The commands of a robot's gates that an Actuator could take.
fn commands(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    robot: &str,
    port: &PortDescription,
) -> Vec<String> {
    let carries = |path: &str| {
        modules.iter().any(|other| {
            let rest =
                path.strip_prefix(other.module.name.value.as_str()).and_then(|rest| rest.strip_prefix('/'));
            let ports = &other.description.ports;
            rest.is_some_and(|rest| {
                ports.iter().any(|own| own.name == rest && own.descriptor.hash == port.descriptor.hash)
            })
        })
    };
    let of_robot = configuration.actuators().iter().filter(|actuator| scope(&actuator.name.value) == robot);
    let fitting = of_robot
        .filter(|actuator| actuator.commands.iter().any(|command| carries(&command.value.path_in(""))));
    fitting.map(|actuator| format!("{}/command", actuator.name.value)).collect()
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
