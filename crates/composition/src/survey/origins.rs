//! Provenance of a link's value, traced through the inputs of other modules.

use slate_configuration::{Configuration, Link};
use slate_module::Direction;
use slate_sorted::SortedSet;

use super::block::{Block, Provenance, is_fact, is_handed_on};
use super::names::{split_module, split_port};
use super::{Implied, LinkEnd, LinkSource, ResolvedLink, Survey, scope};

/// Origin of a link's value.
#[derive(Clone, Copy, Debug)]
pub(super) struct ValueOrigin<'s> {
    pub provenance: Provenance,
    /// Module of this agent that writes it, if any.
    pub writer: Option<usize>,
    /// Robot of that module or of the gate.
    /// Empty for no robot, `None` in another agent.
    pub robot: Option<&'s str>,
}

impl<'s> ValueOrigin<'s> {
    fn of_module(survey: &'s Survey<'_>, provenance: Provenance, module: usize) -> Self {
        let robot = scope(&survey.modules[module].module.name.value);
        Self { provenance, writer: Some(module), robot: Some(robot) }
    }

    fn outside_modules(provenance: Provenance) -> Self {
        Self { provenance, writer: None, robot: None }
    }
}

/// Returns the origins of a link's value.
pub(super) fn origins<'s>(
    configuration: &'s Configuration,
    survey: &'s Survey<'_>,
    resolved: &ResolvedLink<'_>,
) -> Vec<ValueOrigin<'s>> {
    let mut found = Vec::new();
    if let Some((module, block)) = passed_by(configuration, survey, resolved.link) {
        found.push(ValueOrigin::of_module(survey, Provenance::Block(block), module));
        return found;
    }
    collect(configuration, survey, (resolved.target, &resolved.from), &mut SortedSet::new(), &mut found);
    found
}

/// Adds the origins of a source.
/// For an input, a parameter or a switch these are the sources of its own links.
fn collect<'s>(
    configuration: &'s Configuration,
    survey: &'s Survey<'_>,
    (target, field): (LinkSource, &str),
    seen: &mut SortedSet<(usize, LinkEnd, String)>,
    found: &mut Vec<ValueOrigin<'s>>,
) {
    let (module, link_end) = match target {
        LinkSource::Port(module, port) => {
            let description = &survey.modules[module].description;
            let own = &description.ports[port];
            if !matches!(own.direction, Direction::Input | Direction::Queue) {
                found.push(ValueOrigin::of_module(survey, Provenance::of_port(description, own), module));
                return;
            }
            (module, LinkEnd::Port(port))
        }
        LinkSource::Implied(module, Implied::Params) => (module, LinkEnd::Params),
        LinkSource::Implied(module, Implied::Enabled) => (module, LinkEnd::Enabled),
        LinkSource::Implied(module, Implied::State | Implied::Timing | Implied::Histogram) => {
            found.push(ValueOrigin::of_module(survey, Provenance::Health, module));
            return;
        }
        LinkSource::Host(_) => {
            found.push(ValueOrigin::outside_modules(Provenance::Health));
            return;
        }
        LinkSource::Command(actuator) => {
            let robot = scope(&configuration.actuators()[actuator].name.value);
            found.push(ValueOrigin { robot: Some(robot), ..ValueOrigin::outside_modules(Provenance::Gate) });
            return;
        }
        LinkSource::Gate(actuator) => {
            let robot = scope(&configuration.actuators()[actuator].name.value);
            found.push(ValueOrigin {
                robot: Some(robot),
                ..ValueOrigin::outside_modules(Provenance::GateState)
            });
            return;
        }
        LinkSource::Remote(remote) => {
            found.push(ValueOrigin::outside_modules(remote_origin(survey, remote)));
            return;
        }
        LinkSource::Absent(_) | LinkSource::Played(_) => {
            found.push(ValueOrigin::outside_modules(Provenance::Unknown));
            return;
        }
    };
    if !seen.insert((module, link_end, field.to_owned())) {
        return;
    }
    let fills = |resolved: &&ResolvedLink<'_>| {
        resolved.port == (module, link_end) && (link_end != LinkEnd::Params || meets(&resolved.field, field))
    };
    let before = found.len();
    // An input filled by an external program counts as a driver's.
    if configuration.external_links().iter().any(|link| link.fills(&survey.end_path(module, link_end))) {
        found.push(ValueOrigin::of_module(survey, Provenance::Module, module));
    }
    for resolved in survey.links.iter().filter(fills) {
        if let Some((module, block)) = passed_by(configuration, survey, resolved.link) {
            found.push(ValueOrigin::of_module(survey, Provenance::Block(block), module));
        } else {
            collect(configuration, survey, (resolved.target, &resolved.from), seen, found);
        }
    }
    if found.len() == before {
        found.push(ValueOrigin::outside_modules(Provenance::Hand));
    }
}

/// Returns the block that owns the input which a link reads.
/// It is Knowledge with a fact, or a Monitor that hands on a measurement. Both own it regardless of the source of the
/// input's link.
pub(super) fn passed_by(
    configuration: &Configuration,
    survey: &Survey<'_>,
    link: &Link,
) -> Option<(usize, Block)> {
    let url = &link.from.value;
    let path = url.path_in("");
    let is_own = url.agent().is_none_or(|agent| agent == configuration.agent_name());
    let (module, rest) = split_module(&survey.modules, &path).filter(|_| is_own)?;
    let ports = &survey.modules[module].description.ports;
    let name = split_port(ports, rest).0;
    let port = ports.iter().find(|port| port.name == name)?;
    let block = match port {
        port if is_fact(port) => Block::Knowledge,
        port if is_handed_on(port) => Block::Monitor,
        _ => return None,
    };
    Some((module, block))
}

/// Returns whether one field is inside the other.
fn meets(one: &str, other: &str) -> bool {
    slate_blackboard::is_within(one, other) || slate_blackboard::is_within(other, one) || other.is_empty()
}

/// Returns the provenance of a property of another agent.
fn remote_origin(survey: &Survey<'_>, remote: usize) -> Provenance {
    let remote = &survey.remote[remote];
    if remote.path.agent == slate_configuration::TEAM {
        return Provenance::Block(Block::Knowledge);
    }
    remote.property.as_ref().map_or(Provenance::Unknown, |property| Provenance::of_part(&property.part))
}
