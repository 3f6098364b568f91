//! The plugins.

use std::sync::Arc;

use slate_runtime::remote::Call;

use super::{TOKEN, ask, conflict, shape};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::{Ask, Operation};

pub(super) const LIST: Operation = Operation {
    method: "GET",
    path: "/plugins",
    name: "plugins",
    summary: "The plugins that are loaded, and those that are known",
    role: Role::Viewer,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::plugin()),
    kinds: &[],
    handler: |context, _| ask(context, Call::PluginList {}),
};

pub(super) const LOAD: Operation = Operation {
    method: "PUT",
    path: "/plugins/{plugin}",
    name: "load",
    summary: "Loads a plugin, or a list of plugins, of the configuration",
    role: Role::Developer,
    parameters: &[],
    body: None,
    answer: shape::anything,
    kinds: &[],
    handler: load,
};

pub(super) const UNLOAD: Operation = Operation {
    method: "DELETE",
    path: "/plugins/{plugin}",
    name: "unload",
    summary: "Unloads a plugin, or those of a list",
    role: Role::Developer,
    parameters: &[],
    body: None,
    answer: shape::anything,
    kinds: &[],
    handler: unload,
};

pub(super) const RELOAD: Operation = Operation {
    method: "POST",
    path: "/plugins/{plugin}/reload",
    name: "reload",
    summary: "Exchanges the code of a plugin by what its library has now",
    role: Role::Developer,
    parameters: &[],
    body: None,
    answer: shape::anything,
    kinds: &[],
    handler: reload,
};

/// The plugin that is named, or list of plugins; a library can't be, as whoever may load any file may do anything.
fn plugin(context: &Context, ask: &Ask) -> Result<String, Problem> {
    let name = ask.part("plugin").to_owned();
    let composer = context.desk.composer();
    let mut known: Vec<_> = composer.plugins().into_iter().map(|plugin| plugin.name).collect();
    let current = context.desk.settings().map(|settings| settings.current());
    let entries = current.iter().flat_map(|configuration| configuration.plugins());
    known.extend(entries.map(|entry| entry.name.value.clone()));
    if known.contains(&name) {
        return Ok(name);
    }
    Err(Problem::not_found(format!("no plugin is called `{name}`"), "GET /api/v1/plugins lists them"))
}

pub(super) fn load(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    conflict(context, Call::PluginLoad { name: Some(plugin(context, ask)?), file: None })
}

pub(super) fn unload(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    conflict(context, Call::PluginUnload { name: plugin(context, ask)? })
}

pub(super) fn reload(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    conflict(context, Call::PluginReload { name: plugin(context, ask)?, file: None })
}
