//! Services that modules need, and their providers.

use slate_module::aspect::{Effect, MainLoop, Service, TimeSource};
use slate_module::{Description, Direction};
use slate_sorted::SortedMap;

use super::block::{Block, Provenance};
use super::{Survey, Surveyed, scope};
use crate::catalogue::Catalogue;
use crate::diagnostic_collector::DiagnosticCollector;
use slate_configuration::Configuration;
use slate_configuration::ErrorCode;

/// Resolves the provider of the service of each port.
/// `None` stands for the host.
pub(super) fn survey_services(
    modules: &[Surveyed<'_>],
    catalogue: &Catalogue,
    collector: &mut DiagnosticCollector<'_>,
) -> SortedMap<(usize, usize), Option<(usize, usize)>> {
    let ports = |direction| {
        modules.iter().enumerate().flat_map(move |(m, surveyed)| {
            let ports = surveyed.description.ports.iter().enumerate();
            ports.filter(move |(_, port)| port.direction == direction).map(move |(p, port)| (m, p, port))
        })
    };
    let mut services = SortedMap::new();
    for (m, p, wanted) in ports(Direction::Aspect) {
        let descriptor = wanted.descriptor;
        let module = modules[m].module;
        if modules[m].is_isolated {
            let message = format!(
                "`{}` needs `{}`, which an isolated module can't reach",
                module.name.value, descriptor.name
            );
            collector.add(module.isolated.span, message, "leave `isolated` out, or use links");
            continue;
        }
        if catalogue.services.iter().any(|service| service.descriptor.hash == descriptor.hash) {
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
                let message = ErrorCode::Service.of(format!(
                    "`{}` needs `{}`, which both `{}` and `{}` provide",
                    module.name.value,
                    descriptor.name,
                    name(first),
                    name(second)
                ));
                collector.add(module.name.span, message, "leave one of the two out");
            }
            [] => {
                let message = ErrorCode::Service.of(format!(
                    "`{}` needs `{}`, which nothing provides",
                    module.name.value, descriptor.name
                ));
                collector.add(module.name.span, message, help(descriptor.name, modules, catalogue));
            }
        }
    }
    services
}

/// Returns whether a module needs the service with that schema.
pub fn needs(description: &Description, schema: u64) -> bool {
    let mut ports = description.ports.iter();
    ports.any(|port| port.direction == Direction::Aspect && port.descriptor.hash == schema)
}

/// Checks for a single user of the main loop, and for the right time source.
/// A module that sets the time must be the time source of the configuration.
pub(super) fn check_single(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    collector: &mut DiagnosticCollector<'_>,
) {
    let users = |schema: u64| modules.iter().filter(move |surveyed| needs(&surveyed.description, schema));
    let mut loops = users(MainLoop::DESCRIPTOR.hash).map(|surveyed| &surveyed.module.name);
    if let (Some(first), Some(second)) = (loops.next(), loops.next()) {
        let message =
            ErrorCode::Second.of(format!("`{}` and `{}` both want the main loop", first.value, second.value));
        collector.add(second.span, message, "one module of an agent can have it");
    }
    for surveyed in users(TimeSource::DESCRIPTOR.hash) {
        let name = &surveyed.module.name;
        if configuration.time_source().is_none_or(|source| source.value != name.value) {
            let help = format!("write [time] source = \"{}\"", name.value);
            collector.add(
                name.span,
                ErrorCode::TimeSource
                    .of(format!("`{}` sets the time, but is not the time source", name.value)),
                help,
            );
        }
    }
}

/// Reports blocks with a service that bypasses the attachment rules.
/// By such a service they could read or act without a link.
pub(super) fn check_blocks(
    survey: &Survey<'_>,
    catalogue: &Catalogue,
    collector: &mut DiagnosticCollector<'_>,
) {
    for ((module, port), provider) in &survey.services {
        let surveyed = &survey.modules[*module];
        let Some(block) = Block::of(&surveyed.description) else { continue };
        let service = surveyed.description.ports[*port].descriptor;
        let refused = match provider {
            None => {
                let mut services = catalogue.services.iter();
                let found = services.find(|other| other.descriptor.hash == service.hash);
                rule_bypass(block, found.map_or(Effect::ReadsAndWrites, |found| found.effect))
            }
            Some((other, offered)) => {
                let other = &survey.modules[*other];
                let origin = Provenance::of_port(&other.description, &other.description.ports[*offered]);
                let is_own = scope(&surveyed.module.name.value) == scope(&other.module.name.value);
                // A driver is what an Actuator acts by.
                let is_driver = block == Block::Actuator && origin == Provenance::Module;
                (!block.may_read(origin, is_own) && !is_driver)
                    .then(|| ("is not of one of these", block.help(origin)))
            }
        };
        if let Some((why, help)) = refused {
            let (name, reads) = (&surveyed.module.name.value, block.reads());
            let message =
                format!("{reads}: `/{name}` can't have the service `{}`, which {why}", service.name);
            collector.add(surveyed.module.name.span, ErrorCode::Attachment.of(message), help);
        }
    }
}

/// Returns the reason against a service of the host for a block, and the help.
fn rule_bypass(block: Block, effect: Effect) -> Option<(&'static str, &'static str)> {
    match effect {
        Effect::None => None,
        Effect::Reads => Some((
            "reads properties of all modules past its links",
            "link an `Input` to the property that it needs, such as an `Input<Transform>`",
        )),
        Effect::ReadsAndWrites => {
            Some(("reads and writes any property past its links", "link its ports to what it reads"))
        }
        Effect::Acts => (block != Block::Execute)
            .then_some(("acts past Execute", "let an action do it: Execute may have the service")),
        Effect::Communicates => (!matches!(block, Block::Sensor | Block::Actuator | Block::Execute)).then_some((
            "talks to others past its links",
            "let a Sensor receive that, and an action send: Sensors, Actuators and Execute may have the service",
        )),
    }
}

/// Returns help on providers of a service.
fn help(wanted: &str, modules: &[Surveyed<'_>], catalogue: &Catalogue) -> String {
    // A name ends with its version.
    let base = |name: &str| name.rsplit_once(' ').map_or(name, |(base, _)| base).to_owned();
    let offered = modules.iter().flat_map(|surveyed| &surveyed.description.ports);
    let offered = offered
        .filter(|port| port.direction == Direction::Provider)
        .map(|port| port.descriptor.name)
        .chain(catalogue.services.iter().map(|service| service.descriptor.name));
    let all: Vec<_> = offered.collect();
    if let Some(other) = all.iter().find(|name| base(name) == base(wanted)) {
        return format!("there is `{other}`: build both with the same version");
    }
    let dormant: Vec<_> = catalogue.dormant.values().map(String::as_str).collect();
    if dormant.is_empty() {
        format!("add a module that provides it; available: {}", all.join(", "))
    } else {
        format!("load a plugin that provides it; not loaded: {}", dormant.join(", "))
    }
}
