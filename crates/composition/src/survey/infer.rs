//! Inference of links from the types and roles of a robot's blocks.
//!
//! An input of a block is linked to an output of the same type and role in its own robot's scope. A block with access
//! to the world also considers outputs that a simulator or driver outside offers for the robot of that name. A single
//! candidate is linked, several are an error, and without one no link is made.

use slate_module::role::{
    ACTUATOR_STATUS, COMMAND, DRIVER_STATUS, GATE_STATE, MEASUREMENT, PERCEPT, RULE, TRUTH,
};
use slate_module::{Direction, PortDescription};
use slate_sorted::SortedSet;

use super::block::{Block, Provenance, binds, is_fact, is_percept, is_sensed};
use super::names::split_module;
use super::{Surveyed, duplicates, module, scope};
use crate::catalogue::Catalogue;
use crate::diagnostic_collector::DiagnosticCollector;
use slate_configuration::{Configuration, ErrorCode, Link};

/// Selection of modules and ports that keep their links, or the lack of one.
pub struct LinkKeeping<'s> {
    /// Predicate for modules that are already loaded.
    pub keeps_links: &'s dyn Fn(&str) -> bool,
    /// Previous configuration.
    /// A port that it configured and the new one does not gets an inferred link again.
    pub before: Option<&'s Configuration>,
}

impl LinkKeeping<'_> {
    /// Returns whether a port without an inferred link stays unlinked despite `found`.
    /// `found` are the ports that fit it.
    fn stays_unlinked(&self, module: &str, (path, port): (&str, &PortDescription), found: &[String]) -> bool {
        let is_free = |before: &Configuration| {
            is_mentioned(before, path, port) || found.iter().any(|other| before.is_left_out(other))
        };
        (self.keeps_links)(module) && !self.before.is_some_and(is_free)
    }
}

/// A configuration with inferred links.
pub struct Inferred {
    /// The configuration.
    pub configuration: Configuration,
    /// Ports with several possible links.
    pub undecided: SortedSet<String>,
}

/// Adds inferred links for new modules and for ports that are no longer configured.
/// Other links stay unchanged.
pub fn infer<'a>(
    configuration: &'a Configuration,
    catalogue: &Catalogue,
    keeping: &LinkKeeping<'_>,
    collector: &mut DiagnosticCollector<'a>,
) -> Inferred {
    let fresh = configuration
        .without_inferred(|port| !module_of(configuration, port).is_some_and(keeping.keeps_links));
    if !configuration.modules().iter().any(|module| !scope(&module.name.value).is_empty()) {
        return Inferred { configuration: fresh, undecided: SortedSet::new() };
    }
    // Errors in modules are reported when they are surveyed.
    let mut ignored = DiagnosticCollector::new(configuration);
    let known = configuration.modules().iter().filter(|module| !catalogue.is_dormant(&module.kind.value));
    let modules: Vec<_> = known
        .filter_map(|module| module::survey_module(configuration, module, catalogue, &mut ignored))
        .collect();
    // A second one of what a robot has once is refused, and nothing is linked to it.
    let duplicates: SortedSet<usize> =
        duplicates(configuration, &modules).into_iter().map(|(_, duplicate)| duplicate).collect();
    let modules: Vec<_> = modules
        .into_iter()
        .enumerate()
        .filter(|(at, _)| !duplicates.contains(at))
        .map(|(_, own)| own)
        .collect();
    let (mut links, mut choices) = (Vec::new(), Vec::new());
    for surveyed in &modules {
        let name = surveyed.module.name.value.as_str();
        let Some(block) = Block::of(&surveyed.description).filter(|_| !scope(name).is_empty()) else {
            continue;
        };
        for port in &surveyed.description.ports {
            let path = format!("{name}/{}", port.name);
            let present = fresh.links().iter().find(|link| link.is_inferred() && has_port(link, &path, port));
            if is_mentioned(&fresh, &path, port) {
                continue;
            }
            let mut found = candidates(&fresh, &modules, surveyed, block, port);
            if port.direction == Direction::Outbox {
                // Inboxes that are to have no senders but those that are written.
                found.retain(|inbox| !fresh.is_left_out(inbox));
            }
            if present.is_none() && keeping.stays_unlinked(name, (&path, port), &found) {
                continue;
            }
            match (&found[..], present) {
                ([], _) | ([_], Some(_)) => {}
                ([one], None) => links.extend(link(&path, one, port, surveyed)),
                (_, _) => choices.push(LinkChoice { surveyed, path, direction: port.direction, found }),
            }
        }
    }
    let undecided = choices.iter().map(|choice| choice.path.clone()).collect();
    refuse_choices(&modules, choices, collector);
    Inferred { configuration: fresh.with_inferred(links), undecided }
}

