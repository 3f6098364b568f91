//! The configuration while the agent runs.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::json;
use slate_runtime::configuration::SaveTo;

use super::{DRY_RUN, TOKEN, shape, told};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::operation::{Ask, Operation, Pace, Parameter};
use crate::problem::Problem;
use crate::text::{Texts, texts};

pub(super) const LIST: Operation = Operation {
    method: "GET",
    path: "/settings",
    name: "settings",
    summary: "The settings at a path and below it, and where each is written",
    role: Role::Viewer,
    pace: Pace::Slow,
    parameters: &[
        Parameter { name: "path", doc: "As --set takes it; all unless given.", schema: shape::text },
        TOKEN,
    ],
    body: None,
    answer: || shape::list(shape::setting()),
    kinds: &[],
    handler: list,
};

pub(super) const SET: Operation = Operation {
    method: "PATCH",
    path: "/settings",
    name: "set",
    summary: "Changes settings, all or none, by their paths",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[DRY_RUN],
    body: Some(|| texts("Paths of settings and their values; at least one.")),
    answer: || shape::list(shape::changed()),
    kinds: &[],
    handler: set,
};

pub(super) const REVERT: Operation = Operation {
    method: "DELETE",
    path: "/settings",
    name: "revert",
    summary: "Takes back what was changed at run time and not saved",
    role: Role::Developer,
    pace: Pace::Slow,
    parameters: &[Parameter {
        name: "path",
        doc: "That and what is below it; all unless given.",
        schema: shape::text,
    }],
    body: None,
    answer: || shape::list(shape::changed()),
    kinds: &[],
    handler: revert,
};

pub(super) const DIFFERENCES: Operation = Operation {
    method: "GET",
    path: "/settings/differences",
    name: "differences",
    summary: "What holds and is not what the files say",
    role: Role::Viewer,
    pace: Pace::Slow,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::different()),
    kinds: &[],
    handler: |context, _| told(context.agent.differences()),
};

pub(super) const REFUSED: Operation = Operation {
    method: "GET",
    path: "/settings/refused",
    name: "refused_edit",
    summary: "What is wrong with files that were edited and are refused; null when nothing is",
    role: Role::Viewer,
    pace: Pace::Slow,
    parameters: &[TOKEN],
    body: None,
    answer: || {
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
    kinds: &[],
    handler: |context, _| told(context.agent.refused_edit()),
};

pub(super) const SAVE: Operation = Operation {
    method: "POST",
    path: "/settings/save",
    name: "save",
    summary: "Writes what was changed at run time into the files, with their comments kept",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[DRY_RUN],
    body: Some(
        || json!({ "type": "object", "properties": { "to": { "enum": ["origin", "host"] } }, "additionalProperties": false }),
    ),
    answer: || shape::object(&[("files", shape::list(shape::text()))]),
    kinds: &[],
    handler: save,
};

pub(super) fn list(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let found = context.agent.settings_at(asked.query.get("path").unwrap_or_default());
    found.map(Answer::json).map_err(|refusal| Problem::refused(StatusCode::NOT_FOUND, refusal))
}

fn set(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let changes = asked.body::<Texts>()?.texts()?;
    if changes.is_empty() {
        return Err(Problem::unfit("there is nothing to be set", "send paths and values"));
    }
    told(context.agent.set(&changes, asked.is_dry()?))
}

fn revert(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    told(context.agent.revert(asked.query.get("path").unwrap_or_default()))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Save {
    #[serde(default)]
    to: SaveTo,
}

pub(super) fn save(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let save: Save = asked.body_or_default()?;
    told(context.agent.save(save.to, asked.is_dry()?))
}
