//! Who writes what a link leads to.

use slate_configuration::Configuration;

use super::names::split_module;
use super::{Surveyed, Target};

/// The modules that write what a link leads to.
pub(super) fn writers(configuration: &Configuration, modules: &[Surveyed<'_>], target: Target) -> Vec<usize> {
    match target {
        Target::Port(module, _) => vec![module],
        Target::Command(actuator) => {
            let wanted = &configuration.actuators()[actuator];
            let paths = wanted.commands.iter().map(|url| url.value.path_in(""));
            let ports = paths.filter_map(|path| split_module(modules, &path).map(|(module, _)| module));
            let named = |module: &Surveyed<'_>| {
                wanted.modules.iter().any(|name| name.value == module.module.name.value)
            };
            ports.chain((0..modules.len()).filter(|module| named(&modules[*module]))).collect()
        }
        // What tells of a module, or is set in it, is of no moment of a cycle.
        Target::Implied(..) | Target::Absent(_) | Target::Remote(_) | Target::Host(_) | Target::Played(_) => {
            Vec::new()
        }
    }
}
