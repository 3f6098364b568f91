//! Services that modules need, and their providers.

use std::collections::BTreeMap;

use slate_module::aspect::{MainLoop, Service, TimeSource};
use slate_module::{Description, Direction};

use super::Surveyed;
use crate::catalogue::Catalogue;
use crate::complaints::Complaints;
use slate_configuration::Configuration;
use slate_configuration::Mistake;

/// For each port that needs a service, the port that provides it; nothing when the host does.
pub(super) fn survey_services(
    modules: &[Surveyed<'_>],
    catalogue: &Catalogue,
    complaints: &mut Complaints<'_>,
) -> BTreeMap<(usize, usize), Option<(usize, usize)>> {
    let ports = |direction| {
        modules.iter().enumerate().flat_map(move |(m, surveyed)| {
            let ports = surveyed.description.ports.iter().enumerate();
            ports.filter(move |(_, port)| port.direction == direction).map(move |(p, port)| (m, p, port))
        })
    };
    let mut services = BTreeMap::new();
    for (m, p, wanted) in ports(Direction::Aspect) {
        let descriptor = wanted.descriptor;
        let module = modules[m].module;
        if module.isolated.value {
            let message = format!(
                "`{}` needs `{}`, which an isolated module can't reach",
                module.name.value, descriptor.name
            );
            complaints.add(module.isolated.span, message, "leave `isolated` out, or use links");
            continue;
        }
        if catalogue.services.iter().any(|service| service.hash == descriptor.hash) {
            services.insert((m, p), None);
            continue;
        }
        let providers: Vec<_> = ports(Direction::Provider)
            .filter(|(_, _, offered)| offered.descriptor.hash == descriptor.hash)
            .map(|(m, p, _)| (m, p))
            .collect();
        match providers[..] {
            [provider] => {
                services.insert((m, p), Some(provider));
            }
            [(first, _), (second, _), ..] => {
                let name = |m: usize| &modules[m].module.name.value;
                let message = Mistake::Service.of(format!(
                    "`{}` needs `{}`, which both `{}` and `{}` provide",
                    module.name.value,
                    descriptor.name,
                    name(first),
                    name(second)
                ));
                complaints.add(module.name.span, message, "leave one of the two out");
            }
            [] => {
                let message = Mistake::Service.of(format!(
                    "`{}` needs `{}`, which nothing provides",
                    module.name.value, descriptor.name
                ));
                complaints.add(module.name.span, message, help(descriptor.name, modules, catalogue));
            }
        }
    }
    services
}

/// Whether a module needs the service of that schema.
pub fn needs(description: &Description, schema: u64) -> bool {
    let mut ports = description.ports.iter();
    ports.any(|port| port.direction == Direction::Aspect && port.descriptor.hash == schema)
}

/// One module has the main loop, and the one that says the time is the time source of the configuration.
pub(super) fn check_single(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    complaints: &mut Complaints<'_>,
) {
    let users = |schema: u64| modules.iter().filter(move |surveyed| needs(&surveyed.description, schema));
    let mut loops = users(MainLoop::DESCRIPTOR.hash).map(|surveyed| &surveyed.module.name);
    if let (Some(first), Some(second)) = (loops.next(), loops.next()) {
        let message =
            Mistake::Second.of(format!("`{}` and `{}` both want the main loop", first.value, second.value));
        complaints.add(second.span, message, "one module of an agent can have it");
    }
    for surveyed in users(TimeSource::DESCRIPTOR.hash) {
        let name = &surveyed.module.name;
        if configuration.time_source().is_none_or(|source| source.value != name.value) {
            let help = format!("write [time] source = \"{}\"", name.value);
            complaints.add(
                name.span,
                Mistake::TimeSource.of(format!("`{}` sets the time, but is not the time source", name.value)),
                help,
            );
        }
    }
}

/// Where the service may come from.
fn help(wanted: &str, modules: &[Surveyed<'_>], catalogue: &Catalogue) -> String {
    // A name ends with its version.
    let base = |name: &str| name.rsplit_once(' ').map_or(name, |(base, _)| base).to_owned();
    let offered = modules.iter().flat_map(|surveyed| &surveyed.description.ports);
    let offered = offered
        .filter(|port| port.direction == Direction::Provider)
        .map(|port| port.descriptor.name)
        .chain(catalogue.services.iter().map(|service| service.name));
    let all: Vec<_> = offered.collect();
    if let Some(other) = all.iter().find(|name| base(name) == base(wanted)) {
        return format!("there is `{other}`: build both with the same version");
    }
    let dormant: Vec<_> = catalogue.dormant.values().map(String::as_str).collect();
    if dormant.is_empty() {
        format!("add a module that provides it; there are: {}", all.join(", "))
    } else {
        format!("load a plugin that provides it; not loaded: {}", dormant.join(", "))
    }
}
