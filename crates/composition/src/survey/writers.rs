//! The writers of the source of a link.

use slate_configuration::Configuration;
use slate_module::Direction;

use super::names::split_module;
use super::{LinkEnd, LinkSource, ResolvedLink, Surveyed};

/// Returns the modules that write the source of a link, in a step of theirs.
/// A module with an inbox counts as one, as a link from an outbox has the inbox as its source.
pub(super) fn writers(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    links: &[ResolvedLink<'_>],
    target: LinkSource,
) -> Vec<usize> {
    match target {
        LinkSource::Port(module, port) => {
            let direction = modules[module].description.ports[port].direction;
            let is_linked = || links.iter().any(|link| link.port == (module, LinkEnd::Port(port)));
            // An input without a link is set between two cycles, and no step writes it.
            let is_set = matches!(direction, Direction::Input | Direction::Queue) && !is_linked();
            if is_set { Vec::new() } else { vec![module] }
        }
        LinkSource::Command(actuator) | LinkSource::Gate(actuator) => {
            let wanted = &configuration.actuators()[actuator];
            let paths = wanted.commands.iter().map(|url| url.value.path_in(""));
            let ports = paths.filter_map(|path| split_module(modules, &path).map(|(module, _)| module));
            let named = |module: &Surveyed<'_>| {
                wanted.modules.iter().any(|name| name.value == module.module.name.value)
            };
            ports.chain((0..modules.len()).filter(|module| named(&modules[*module]))).collect()
        }
        // State and settings of a module are written at no particular moment of a cycle.
        LinkSource::Implied(..)
        | LinkSource::Absent(_)
        | LinkSource::Remote(_)
        | LinkSource::Host(_)
        | LinkSource::Played(_) => Vec::new(),
    }
}
