//! The plugins.

use std::path::PathBuf;
use std::sync::Arc;

use serde_json::{Value as Json, json};

use super::{Named, TOKEN, conflict, file_shape, named, shape, told};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::operation::{Ask, Operation, Pace};
use crate::problem::Problem;

pub(super) const LIST: Operation = Operation {
    method: "GET",
    path: "/plugins",
    name: "plugins",
    summary: "The plugins that are loaded, and those that are known",
    role: Role::Viewer,
    pace: Pace::Prompt,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::plugin()),
    kinds: &[],
    handler: |context, _| told(context.agent.plugins()),
};

pub(super) const LOAD: Operation = Operation {
    method: "PUT",
    path: "/plugins/{plugin}",
    name: "load",
    summary: "Loads a plugin, or a list of plugins, of the configuration",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[],
    body: None,
    answer: loaded,
    kinds: &[],
    handler: load,
};

pub(super) const UNLOAD: Operation = Operation {
    method: "DELETE",
    path: "/plugins/{plugin}",
    name: "unload",
    summary: "Unloads a plugin, or those of a list",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[],
    body: None,
    answer: unloaded,
    kinds: &[],
    handler: unload,
};

pub(super) const RELOAD: Operation = Operation {
    method: "POST",
    path: "/plugins/{plugin}/reload",
    name: "reload",
    summary: "Exchanges the code of a plugin by what its library has now",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[],
    body: Some(file_shape),
    answer: reloaded,
    kinds: &[],
    handler: reload,
};

pub(super) const LOAD_LIBRARY: Operation = Operation {
    method: "POST",
    path: "/plugins",
    name: "load_library",
    summary: "Loads a library, at the computer of the agent alone",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[],
    body: Some(file_shape),
    answer: loaded,
    kinds: &[],
    handler: load_library,
};

pub(super) const SHADOW: Operation = Operation {
    method: "PUT",
    path: "/plugins/{plugin}/shadow",
    name: "shadow",
    summary: "Runs new code beside that of a plugin, at the computer of the agent alone; its outputs are compared and discarded",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[],
    body: Some(file_shape),
    answer: || shape::list(shape::list(shape::text())),
    kinds: &[],
    handler: shadow,
};

pub(super) const END_SHADOW: Operation = Operation {
    method: "DELETE",
    path: "/plugins/{plugin}/shadow",
    name: "end_shadow",
    summary: "Ends the new code beside a plugin",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[],
    body: None,
    answer: || json!({ "type": "null" }),
    kinds: &[],
    handler: |context, ask| named(context.agent.end_shadow(ask.part("plugin"))),
};

pub(super) const PROMOTE: Operation = Operation {
    method: "POST",
    path: "/plugins/{plugin}/promote",
    name: "promote",
    summary: "Replaces the code of a plugin by the new code beside it",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[],
    body: None,
    answer: reloaded,
    kinds: &[],
    handler: |context, ask| named(context.agent.promote(ask.part("plugin"))),
};

fn loaded() -> Json {
    let plugin = shape::object(&[("name", shape::text()), ("file", shape::optional(shape::text()))]);
    shape::object(&[("plugins", shape::list(plugin)), ("modules", shape::list(shape::text()))])
}

fn unloaded() -> Json {
    shape::list(shape::object(&[("name", shape::text()), ("library", shape::text())]))
}

fn reloaded() -> Json {
    let module =
        json!({ "type": "array", "items": shape::optional(shape::text()), "minItems": 2, "maxItems": 2 });
    shape::object(&[
        ("plugin", shape::text()),
        ("modules", shape::list(module)),
        ("in_place", shape::flag()),
        ("old_library", shape::text()),
    ])
}

/// The library that is named. None can be over the network, as whoever may load any file may do anything.
fn library(ask: &Ask) -> Result<PathBuf, Problem> {
    let Named { file } = ask.body()?;
    match ask.caller.local {
        Some(_) => Ok(file),
        None => {
            let help = "name a plugin of the configuration, or load the library at the computer of the agent";
            Err(Problem::bad("a library can't be named over the network", help))
        }
    }
}

fn load(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    named(context.agent.load(Some(ask.part("plugin")), None))
}

fn load_library(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    conflict(context.agent.load(None, Some(&library(ask)?)))
}

fn unload(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    named(context.agent.unload(ask.part("plugin")))
}

fn reload(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let file = ask.body.as_ref().map(|_| library(ask)).transpose()?;
    named(context.agent.reload(ask.part("plugin"), file.as_deref()))
}

fn shadow(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    named(context.agent.shadow(ask.part("plugin"), &library(ask)?))
}
