//! Recordings by name.
//! Files can't be named freely: a caller that may name any file may overwrite any.

use std::fs::{DirEntry, File, read_dir};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyper::StatusCode;
use serde_json::{Value as Json, json};
use slate_runtime::recording::RecordingStatus;

use super::{conflict, in_conflict, local_file, shape};
use crate::Role;
use crate::agent::RecordingRequest;
use crate::answer::{OCTET_STREAM, OperationAnswer};
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;
use crate::surface::ControlSurface;

pub(super) const LIST: Operation = Operation::get(
    "/recordings",
    "recordings",
    Role::Viewer,
    "Recordings in progress, and those in the folder of the report",
)
.answers(
    || {
        shape::object(&[
            ("recordings", shape::list(entry_shape())),
            ("flight", shape::optional(flight_shape())),
            ("files", shape::list(shape::object(&[("name", shape::text()), ("bytes", shape::count())]))),
            ("can_record", shape::flag()),
        ])
    },
    list,
);

pub(super) const START: Operation = Operation::post(
    "/recordings/{recording}",
    "start_recording",
    Role::Operator,
    "Starts a recording into a new file of this name in the folder of the report", Pace::Slow).body(|| {
        let patterns = || shape::list(shape::text());
        json!({
            "type": "object",
            "properties": {
                "select": patterns(),
                "exclude": patterns(),
                "rate": { "type": ["number", "null"], "exclusiveMinimum": 0, "description": "Maximum values per second of each property." },
                "on_change": { "type": "boolean", "description": "Only values that differ from the previous one." },
            },
            "additionalProperties": false,
        })
    }).needs_run().answers(|| shape::object(&[("file", shape::text())]), start);

pub(super) const END_ONLY: Operation = Operation::delete(
    "/recordings",
    "stop_only_recording",
    Role::Operator,
    "Stops the only recording",
    Pace::Slow,
)
.answers(entry_shape, |surface, _| conflict(surface.agent.stop_recording(None)));

pub(super) const END: Operation = Operation::post(
    "/recordings/{recording}/stop",
    "stop_recording",
    Role::Operator,
    "Stops a recording and completes its file",
    Pace::Slow,
)
.answers(entry_shape, stop);

pub(super) const FLIGHT: Operation = Operation::post(
    "/recordings/{recording}/snapshot",
    "save_flight",
    Role::Operator,
    "Saves the flight recorder's seconds into a new file",
    Pace::Slow,
)
.answers(
    || {
        shape::object(&[
            ("file", shape::text()),
            ("from", shape::count()),
            ("to", shape::count()),
            ("values", shape::count()),
            ("bytes", shape::count()),
        ])
    },
    snapshot,
);

pub(super) const FETCH: Operation = Operation::get(
    "/recordings/{recording}",
    "fetch_recording",
    Role::Viewer,
    "File of a finished recording",
)
.kinds(&[OCTET_STREAM])
.answers(shape::anything, fetch);

fn entry_shape() -> Json {
    json!({
        "type": "object",
        "properties": {
            "file": shape::text(),
            "from": shape::count(),
            "values": shape::count(),
            "dropped": shape::count(),
            "bytes": shape::count(),
            "failure": shape::text(),
        },
        "required": ["file", "from", "values", "dropped", "bytes"],
        "additionalProperties": false,
    })
}

fn flight_shape() -> Json {
    let count = shape::count;
    shape::object(&[
        ("keep", count()),
        ("from", count()),
        ("to", count()),
        ("bytes", count()),
        ("memory", count()),
        ("saved", shape::list(shape::text())),
        ("skipped", count()),
    ])
}

/// Returns the state of the recordings; empty for an agent without a recorder.
fn recorder(surface: &ControlSurface) -> Option<RecordingStatus> {
    serde_json::from_value(surface.agent.recording_status().ok()?).ok()
}

fn recorded(surface: &ControlSurface) -> RecordingStatus {
    recorder(surface).unwrap_or_default()
}

/// File extension of recordings.
const EXTENSION: &str = "mcap";

