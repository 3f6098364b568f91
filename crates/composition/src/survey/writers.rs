//! The writers of the target of a link.

use slate_configuration::Configuration;

use super::names::split_module;
use super::{LinkTarget, Surveyed};

/// The modules that write the target of a link.
pub(super) fn writers(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    target: LinkTarget,
) -> Vec<usize> {
    match target {
        LinkTarget::Port(module, _) => vec![module],
        LinkTarget::Command(actuator) => {
            let wanted = &configuration.actuators()[actuator];
            let paths = wanted.commands.iter().map(|url| url.value.path_in(""));
            let ports = paths.filter_map(|path| split_module(modules, &path).map(|(module, _)| module));
            let named = |module: &Surveyed<'_>| {
                wanted.modules.iter().any(|name| name.value == module.module.name.value)
            };
            ports.chain((0..modules.len()).filter(|module| named(&modules[*module]))).collect()
        }
        // State and settings of a module are written at no particular moment of a cycle.
        LinkTarget::Implied(..)
        | LinkTarget::Absent(_)
        | LinkTarget::Remote(_)
        | LinkTarget::Host(_)
        | LinkTarget::Played(_) => Vec::new(),
    }
}