/// Returns whether a configuration mentions a port.
fn is_mentioned(configuration: &Configuration, path: &str, port: &PortDescription) -> bool {
    match port.direction {
        Direction::Outbox => configuration.says_of_outbox(path),
        _ => configuration.says_of_port(path),
    }
}

/// Returns the module of a port: the longest matching name.
fn module_of<'c>(configuration: &'c Configuration, port: &str) -> Option<&'c str> {
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

/// Returns the ports that match a port by type and role.
fn candidates(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    surveyed: &Surveyed<'_>,
    block: Block,
    port: &PortDescription,
) -> Vec<String> {
    let reads = matches!(port.direction, Direction::Input | Direction::Queue);
    // The configuration names the receivers of messages without a role.
    if !reads && (port.direction != Direction::Outbox || port.role.is_empty())
        || port.role == TRUTH
        || is_fact(port)
    {
        return Vec::new();
    }
    let own = surveyed.module.name.value.as_str();
    let robot = scope(own);
    match (block, port.role.as_str()) {
        (Block::Actuator, COMMAND) => return commands(configuration, modules, robot, port),
        (Block::Actuator, GATE_STATE) => {
            let gate = gate_of(configuration, modules, surveyed);
            return gate.map(|gate| format!("{gate}/gate")).into_iter().collect();
        }
        (Block::Actuator, DRIVER_STATUS) => return driver_status(configuration, modules, own, port),
        (Block::Knowledge, ACTUATOR_STATUS) => return actuator_status(configuration, modules, robot, port),
        _ => {}
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
                accepts(port, offered)
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

/// Candidate for a link of a port.
struct LinkCandidate {
    path: String,
    /// Membership of the same robot.
    is_own: bool,
    /// Flag of an output of a Sensor.
    is_sensor: bool,
    /// Flag of an output of a module that is not a block.
    is_device: bool,
    /// Flag of a fact of Knowledge.
    /// Outputs that all may read take precedence over it.
    is_fact: bool,
}

/// Returns whether a port is a candidate for an input of a block.
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
        let may_read = block.may_read(Provenance::Block(Block::Knowledge), is_own);
        return !binds(&port.role)
            && block != Block::Knowledge
            && may_read
            && configuration.says_of_port(path);
    }
    if port.role == PERCEPT {
        return is_percept(offered);
    }
    offered.direction == Direction::Output
        && if is_sensed(&port.role) {
            offered.role == MEASUREMENT
        } else if binds(&port.role) {
            offered.role == port.role
        } else {
            matches!(offered.role.as_str(), "" | MEASUREMENT | RULE)
                && block.may_read(Provenance::of_port(&other.description, offered), is_own)
        }
}

/// Returns whether an inbox is a candidate for an outbox.
fn accepts(port: &PortDescription, offered: &PortDescription) -> bool {
    offered.direction == Direction::Inbox && offered.role == port.role
}

/// Returns the commands of a robot's gates that an Actuator could take.
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

/// Returns the gate whose command an Actuator takes, or would take.
fn gate_of(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    actuator: &Surveyed<'_>,
) -> Option<String> {
    let own = actuator.module.name.value.as_str();
    let port = actuator.description.ports.iter().find(|port| port.role == COMMAND)?;
    let path = format!("{own}/{}", port.name);
    let link = configuration.links().iter().find(|link| link.to.value == path);
    let command = match link {
        Some(link) => link.from.value.path_in(""),
        None if configuration.says_of_port(&path) => return None,
        None => <[String; 1]>::try_from(commands(configuration, modules, scope(own), port))
            .ok()?
            .into_iter()
            .next()?,
    };
    let gate = command.strip_suffix("/command")?;
    configuration.actuators().iter().any(|actuator| actuator.name.value == gate).then(|| gate.to_owned())
}

/// Returns the status outputs of the drivers that read an output of an Actuator.
fn driver_status(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    actuator: &str,
    port: &PortDescription,
) -> Vec<String> {
    let is_of = |link: &Link| {
        let from = link.from.value.path_in("");
        from.strip_prefix(actuator).is_some_and(|rest| rest.starts_with('/'))
    };
    let drivers = configuration.links().iter().filter(|link| is_of(link));
    let mut found = Vec::new();
    for (driver, input) in drivers.filter_map(|link| split_module(modules, &link.to.value)) {
        let driver = &modules[driver];
        // A driver of several robots names its ports after them.
        let robot = input.rsplit_once('/').map_or("", |(robot, _)| robot);
        let fits = driver.description.ports.iter().filter(|own| {
            own.direction == Direction::Output
                && own.role == port.role
                && own.descriptor.hash == port.descriptor.hash
                && own.name.rsplit_once('/').map_or("", |(robot, _)| robot) == robot
        });
        found.extend(fits.map(|own| format!("{}/{}", driver.module.name.value, own.name)));
    }
    found.sort();
    found.dedup();
    found
}

