//! The plugins.

use std::path::PathBuf;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Value as Json, json};

use super::{Named, conflict, file_shape, named, shape, told};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::context::Context;
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;

pub(super) const LIST: Operation = Operation::get(
    "/plugins",
    "plugins",
    Role::Viewer,
    "The plugins that are loaded, and those that are known",
)
.pace(Pace::Prompt)
.answers(|| shape::list(shape::plugin()), |context, _| told(context.agent.plugins()));

pub(super) const LOAD: Operation = Operation::put(
    "/plugins/{plugin}",
    "load",
    Role::Developer,
    "Loads a plugin, or a list of plugins, of the configuration",
    Pace::Change,
)
.answers(loaded, load);

pub(super) const UNLOAD: Operation = Operation::delete(
    "/plugins/{plugin}",
    "unload",
    Role::Developer,
    "Unloads a plugin, or those of a list",
    Pace::Change,
)
.answers(unloaded, unload);

pub(super) const RELOAD: Operation = Operation::post(
    "/plugins/{plugin}/reload",
    "reload",
    Role::Developer,
    "Exchanges the code of a plugin by what its library has now",
    Pace::Change,
)
.body(|| {
    let file = json!({
        "type": "string",
        "description": "An absolute path at the computer of the agent; the plugin's own library unless given.",
    });
    json!({ "type": "object", "properties": { "file": file }, "additionalProperties": false })
})
.answers(reloaded, reload);

pub(super) const LOAD_LIBRARY: Operation = Operation::post(
    "/plugins",
    "load_library",
    Role::Developer,
    "Loads a library, at the computer of the agent alone",
    Pace::Change,
)
.body(file_shape)
.answers(loaded, load_library);

pub(super) const SHADOW: Operation = Operation::put(
    "/plugins/{plugin}/shadow",
    "shadow",
    Role::Developer,
    "Runs new code beside that of a plugin, at the computer of the agent alone; its outputs are \
     compared and discarded",
    Pace::Change,
)
.body(file_shape)
.answers(|| shape::list(shape::list(shape::text())), shadow);

pub(super) const END_SHADOW: Operation = Operation::delete(
    "/plugins/{plugin}/shadow",
    "end_shadow",
    Role::Developer,
    "Ends the new code beside a plugin",
    Pace::Change,
)
.answers(|| json!({ "type": "null" }), |context, ask| named(context.agent.end_shadow(ask.part("plugin"))));

pub(super) const PROMOTE: Operation = Operation::post(
    "/plugins/{plugin}/promote",
    "promote",
    Role::Developer,
    "Replaces the code of a plugin by the new code beside it",
    Pace::Change,
)
.answers(reloaded, |context, ask| named(context.agent.promote(ask.part("plugin"))));

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
fn library(ask: &OperationRequest) -> Result<PathBuf, Problem> {
    let Named { file } = ask.body()?;
    check_local(ask, file)
}

fn check_local(ask: &OperationRequest, file: PathBuf) -> Result<PathBuf, Problem> {
    match ask.caller.local {
        Some(_) => Ok(file),
        None => {
            let help = "name a plugin of the configuration, or load the library at the computer of the agent";
            Err(Problem::bad("a library can't be named over the network", help))
        }
    }
}

fn load(context: &Arc<Context>, ask: &OperationRequest) -> Result<OperationAnswer, Problem> {
    named(context.agent.load(Some(ask.part("plugin")), None))
}

fn load_library(context: &Arc<Context>, ask: &OperationRequest) -> Result<OperationAnswer, Problem> {
    conflict(context.agent.load(None, Some(&library(ask)?)))
}

fn unload(context: &Arc<Context>, ask: &OperationRequest) -> Result<OperationAnswer, Problem> {
    named(context.agent.unload(ask.part("plugin")))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ReloadRequest {
    #[serde(default)]
    file: Option<PathBuf>,
}

fn reload(context: &Arc<Context>, ask: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let ReloadRequest { file } = ask.body_or_default()?;
    let file = file.map(|file| check_local(ask, file)).transpose()?;
    named(context.agent.reload(ask.part("plugin"), file.as_deref()))
}

fn shadow(context: &Arc<Context>, ask: &OperationRequest) -> Result<OperationAnswer, Problem> {
    named(context.agent.shadow(ask.part("plugin"), &library(ask)?))
}
