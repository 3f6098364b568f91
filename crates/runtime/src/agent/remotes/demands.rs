//! Demand of an agent's links from other agents.

use slate_blackboard::is_within;
use slate_module::Direction;
use slate_sorted::SortedMap;

use crate::agent::assembly::LoadedModule;
use crate::sharing::{Expected, Pace, RemoteDemand, RemotePath};
use slate_composition::{carrier_mismatch, remote_path};
use slate_configuration::{Compression, Configuration, Link, LinkMode, LinkRate};

/// Returns the demand of a configuration's links from other agents.
/// Links to one property share the largest of their demands.
pub(super) fn demands(
    configuration: &Configuration,
    properties: &SortedMap<RemotePath, String>,
    modules: &SortedMap<String, LoadedModule>,
) -> SortedMap<RemotePath, RemoteDemand> {
    let mut demands: SortedMap<RemotePath, RemoteDemand> = SortedMap::new();
    for link in configuration.links() {
        let Some(path) = remote_path(configuration, link) else { continue };
        // It is carried in another way than the link requests, so others of the property are not to follow it.
        if carrier_mismatch(configuration, link).is_some() {
            continue;
        }
        let demand = demand(modules, link);
        let demand = demands.get(&path).map_or_else(|| demand.clone(), |known| known.and(&demand));
        demands.insert(path, demand);
    }
    let related = demands.clone();
    for (path, demand) in &mut demands {
        let others = related.iter().filter(|(other, _)| {
            let same = properties.get(path).is_some_and(|property| properties.get(*other) == Some(property));
            // A path and what lies below it are of one property.
            *other != path
                && other.agent == path.agent
                && (same || is_within(&other.path, &path.path) || is_within(&path.path, &other.path))
        });
        *demand = others.fold(demand.clone(), |demand, (_, other)| demand.and(other));
    }
    demands
}

fn demand(modules: &SortedMap<String, LoadedModule>, link: &Link) -> RemoteDemand {
    if link.destination().is_some_and(|url| url.agent().is_some()) {
        return RemoteDemand::Messages;
    }
    let port = modules.iter().find_map(|(name, loaded)| {
        let rest = link.to.value.strip_prefix(name.as_str())?.strip_prefix('/')?;
        loaded.description.ports.iter().find(|port| port.name == rest)
    });
    let direction = port.map(|port| port.direction);
    let transport = &link.transport;
    let interval = transport.interval.as_ref().map_or(0, |interval| interval.value);
    RemoteDemand::Values {
        reliable: transport.mode.as_ref().is_none_or(|mode| mode.value == LinkMode::Reliable),
        pace: match transport.rate.as_ref().map(|rate| rate.value) {
            Some(LinkRate::Every(period)) => Pace::Every(period),
            Some(LinkRate::OnChange) | None => Pace::OnChange(interval),
        },
        compression: transport.compression.as_ref().map_or(Compression::Lossless, |said| said.value),
        every: port.filter(|_| direction == Some(Direction::Queue)).map(|port| {
            let said = link.window.as_ref().map(|window| usize::from(window.value));
            2 * said.unwrap_or(port.window).max(16)
        }),
        interface: port.map(|port| Expected(port.descriptor)),
    }
}