/// Returns the file of a recording, or of one that is made beside it.
fn file(
    surface: &ControlSurface,
    request: &OperationRequest,
    name: &str,
    kind: &str,
) -> Result<PathBuf, Problem> {
    if let Some(path) = local_file(request, name) {
        return Ok(path);
    }
    let name = name.strip_suffix(kind).and_then(|name| name.strip_suffix('.')).unwrap_or(name);
    if name.is_empty()
        || name.len() > 64
        || !name.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'_' || c == b'-')
    {
        let help = "it has at most 64 letters, digits, _ and -";
        return Err(Problem::bad(format!("`{name}` can't be the name of a recording"), help));
    }
    let nothing = || {
        let help = "`slate run` has a recorder; a program gives its agent one with `Options::recording`";
        Problem::new(StatusCode::CONFLICT, "this agent has nothing that records", help)
    };
    Ok(recorded(surface).folder.ok_or_else(nothing)?.join(format!("{name}.{kind}")))
}

/// Returns a file that does not exist yet, in an existing folder.
pub(super) fn new_file(
    surface: &ControlSurface,
    request: &OperationRequest,
    name: &str,
    kind: &str,
) -> Result<PathBuf, Problem> {
    if let Some(path) = local_file(request, name) {
        // Its creation reports the error.
        return Ok(path);
    }
    let file = file(surface, request, name, kind)?;
    let unusable = |error: std::io::Error| {
        let message = format!("the folder of recordings can't be used: {error}");
        Problem::new(StatusCode::CONFLICT, message, "run it with `--out` into a folder that it may write to")
    };
    std::fs::create_dir_all(file.parent().unwrap_or(Path::new(""))).map_err(unusable)?;
    if file.exists() {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let message = format!("a {name} already exists");
        return Err(Problem::new(StatusCode::CONFLICT, message, "take another name"));
    }
    Ok(file)
}

fn list(surface: &Arc<ControlSurface>, _: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let status = recorder(surface);
    let can_record = status.is_some();
    let RecordingStatus { recordings, flight, folder } = status.unwrap_or_default();
    let entry = |entry: DirEntry| {
        let path = entry.path();
        let name = path.file_stem().filter(|_| path.extension().is_some_and(|own| own == "mcap"))?;
        Some((name.to_str()?.to_owned(), entry.metadata().ok()?.len()))
    };
    // A folder that is not there yet has no files.
    let entries = folder.into_iter().filter_map(|folder| read_dir(folder).ok()).flatten().flatten();
    let mut files: Vec<_> = entries.filter_map(entry).collect();
    files.sort_unstable();
    let file = |(name, bytes)| json!({ "name": name, "bytes": bytes });
    let files: Vec<_> = files.into_iter().map(file).collect();
    Ok(OperationAnswer::json(
        json!({ "recordings": recordings, "flight": flight, "files": files, "can_record": can_record }),
    ))
}

fn start(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let recording: RecordingRequest = request.body_or_default()?;
    let file = new_file(surface, request, request.part("recording")?, EXTENSION)?;
    surface.agent.start_recording(&file, &recording).map_err(in_conflict)?;
    Ok(OperationAnswer::json(json!({ "file": file })))
}

fn stop(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    conflict(surface.agent.stop_recording(Some(&file(
        surface,
        request,
        request.part("recording")?,
        EXTENSION,
    )?)))
}

fn fetch(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let name = request.part("recording")?;
    let path = file(surface, request, name, EXTENSION)?;
    if recorded(surface).recordings.iter().any(|entry| entry.file == path && entry.failure.is_none()) {
        let message = format!("{name}.{EXTENSION} is still being recorded");
        let help = format!("end it first: POST /api/v1/recordings/{name}/stop");
        return Err(Problem::new(StatusCode::CONFLICT, message, help));
    }
    let opened = File::open(&path).and_then(|file| file.metadata().map(|metadata| (file, metadata.len())));
    let missing = |error: std::io::Error| {
        let message = format!("there is no {name}.{EXTENSION} that can be read: {error}");
        Problem::not_found(message, "GET /api/v1/recordings lists them")
    };
    let (file, length) = opened.map_err(missing)?;
    Ok(OperationAnswer::File(file, length))
}

fn snapshot(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    conflict(surface.agent.save_flight(&new_file(surface, request, request.part("recording")?, EXTENSION)?))
}
