//! Snapshots by name.
//! Files can't be named freely: a caller that may name any file may overwrite any.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::json;

use super::{conflict, in_conflict, local_file, shape};
use crate::Role;
use crate::agent::{Done, absolute};
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;
use crate::surface::ControlSurface;

pub(super) const LOAD: Operation = Operation::post(
    "/snapshots/{snapshot}/load",
    "load_snapshot",
    Role::Developer,
    "Resumes from a snapshot",
    Pace::Change,
)
.needs_run()
.answers(shape::snapshot, load);

pub(super) const SAVE: Operation = Operation::post(
    "/snapshots/{snapshot}",
    "save_snapshot",
    Role::Developer,
    "Saves a snapshot to the folder `snapshots` where the agent was started",
    Pace::Change,
)
.answers(shape::snapshot, save);

pub(super) const VALUES: Operation = Operation::post(
    "/snapshots/{snapshot}/values",
    "save_values",
    Role::Developer,
    "Writes the newest values of another agent's properties, such as slate://robot/**, into a \
     file of JSON beside the snapshots",
    Pace::Slow,
)
.body(|| shape::object(&[("url", shape::text())]))
.answers(
    || {
        shape::object(&[
            ("agent", shape::text()),
            ("properties", shape::count()),
            ("values", shape::count()),
            ("unavailable", shape::count()),
        ])
    },
    values,
);

/// File extension of snapshots.
const EXTENSION: &str = "snapshot";

/// Returns the file of a snapshot: a name in the folder of snapshots.
/// For a caller on this machine also any absolute path.
fn file(request: &OperationRequest, kind: &str) -> Result<PathBuf, Problem> {
    let name = request.part("snapshot")?;
    if let Some(path) = local_file(request, name) {
        return Ok(path);
    }
    let name = name.strip_suffix(kind).and_then(|name| name.strip_suffix('.')).unwrap_or(name);
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

fn save(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let file = file(request, EXTENSION)?;
    placed(surface.agent.save_snapshot(&file), &file)
}

fn load(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let file = file(request, EXTENSION)?;
    if request.caller.local.is_none() && !file.is_file() {
        let message = format!("there is no snapshot `{}`", request.part("snapshot")?);
        return Err(Problem::not_found(message, "take one with POST /api/v1/snapshots/NAME"));
    }
    placed(surface.agent.load_snapshot(&file), &file)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Values {
    url: String,
}

fn values(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let Values { url } = request.body()?;
    conflict(surface.agent.properties.remote.snapshot(&url, absolute(&file(request, "json")?)?))
}

fn placed(done: Done, file: &Path) -> Result<OperationAnswer, Problem> {
    done.map_err(in_conflict).map(|mut entry| {
        entry["file"] = json!(file);
        OperationAnswer::json(entry)
    })
}
