//! The configuration while the agent runs.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::{Map, Value as Json};
use slate_runtime::configuration::SaveTo;
use slate_runtime::remote::Call;

use super::ask;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::Ask;
use crate::text::toml;

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
    ask(context, Call::ConfigSave { to: save.to })
}
