//! The configuration while the agent runs.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::json;
use slate_runtime::configuration::SaveTo;

use super::{DRY_RUN, TOKEN, shape, told};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::context::Context;
use crate::operation::{Operation, OperationRequest, Pace, Parameter};
use crate::problem::Problem;
use crate::text::{Texts, texts};

pub(super) const LIST: Operation = Operation::get(
    "/settings",
    "settings",
    Role::Viewer,
    "The settings at a path and below it, and where each is written",
)
.parameters(&[
    Parameter { name: "path", doc: "As --set takes it; all unless given.", schema: shape::text },
    TOKEN,
])
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
    "Takes back what was changed at run time and not saved",
    Pace::Change,
)
.parameters(&[Parameter {
    name: "path",
    doc: "That and what is below it; all unless given.",
    schema: shape::text,
}])
.answers(|| shape::list(shape::changed()), revert);

pub(super) const DIFFERENCES: Operation = Operation::get(
    "/settings/differences",
    "differences",
    Role::Viewer,
    "What holds and is not what the files say",
)
.answers(|| shape::list(shape::different()), |context, _| told(context.agent.settings.differences()));

pub(super) const REFUSED: Operation = Operation::get(
    "/settings/refused",
    "refused_edit",
    Role::Viewer,
    "What is wrong with files that were edited and are refused; null when nothing is",
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
    |context, _| told(context.agent.settings.refused_edit()),
);

pub(super) const SAVE: Operation = Operation::post(
    "/settings/save",
    "save",
    Role::Developer,
    "Writes what was changed at run time into the files, with their comments kept", Pace::Change).parameters(&[DRY_RUN]).body(
        || json!({ "type": "object", "properties": { "to": { "enum": ["origin", "host"] } }, "additionalProperties": false }),
    ).answers(|| shape::object(&[("files", shape::list(shape::text()))]), save);

pub(super) fn list(context: &Arc<Context>, asked: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let found = context.agent.settings.at(asked.query.get("path").unwrap_or_default());
    found.map(OperationAnswer::json).map_err(|refusal| Problem::refused(StatusCode::NOT_FOUND, refusal))
}

fn set(context: &Arc<Context>, asked: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let changes = asked.body::<Texts>()?.texts()?;
    if changes.is_empty() {
        return Err(Problem::unfit("there is nothing to be set", "send paths and values"));
    }
    told(context.agent.settings.set(&changes, asked.is_dry()?))
}

fn revert(context: &Arc<Context>, asked: &OperationRequest) -> Result<OperationAnswer, Problem> {
    told(context.agent.settings.revert(asked.query.get("path").unwrap_or_default()))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct SaveRequest {
    #[serde(default)]
    to: SaveTo,
}

pub(super) fn save(context: &Arc<Context>, asked: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let save: SaveRequest = asked.body_or_default()?;
    told(context.agent.settings.save(save.to, asked.is_dry()?))
}
