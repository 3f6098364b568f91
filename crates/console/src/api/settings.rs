//! The configuration while the agent runs.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::{Map, Value as Json, json};
use slate_runtime::configuration::SaveTo;
use slate_runtime::remote::Call;

use super::{DRY_RUN, TOKEN, ask, shape};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::{Ask, Operation, Parameter};
use crate::text::toml;

pub(super) const LIST: Operation = Operation {
    method: "GET",
    path: "/settings",
    name: "settings",
    summary: "The settings at a path and below it, and where each is written",
    role: Role::Viewer,
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
    parameters: &[DRY_RUN],
    body: Some(|| json!({ "type": "object", "minProperties": 1 })),
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
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::different()),
    kinds: &[],
    handler: |context, _| ask(context, Call::ConfigDiff {}),
};

pub(super) const SAVE: Operation = Operation {
    method: "POST",
    path: "/settings/save",
    name: "save",
    summary: "Writes what was changed at run time into the files, with their comments kept",
    role: Role::Developer,
    parameters: &[DRY_RUN],
    body: Some(
        || json!({ "type": "object", "properties": { "to": { "enum": ["origin", "host"] } }, "additionalProperties": false }),
    ),
    answer: || shape::object(&[("files", shape::list(shape::text()))]),
    kinds: &[],
    handler: save,
};

pub(super) fn list(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let path = asked.query.get("path").unwrap_or_default().to_owned();
    let found = context.desk.make(Call::ConfigGet { path });
    found.map(Answer::json).map_err(|refusal| Problem::refused(StatusCode::NOT_FOUND, refusal))
}

pub(super) fn set(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let body: Map<String, Json> = asked.body()?;
    let changes = body.iter().map(|(path, value)| Ok((path.clone(), toml(value)?)));
    let changes: Vec<_> = changes.collect::<Result<_, Problem>>()?;
    if changes.is_empty() {
        return Err(Problem::unfit("there is nothing to be set", "send paths and values"));
    }
    ask(context, Call::ConfigSet { changes, dry_run: asked.is_dry()? })
}

pub(super) fn revert(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    ask(context, Call::ConfigRevert { path: asked.query.get("path").unwrap_or_default().into() })
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Save {
    #[serde(default)]
    to: SaveTo,
}

pub(super) fn save(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let save: Save = asked.body_or_default()?;
    ask(context, Call::ConfigSave { to: save.to, dry_run: asked.is_dry()? })
}
