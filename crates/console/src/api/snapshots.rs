//! Snapshots, by names: whoever may name any file may overwrite any.

use std::path::PathBuf;
use std::sync::Arc;

use hyper::StatusCode;
use serde_json::json;
use slate_runtime::remote::Call;

use super::shape;
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::{Ask, Operation};

pub(super) const LOAD: Operation = Operation {
    method: "POST",
    path: "/snapshots/{snapshot}/load",
    name: "load_snapshot",
    summary: "Goes on from a snapshot",
    role: Role::Developer,
    parameters: &[],
    body: None,
    answer: shape::snapshot,
    kinds: &[],
    handler: load,
};

pub(super) const SAVE: Operation = Operation {
    method: "POST",
    path: "/snapshots/{snapshot}",
    name: "save_snapshot",
    summary: "Takes a snapshot, into the folder `snapshots` where the agent was started",
    role: Role::Developer,
    parameters: &[],
    body: None,
    answer: shape::snapshot,
    kinds: &[],
    handler: save,
};

/// How the files of snapshots end.
pub(crate) const KIND: &str = "snapshot";

/// The file of a snapshot.
pub(crate) fn file(name: &str, kind: &str) -> Result<PathBuf, Problem> {
    if name.is_empty()
        || name.len() > 64
        || !name.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'_' || c == b'-')
    {
        let help = "it has at most 64 letters, digits, _ and -";
        return Err(Problem::bad(format!("`{name}` can't be the name of a snapshot"), help));
    }
    let wrong = |error: std::io::Error| {
        let message = format!("the folder of snapshots can't be used: {error}");
        Problem::new(StatusCode::CONFLICT, message, "start the agent in a folder that it may write to")
    };
    let folder = std::env::current_dir().map_err(wrong)?.join("snapshots");
    std::fs::create_dir_all(&folder).map_err(wrong)?;
    Ok(folder.join(format!("{name}.{kind}")))
}

pub(super) fn save(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let file = file(ask.part("snapshot"), KIND)?;
    make(context, Call::SnapshotSave { file: file.clone() }, file)
}

pub(super) fn load(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let file = file(ask.part("snapshot"), KIND)?;
    if !file.is_file() {
        let message = format!("there is no snapshot `{}`", ask.part("snapshot"));
        return Err(Problem::not_found(message, "take one with POST /api/v1/snapshots/NAME"));
    }
    make(context, Call::SnapshotLoad { file: file.clone() }, file)
}

fn make(context: &Context, call: Call, file: PathBuf) -> Result<Answer, Problem> {
    let made = context.desk.make(call).map_err(|refusal| Problem::refused(StatusCode::CONFLICT, refusal));
    made.map(|mut entry| {
        entry["file"] = json!(file);
        Answer::json(entry)
    })
}
