//! Resolution of a configured module with its kind.

use std::time::Duration;

use slate_blackboard::interface::Value;
use slate_blackboard::is_within;
use slate_module::{Description, Direction, ModuleKind, PortDescription, Trigger};
use slate_sorted::SortedMap;

use super::{RESERVED, RESERVED_WHEN_ISOLATED, Surveyed};
use crate::OwnSetup;
use crate::catalogue::Catalogue;
use crate::diagnostic_collector::{DiagnosticCollector, suggest};
use crate::parameters::{self, FollowedSetting};
use slate_configuration::{Configuration, ErrorCode, Module};

/// Names of the agent's own properties.
const AGENT_PROPERTIES: [(&str, &str); 3] =
    [("loop", "the main loop"), ("log", "the log"), ("record", "the recording")];

/// Resolves a module of the configuration with its kind; `None` after an error.
pub(super) fn survey_module<'a>(
    configuration: &'a Configuration,
    module: &'a Module,
    catalogue: &Catalogue,
    collector: &mut DiagnosticCollector<'a>,
) -> Option<Surveyed<'a>> {
    let own = AGENT_PROPERTIES.iter().find(|(name, _)| is_within(&module.name.value, name));
    if let Some((name, what)) = own {
        let message = format!("no module can be named `{}`: `{name}` is {what}", module.name.value);
        collector.add(module.name.span, message, "rename it");
        return None;
    }
    let Some(kind) = catalogue.kind(&module.kind.value) else {
        let help = suggest(&module.kind.value, catalogue.kinds().map(ModuleKind::name));
        let message = ErrorCode::Kind.of(format!("no plugin brings a module `{}`", module.kind.value));
        collector.add(module.kind.span, message, help);
        return None;
    };
    let (setup, mut description) = prepare_setup(configuration, module, (kind, catalogue), collector)?;
    // A wrong value does not keep the links from being checked.
    let before = collector.diagnostics.len();
    let followed = parameters::followed(configuration, module, &description);
    let params = parameters::bytes(&description, &module.params, &followed, collector);
    // One that a plugin brings by itself has the defaults of its kind, and is of no robot.
    let is_of_robot = description.describes_hardware && !configuration.is_loaded(module);
    let mut hardware_description = None;
    if is_of_robot && collector.diagnostics.len() == before {
        let with_params = OwnSetup { params: Some(params.clone()), ..setup.clone() };
        let kind = (kind, catalogue);
        hardware_description =
            Some(describe(configuration, module, kind, (&with_params, &followed), collector));
    }
    collector.defer_at(before, followed.iter().map(|(_, value)| value.span));
    if let Some(described) = hardware_description {
        description.hardware = described?.hardware;
    }
    let inputs = inputs(module, &description, collector);
    let trigger = trigger(module, &description, collector)?;
    Some(Surveyed {
        module,
        kind: kind.clone(),
        is_isolated: is_isolated(module, kind),
        stage: module.stage.as_ref().map_or(description.stage, |stage| stage.value),
        trigger,
        deadline: module.deadline.as_ref().map(|deadline| deadline.value).or(description.deadline),
        description,
        params,
        setup,
        inputs,
    })
}

/// Returns the setup of a module, and its ports and parameters.
fn prepare_setup<'a>(
    configuration: &'a Configuration,
    module: &'a Module,
    (kind, catalogue): (&ModuleKind, &Catalogue),
    collector: &mut DiagnosticCollector<'a>,
) -> Option<(OwnSetup, Description)> {
    // The description says which section the module wants, and may itself depend on that section.
    let first = kind.section();
    let section = if first.is_empty() { None } else { configuration.table(first).map(Value::from) };
    let setup = OwnSetup {
        name: module.name.value.as_str().into(),
        seed: configuration.seed().value,
        period: configuration.period().value,
        section,
        params: None,
    };
    let description = describe(configuration, module, (kind, catalogue), (&setup, &[]), collector)?;
    let is_isolated = is_isolated(module, kind);
    let is_reserved = |name: &str| RESERVED.contains(&name) || is_isolated && name == RESERVED_WHEN_ISOLATED;
    if let Some(port) = description.ports.iter().find(|port| is_reserved(&port.name)) {
        let message =
            format!("module type `{}` names a port `{}`, which every module has", kind.name(), port.name);
        collector.add(module.kind.span, message, "rename the port");
        return None;
    }
    Some((setup, description))
}

