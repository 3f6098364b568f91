//! Stand-ins for modules that provide services.

use std::iter;

use slate_blackboard::interface::Descriptor;
use slate_module::{Description, Direction, Plugin, PortDescription};
use slate_sorted::{SortedMap, SortedSet};

use super::DESCRIPTION;
use crate::aspects;
use slate_engine::runner::{OwnSetup, describe};

/// Module that provides the service of an absent module.
/// It derives it from the recorded outputs of that module.
#[derive(Debug)]
pub(super) struct ServiceStub {
    /// Name, which no other module has.
    pub name: String,
    /// Type.
    pub kind: String,
    /// Module that it replaces.
    pub provider: String,
    /// Inputs, with the names of the provider's outputs that they read.
    pub inputs: Vec<PortDescription>,
}

fn ports(description: &Description, direction: Direction) -> impl Iterator<Item = &PortDescription> {
    description.ports.iter().filter(move |port| port.direction == direction)
}

/// Returns true if a module provides the service of a schema.
fn provides(description: &Description, schema: u64) -> bool {
    ports(description, Direction::Provider).any(|port| port.descriptor.hash == schema)
}

/// Returns the services of modules that a module needs.
fn needs(description: &Description) -> impl Iterator<Item = &'static Descriptor> {
    let wanted = ports(description, Direction::Aspect).map(|port| port.descriptor);
    wanted.filter(|wanted| aspects::services().all(|own| own.descriptor.hash != wanted.hash))
}

/// Returns stubs of the providers that do not run and are needed.
///
/// # Errors
/// When no module can replace such a provider.
pub(super) fn service_stubs(
    plugins: &[Plugin],
    descriptions: &SortedMap<String, Description>,
    modules: &SortedSet<String>,
) -> Result<Vec<ServiceStub>, String> {
    let mut all: Vec<ServiceStub> = Vec::new();
    let run = || modules.iter().filter_map(|name| Some((name, descriptions.get(name)?)));
    for (user, wanted) in run().flat_map(|(user, own)| needs(own).map(move |wanted| (user, wanted))) {
        if run().any(|(_, own)| provides(own, wanted.hash)) {
            continue;
        }
        // Without one, loading reports it.
        let provider = descriptions.iter().find(|(_, own)| provides(own, wanted.hash));
        let Some((provider, own)) = provider.filter(|(name, _)| all.iter().all(|own| own.provider != **name))
        else {
            continue;
        };
        let found = plugins.iter().flat_map(Plugin::kinds).find_map(|kind| {
            let setup =
                OwnSetup { name: kind.name().into(), seed: 0, period: 0, section: None, params: None };
            let inputs = plays(&describe(kind, &setup, DESCRIPTION).ok()?, own, wanted.hash)?;
            Some((kind.name().to_owned(), inputs))
        });
        let Some((kind, inputs)) = found else {
            return Err(format!(
                "`{user}` needs `{}` of `{provider}`, which no module can give it out of a recording: let `{provider}` run too",
                wanted.name
            ));
        };
        let names = iter::successors(Some(format!("{provider}_played")), |name| Some(format!("{name}_")));
        let free = names.into_iter().find(|name| !descriptions.contains_key(name) && !modules.contains(name));
        all.push(ServiceStub { name: free.unwrap_or_default(), kind, provider: provider.clone(), inputs });
    }
    Ok(all)
}

/// Returns the inputs of a module that can replace a provider of a service.
/// All of its inputs have the name and the interface of an output of the provider. `None` if the module can't replace
/// it.
fn plays(description: &Description, provider: &Description, service: u64) -> Option<Vec<PortDescription>> {
    let written = |wanted: &PortDescription| {
        let mut written = ports(provider, Direction::Output)
            .chain(ports(provider, Direction::Debug))
            .filter(|port| port.name == wanted.name && port.descriptor.hash == wanted.descriptor.hash);
        written.next().cloned()
    };
    let inputs = ports(description, Direction::Input).chain(ports(description, Direction::Queue));
    let inputs: Vec<_> = inputs.map(written).collect::<Option<_>>()?;
    (provides(description, service) && needs(description).next().is_none() && !inputs.is_empty())
        .then_some(inputs)
}

/// Returns the services that only absent modules used, in words.
/// Nothing calls them in the replay.
pub(super) fn unneeded(
    descriptions: &SortedMap<String, Description>,
    modules: &SortedSet<String>,
) -> Vec<String> {
    let mut unrecorded = Vec::new();
    for (name, own) in descriptions.iter().filter(|(name, _)| modules.contains(*name)) {
        for service in ports(own, Direction::Provider) {
            let uses = |own: &Description| needs(own).any(|wanted| wanted.hash == service.descriptor.hash);
            let users = descriptions.iter().filter(|(user, own)| !modules.contains(*user) && uses(own));
            let users: Vec<_> = users.map(|(user, _)| user.as_str()).collect();
            if !users.is_empty() {
                unrecorded.push(format!(
                    "what {} asked of {name} by `{}` is not recorded: let all of them run",
                    users.join(" and "),
                    service.descriptor.name
                ));
            }
        }
    }
    unrecorded
}
