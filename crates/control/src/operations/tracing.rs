//! Execution traces for Perfetto.
//! A trace belongs to the connection that records it, and is discarded when that closes before its end.

use std::sync::Arc;

use serde_json::{Value as Json, json};

use super::{Named, file_shape, in_conflict, recordings, shape};
use crate::Role;
use crate::agent::absolute;
use crate::answer::OperationAnswer;
use crate::entries::TraceEntry;
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;
use crate::surface::ControlSurface;

pub(super) const RECORD: Operation = Operation::post(
    "/trace",
    "record_trace",
    Role::Developer,
    "Begins to record what runs when, into a file that Perfetto opens; it is discarded if this \
     connection closes before the end",
    Pace::Slow,
)
.body(file_shape)
.answers(|| json!({ "type": "object", "maxProperties": 0 }), record);

pub(super) const PROGRESS: Operation =
    Operation::get("/trace", "trace_progress", Role::Developer, "The trace that this connection records")
        .pace(Pace::Prompt)
        .answers(entry, |_, request| {
            answer(request.caller.connection.with_trace(|trace| trace.progress()).map_err(in_conflict)?)
        });

pub(super) const END: Operation = Operation::delete(
    "/trace",
    "end_trace",
    Role::Developer,
    "Stops this connection's trace and writes its file",
    Pace::Prompt,
)
.answers(entry, |_, request| {
    answer(request.caller.connection.with_trace(|trace| trace.end()).map_err(in_conflict)?)
});

/// Maximum number of connections that record at once.
const MAX_TRACES: usize = 32;

fn entry() -> Json {
    let track =
        shape::object(&[("name", shape::text()), ("spans", shape::count()), ("missing", shape::count())]);
    shape::object(&[
        ("file", shape::text()),
        ("ended", shape::flag()),
        ("from", shape::count()),
        ("to", shape::count()),
        ("tracks", shape::list(track)),
    ])
}

fn answer(entry: TraceEntry) -> Result<OperationAnswer, Problem> {
    Ok(OperationAnswer::json(json!(entry)))
}

fn record(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let Named { file } = request.body()?;
    if request.caller.connection.traces() >= MAX_TRACES {
        return Err(Problem::too_many());
    }
    let file = match request.caller.local {
        Some(_) => absolute(&file).map_err(in_conflict)?.to_owned(),
        None => recordings::new_file(surface, request, &file.to_string_lossy(), "json")?,
    };
    let begun = request.caller.connection.with_trace(|trace| trace.record(surface.agent.composer(), &file));
    begun.map_err(in_conflict)?;
    Ok(OperationAnswer::Nothing)
}
