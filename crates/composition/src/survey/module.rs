//! A module of the configuration and the kind that it is of.

use std::collections::BTreeMap;
use std::time::Duration;

use slate_blackboard::interface::Value;
use slate_blackboard::is_within;
use slate_module::{Direction, ModuleKind, Trigger};

use super::{Complaints, RESERVED, RESERVED_WHEN_ISOLATED, Surveyed, suggest};
use crate::OwnSetup;
use crate::catalogue::Catalogue;
use crate::parameters;
use slate_configuration::Mistake;
use slate_configuration::{Configuration, Module};

/// Where the agent tells of itself.
const OWN: [(&str, &str); 3] = [("loop", "the main loop"), ("log", "the log"), ("record", "the recording")];

pub(super) fn survey_module<'a>(
    configuration: &'a Configuration,
    module: &'a Module,
    catalogue: &Catalogue,
    complaints: &mut Complaints<'a>,
) -> Option<Surveyed<'a>> {
    let own = OWN.iter().find(|(name, _)| is_within(&module.name.value, name));
    if let Some((name, what)) = own {
        let message = format!("no module can be named `{}`: `{name}` is {what}", module.name.value);
        complaints.add(module.name.span, message, "rename it");
        return None;
    }
    let Some(kind) = catalogue.kind(&module.kind.value) else {
        let help = suggest(&module.kind.value, catalogue.kinds().map(ModuleKind::name));
        complaints.add(
            module.kind.span,
            Mistake::Kind.of(format!("no plugin brings a module `{}`", module.kind.value)),
            help,
        );
        return None;
    };

    // The description says which section the module wants, and may itself depend on that section.
    let first = kind.section();
    let section = if first.is_empty() { None } else { configuration.table(first).map(Value::from) };
    let setup = OwnSetup {
        name: module.name.value.as_str().into(),
        seed: configuration.seed().value,
        period: configuration.period().value,
        section,
    };
    let description =
        match (catalogue.describe)(kind, &setup, Duration::from_nanos(configuration.hang().value)) {
            Ok(description) => description,
            Err(refusal) => {
                complaints.add(
                    configuration.place_of(&refusal.0, module.name.span),
                    format!("{}: {refusal}", module.name.value),
                    "see the module's documentation",
                );
                return None;
            }
        };
    let is_reserved =
        |name: &str| RESERVED.contains(&name) || module.isolated.value && name == RESERVED_WHEN_ISOLATED;
    if let Some(port) = description.ports.iter().find(|port| is_reserved(&port.name)) {
        let message =
            format!("module type `{}` names a port `{}`, which every module has", kind.name(), port.name);
        complaints.add(module.kind.span, message, "rename the port");
        return None;
    }
    // What is wrong with a value is no reason not to judge the links.
    let params = parameters::bytes(&description, &module.params, complaints);
    let mut inputs = BTreeMap::new();
    for (name, entry) in module.inputs.iter() {
        let port =
            description.ports.iter().position(|port| port.name == name && port.direction == Direction::Input);
        match port {
            Some(port) => {
                let descriptor = description.ports[port].descriptor;
                let room = descriptor.shape(description.ports[port].capacity);
                let bytes = parameters::value_bytes(descriptor, &entry.value, complaints);
                if bytes.as_ref().is_some_and(|bytes| bytes.len() > room.bytes(room.capacity)) {
                    let message = format!("the input `{name}` has room for {} items", room.capacity);
                    complaints.add(entry.value.span, message, "shorten the list");
                }
                inputs.insert(port, bytes.unwrap_or_else(|| vec![0; room.size]));
            }
            None => {
                let names = description.ports.iter().filter(|port| port.direction == Direction::Input);
                let help = suggest(name, names.map(|port| port.name.as_str()));
                complaints.add(
                    entry.key,
                    Mistake::Name.of(format!("`{}` has no input `{name}`", module.name.value)),
                    help,
                );
            }
        }
    }
    let stage = module.stage.as_ref().map_or(description.stage, |stage| stage.value);
    let trigger =
        module.trigger.as_ref().map_or_else(|| description.trigger.clone(), |trigger| trigger.value.clone());
    if let Trigger::On { ports, .. } = &trigger
        && let Some(missing) =
            ports.iter().find(|name| !description.ports.iter().any(|port| port.name == **name))
    {
        let span = module.trigger.as_ref().map_or(module.name.span, |trigger| trigger.span);
        let help = suggest(missing, description.ports.iter().map(|port| port.name.as_str()));
        complaints.add(
            span,
            format!("`{}` is to run on `{missing}`, which is none of its ports", module.name.value),
            help,
        );
        return None;
    }
    let deadline = module.deadline.as_ref().map(|deadline| deadline.value).or(description.deadline);
    Some(Surveyed {
        module,
        kind: kind.clone(),
        description,
        stage,
        trigger,
        deadline,
        params,
        setup,
        inputs,
    })
}