/// Returns the status outputs of the Actuator behind the gate named like the port.
/// The port is one of Knowledge.
fn actuator_status(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    robot: &str,
    port: &PortDescription,
) -> Vec<String> {
    let of_robot = modules.iter().filter(|other| scope(&other.module.name.value) == robot);
    let mut found = Vec::new();
    for actuator in of_robot.filter(|other| Block::of(&other.description) == Some(Block::Actuator)) {
        let gate = gate_of(configuration, modules, actuator);
        if gate.is_none_or(|gate| gate.rsplit('/').next() != Some(port.name.as_str())) {
            continue;
        }
        let fits = actuator.description.ports.iter().filter(|own| {
            own.direction == Direction::Output
                && own.role == port.role
                && own.descriptor.hash == port.descriptor.hash
        });
        found.extend(fits.map(|own| format!("{}/{}", actuator.module.name.value, own.name)));
    }
    found
}

/// Port with several possible links.
struct LinkChoice<'s, 'a> {
    surveyed: &'s Surveyed<'a>,
    path: String,
    direction: Direction,
    /// The other ends.
    found: Vec<String>,
}

impl LinkChoice<'_, '_> {
    /// Returns the configuration line of the link to one of them.
    fn line(&self, other: &str) -> String {
        match self.direction {
            Direction::Outbox => format!("\"/{other}\" = \"/{}\"", self.path),
            _ => format!("\"/{}\" = \"/{other}\"", self.path),
        }
    }
}

/// Reports ambiguous ports: one diagnostic for all ports with the same candidates.
fn refuse_choices(
    modules: &[Surveyed<'_>],
    mut choices: Vec<LinkChoice<'_, '_>>,
    collector: &mut DiagnosticCollector<'_>,
) {
    while !choices.is_empty() {
        let first = choices.remove(0);
        let is_same =
            |other: &LinkChoice<'_, '_>| other.found == first.found && other.direction == first.direction;
        let (same, others) = choices.into_iter().partition(is_same);
        choices = others;
        let sends = first.direction == Direction::Outbox;
        if same.is_empty() {
            let names: Vec<_> = first.found.iter().map(|name| format!("`{name}`")).collect();
            let verb = if sends { "send to" } else { "read" };
            let message = format!("`{}` could {verb} {}", first.path, names.join(" or "));
            let lines: Vec<_> = first.found.iter().map(|other| first.line(other)).collect();
            let help =
                format!("write one of these links: {}; or \"/{}\" = false", lines.join(", or "), first.path);
            collector.add(first.surveyed.module.name.span, ErrorCode::Ends.of(message), help);
            continue;
        }
        let same: Vec<_> = std::iter::once(first).chain(same).collect();
        refuse_group(modules, &same, collector);
    }
}

/// Reports an ambiguity that several ports share.
/// The report names the possible ends and their places, as these are the surplus.
fn refuse_group(
    modules: &[Surveyed<'_>],
    same: &[LinkChoice<'_, '_>],
    collector: &mut DiagnosticCollector<'_>,
) {
    let [first, ..] = same else { return };
    let owner = |path: &str| split_module(modules, path).map(|(module, _)| modules[module].module.name.span);
    let named: Vec<_> = first
        .found
        .iter()
        .map(|path| match owner(path) {
            Some(span) => format!("`{path}` ({})", collector.place(span)),
            None => format!("`{path}`"),
        })
        .collect();
    let ports: Vec<_> = same.iter().map(|choice| format!("`{}`", choice.path)).collect();
    let (one, verb) = match first.direction {
        Direction::Outbox => ("receiver", "send to"),
        _ => ("source", "read"),
    };
    let message = format!(
        "a port without a written link has exactly one possible {one}; {} could {verb} {}",
        ports.join(", "),
        named.join(" or ")
    );
    let lines: Vec<_> = same.iter().map(|choice| choice.line(&first.found[0])).collect();
    let help = format!("remove one of them, or write the links: {}", lines.join(", "));
    // Of what is written last there is too much.
    let last = first.found.iter().filter_map(|path| owner(path)).max();
    let span = last.unwrap_or(first.surveyed.module.name.span);
    collector.add(span, ErrorCode::Ends.of(message), help);
}
