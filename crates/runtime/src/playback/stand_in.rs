//! Modules that run in the place of others which provide services.

use std::collections::{BTreeMap, BTreeSet};
use std::iter;

use slate_blackboard::interface::Descriptor;
use slate_module::{Description, Direction, Plugin, PortDescription};

use super::DESCRIPTION;
use crate::aspects;
use slate_engine::runner::{OwnSetup, describe};

/// A module that gives others the service of one that does not run, out of what that one wrote.
#[derive(Debug)]
pub(super) struct StandIn {
    /// Its name, which no other module has.
    pub name: String,
    /// Its type.
    pub kind: String,
    /// Whose place it takes.
    pub provider: String,
    /// What it reads: outputs of the provider, which its own inputs are called after.
    pub inputs: Vec<PortDescription>,
}

fn ports(description: &Description, direction: Direction) -> impl Iterator<Item = &PortDescription> {
    description.ports.iter().filter(move |port| port.direction == direction)
}

/// Whether a module provides the service of that schema.
fn provides(description: &Description, schema: u64) -> bool {
    ports(description, Direction::Provider).any(|port| port.descriptor.hash == schema)
}

/// The services of modules that a module needs.
fn needs(description: &Description) -> impl Iterator<Item = &'static Descriptor> {
    let wanted = ports(description, Direction::Aspect).map(|port| port.descriptor);
    wanted.filter(|wanted| aspects::services().all(|own| own.hash != wanted.hash))
}

/// Those that modules need whose providers do not run.
///
/// # Errors
/// When nothing can take such a provider's place.
pub(super) fn stand_ins(
    plugins: &[Plugin],
    descriptions: &BTreeMap<String, Description>,
    modules: &BTreeSet<String>,
) -> Result<Vec<StandIn>, String> {
    let mut all: Vec<StandIn> = Vec::new();
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
        all.push(StandIn { name: free.unwrap_or_default(), kind, provider: provider.clone(), inputs });
    }
    Ok(all)
}

/// What a module reads that provides a service out of what another one writes that does: all its inputs are called as outputs of
/// that one, and of the same interface. Nothing when it is not made for that.
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

/// What those who run gave by services to those who do not: nobody asks for it now, in words.
pub(super) fn unasked(
    descriptions: &BTreeMap<String, Description>,
    modules: &BTreeSet<String>,
) -> Vec<String> {
    let mut told = Vec::new();
    for (name, own) in descriptions.iter().filter(|(name, _)| modules.contains(*name)) {
        for service in ports(own, Direction::Provider) {
            let asks = |own: &Description| needs(own).any(|wanted| wanted.hash == service.descriptor.hash);
            let users = descriptions.iter().filter(|(user, own)| !modules.contains(*user) && asks(own));
            let users: Vec<_> = users.map(|(user, _)| user.as_str()).collect();
            if !users.is_empty() {
                told.push(format!(
                    "what {} asked of {name} by `{}` is not recorded: let all of them run",
                    users.join(" and "),
                    service.descriptor.name
                ));
            }
        }
    }
    told
}
