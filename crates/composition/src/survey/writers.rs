//! The writers of the target of a link.

use slate_configuration::Configuration;

use super::names::split_module;
use super::{LinkSource, Surveyed};

/// Returns the modules that write the target of a link.
pub(super) fn writers(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    target: LinkSource,
) -> Vec<usize> {
    match target {
        LinkSource::Port(module, _) => vec![module],
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
