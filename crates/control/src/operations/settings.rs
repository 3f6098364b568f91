//! Configuration while the agent runs.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::json;
use slate_runtime::configuration::SaveTo;

use super::{DRY_RUN, reply, shape};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace, Parameter};
use crate::problem::Problem;
use crate::surface::ControlSurface;
use crate::text::{Texts, texts};

pub(super) const LIST: Operation = Operation::get(
    "/settings",
    "settings",
    Role::Viewer,
    "Settings at a path and below, and the file of each",
)
.parameters(&[Parameter { name: "path", doc: "Path as in `--set`; all unless given.", schema: shape::text }])
.answers(|| shape::list(shape::setting()), list);

pub(super) const SET: Operation = Operation::patch(
    "/settings",
    "set",
    Role::Developer,
    "Changes settings, all or none, by their paths",
    Pace::Change,
)
.parameters(&[DRY_RUN])
.body(|| texts("Paths of settings and their values; at least one."))
.answers(|| shape::list(shape::changed()), set);

pub(super) const REVERT: Operation = Operation::delete(
    "/settings",
    "revert",
    Role::Developer,
    "Reverts changes made at run time that are not saved",
    Pace::Change,
)
.parameters(&[Parameter {
    name: "path",
    doc: "This path and what is below; all unless given.",
    schema: shape::text,
}])
.answers(|| shape::list(shape::changed()), revert);

pub(super) const DIFFERENCES: Operation = Operation::get(
    "/settings/differences",
    "differences",
    Role::Viewer,
    "Differences between the running configuration and its files",
)
.answers(|| shape::list(shape::different()), |surface, _| reply(surface.agent.settings.differences()));

pub(super) const REFUSED: Operation = Operation::get(
    "/settings/refused",
    "refused_edit",
    Role::Viewer,
    "Errors in edited files that were refused; null without any",
)
.answers(
    || {
        shape::optional(json!({
            "type": "object",
            "properties": {
                "message": shape::text(),
                "help": shape::text(),
                "code": shape::text(),
                "report": shape::text(),
            },
            "required": ["message", "help"],
            "additionalProperties": false,
        }))
    },
    |surface, _| reply(surface.agent.settings.refused_edit()),
);

pub(super) const SAVE: Operation = Operation::post(
    "/settings/save",
    "save",
    Role::Developer,
    "Saves changes made at run time to the files, and keeps comments", Pace::Change).parameters(&[DRY_RUN]).body(
        || json!({ "type": "object", "properties": { "to": { "enum": ["origin", "host"] } }, "additionalProperties": false }),
    ).answers(|| shape::object(&[("files", shape::list(shape::text()))]), save);

pub(super) fn list(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let found = surface.agent.settings.at(request.query.get("path").unwrap_or_default());
    found.map(OperationAnswer::json).map_err(|refusal| Problem::refused(StatusCode::NOT_FOUND, refusal))
}

fn set(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let changes = request.body::<Texts>()?.texts()?;
    if changes.is_empty() {
        return Err(Problem::unfit("the request has no change", "send paths and values"));
    }
    reply(surface.agent.settings.set(&changes, request.is_dry()?))
}

fn revert(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    reply(surface.agent.settings.revert(request.query.get("path").unwrap_or_default()))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct SaveRequest {
    #[serde(default)]
    to: SaveTo,
}

pub(super) fn save(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let save: SaveRequest = request.body_or_default()?;
    reply(surface.agent.settings.save(save.to, request.is_dry()?))
}
