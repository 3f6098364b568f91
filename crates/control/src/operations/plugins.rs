//! Plugins.

use std::path::PathBuf;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Value as Json, json};

use super::{Named, conflict, file_shape, named, reply, shape};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;
use crate::surface::ControlSurface;

pub(super) const LIST: Operation =
    Operation::get("/plugins", "plugins", Role::Viewer, "Plugins, loaded and available")
        .pace(Pace::Prompt)
        .answers(|| shape::list(shape::plugin()), |surface, _| reply(surface.agent.plugins()));

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
    "Reloads a plugin from its library",
    Pace::Change,
)
.body(|| {
    let file = json!({
        "type": "string",
        "description": "Absolute path on the agent's machine; the plugin's own library unless given.",
    });
    json!({ "type": "object", "properties": { "file": file }, "additionalProperties": false })
})
.answers(reloaded, reload);

pub(super) const LOAD_LIBRARY: Operation = Operation::post(
    "/plugins",
    "load_library",
    Role::Developer,
    "Loads a library; only from the agent's machine",
    Pace::Change,
)
.body(file_shape)
.answers(loaded, load_library);

pub(super) const SHADOW: Operation = Operation::put(
    "/plugins/{plugin}/shadow",
    "shadow",
    Role::Developer,
    "Runs new code beside that of a plugin, on the agent's machine alone; its outputs are \
     compared and discarded",
    Pace::Change,
)
.body(file_shape)
.answers(|| shape::list(shape::list(shape::text())), shadow);

pub(super) const END_SHADOW: Operation = Operation::delete(
    "/plugins/{plugin}/shadow",
    "end_shadow",
    Role::Developer,
    "Discards the trial code of a plugin",
    Pace::Change,
)
.answers(
    || json!({ "type": "null" }),
    |surface, request| named(surface.agent.end_shadow(request.part("plugin")?)),
);

pub(super) const PROMOTE: Operation = Operation::post(
    "/plugins/{plugin}/promote",
    "promote",
    Role::Developer,
    "Promotes the trial code of a plugin",
    Pace::Change,
)
.answers(reloaded, |surface, request| named(surface.agent.promote(request.part("plugin")?)));

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

/// Returns the named library, or an error for a caller over the network.
/// A caller that may load any file may do anything.
fn library(request: &OperationRequest) -> Result<PathBuf, Problem> {
    let Named { file } = request.body()?;
    check_local(request, file)
}

fn check_local(request: &OperationRequest, file: PathBuf) -> Result<PathBuf, Problem> {
    match request.caller.local {
        Some(_) => Ok(file),
        None => {
            let help = "name a plugin of the configuration, or load the library on the agent's machine";
            Err(Problem::bad("a library can't be named over the network", help))
        }
    }
}

fn load(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    named(surface.agent.load(Some(request.part("plugin")?), None))
}

fn load_library(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    conflict(surface.agent.load(None, Some(&library(request)?)))
}

fn unload(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    named(surface.agent.unload(request.part("plugin")?))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ReloadRequest {
    #[serde(default)]
    file: Option<PathBuf>,
}

fn reload(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let ReloadRequest { file } = request.body_or_default()?;
    let file = file.map(|file| check_local(request, file)).transpose()?;
    named(surface.agent.reload(request.part("plugin")?, file.as_deref()))
}

fn shadow(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    named(surface.agent.shadow(request.part("plugin")?, &library(request)?))
}