/// Returns true if a module runs in a process of its own.
/// It is configured so, or its kind must.
fn is_isolated(module: &Module, kind: &ModuleKind) -> bool {
    module.isolated.value || kind.needs_process()
}

/// Describes a kind under a setup, with the settings that its parameters follow.
/// A refusal by the kind becomes a diagnostic.
fn describe<'a>(
    configuration: &'a Configuration,
    module: &'a Module,
    (kind, catalogue): (&ModuleKind, &Catalogue),
    (setup, followed): (&OwnSetup, &[FollowedSetting<'_>]),
    collector: &mut DiagnosticCollector<'a>,
) -> Option<Description> {
    let hang = Duration::from_nanos(configuration.hang().value);
    let refusal = match (catalogue.describe)(kind, setup, hang) {
        Ok(description) => return Some(description),
        Err(refusal) => refusal,
    };
    let message = format!("{}: {refusal}", module.name.value);
    let is_its = |(name, _): &&FollowedSetting<'_>| refusal.0.starts_with(&format!("params.{name}: "));
    let setting = || followed.iter().find(is_its).map(|(_, value)| value.span);
    let span = module.place_of(&refusal.0).or_else(setting);
    match span.or_else(|| configuration.place_of(&refusal.0)) {
        // The refusal says what is expected of the setting.
        Some(span) => collector.add_without_help(span, message),
        None if setup.params.is_some() => collector.add_without_help(module.name.span, message),
        None => collector.add(module.name.span, message, "see the module's documentation"),
    }
    None
}

/// Returns the configured values of inputs, by port.
fn inputs<'a>(
    module: &'a Module,
    description: &Description,
    collector: &mut DiagnosticCollector<'a>,
) -> SortedMap<usize, Vec<u8>> {
    let mut inputs = SortedMap::new();
    for (name, entry) in module.inputs.iter() {
        let is_it = |port: &PortDescription| port.name == name && port.direction == Direction::Input;
        let Some(port) = description.ports.iter().position(is_it) else {
            let names = description.ports.iter().filter(|port| port.direction == Direction::Input);
            let help = suggest(name, names.map(|port| port.name.as_str()));
            let message = ErrorCode::Name.of(format!("`{}` has no input `{name}`", module.name.value));
            collector.add(entry.key, message, help);
            continue;
        };
        let descriptor = description.ports[port].descriptor;
        let room = descriptor.shape(description.ports[port].capacity);
        let bytes = parameters::value_bytes(descriptor, &entry.value, collector);
        if bytes.as_ref().is_some_and(|bytes| bytes.len() > room.bytes(room.capacity)) {
            let message = format!("the input `{name}` has room for {} items", room.capacity);
            collector.add(entry.value.span, message, "shorten the list");
        }
        inputs.insert(port, bytes.unwrap_or_else(|| vec![0; room.size]));
    }
    inputs
}

/// Returns the configured trigger of a module, or that of its kind.
fn trigger<'a>(
    module: &'a Module,
    description: &Description,
    collector: &mut DiagnosticCollector<'a>,
) -> Option<Trigger> {
    let trigger =
        module.trigger.as_ref().map_or_else(|| description.trigger.clone(), |trigger| trigger.value.clone());
    if let Trigger::On { ports, .. } = &trigger
        && let Some(missing) =
            ports.iter().find(|name| !description.ports.iter().any(|port| port.name == **name))
    {
        let span = module.trigger.as_ref().map_or(module.name.span, |trigger| trigger.span);
        let help = suggest(missing, description.ports.iter().map(|port| port.name.as_str()));
        let message =
            format!("`{}` is to run on `{missing}`, which is not one of its ports", module.name.value);
        collector.add(span, message, help);
        return None;
    }
    Some(trigger)
}
