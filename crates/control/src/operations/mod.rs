//! Operations on an agent, one file for each subject.
//! A file has the requests and how they are answered.

mod graph;
mod history;
mod layouts;
mod leases;
mod links;
mod log;
mod modules;
mod motion;
mod openapi;
mod playback;
mod plugins;
mod recordings;
mod settings;
mod shape;
mod snapshots;
mod sockets;
mod statistics;
mod threads;
mod tracing;
mod tree;
mod values;
mod watching;
mod write;

pub use layouts::{PROJECT_FOLDER, is_plain};

use std::path::PathBuf;
use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_runtime::ErrorCode;

use crate::agent::Done;
use crate::answer::OperationAnswer;
use crate::entries::Refusal;
use crate::operation::{Caller, MatchedOperation, Operation, OperationRequest, Parameter, check_role};
use crate::problem::Problem;
use crate::query::Query;
use crate::surface::ControlSurface;

/// Version of the operations; different versions are incompatible.
pub const API_VERSION: u64 = 1;

/// Name of the stop, the operation that never waits.
pub const STOP: &str = "stop";

/// Name of the operation that a driver calls repeatedly.
pub const DRIVE: &str = "drive";

const DRY_RUN: Parameter =
    Parameter { name: "dry_run", doc: "Checks the request without carrying it out.", schema: shape::flag };

/// Operations; more special paths come before more general ones.
pub const OPERATIONS: &[Operation] = &[
    openapi::INDEX,
    openapi::DOCUMENT,
    tree::AGENT,
    tree::PROPERTIES,
    tree::INTERFACES,
    tree::INTERFACE,
    values::READ,
    write::PUT,
    write::PATCH,
    write::SEND,
    values::QUEUE,
    watching::WATCH,
    watching::MEASURE,
    tracing::RECORD,
    tracing::PROGRESS,
    tracing::END,
    modules::LIST,
    modules::DESCRIBE,
    modules::SWITCH,
    plugins::LIST,
    plugins::LOAD_LIBRARY,
    plugins::RELOAD,
    plugins::SHADOW,
    plugins::END_SHADOW,
    plugins::PROMOTE,
    plugins::LOAD,
    plugins::UNLOAD,
    links::LIST,
    links::LINK,
    links::UNLINK,
    links::PEERS,
    graph::READ,
    settings::LIST,
    modules::PARAMETERS,
    settings::SET,
    settings::REVERT,
    settings::DIFFERENCES,
    settings::REFUSED,
    settings::SAVE,
    log::LINES,
    log::NOTE,
    statistics::STATISTICS,
    threads::READ,
    statistics::METRICS,
    motion::ACTUATORS,
    motion::STOP,
    motion::RESET,
    motion::ARM,
    leases::LIST,
    leases::TAKE,
    leases::DRIVE,
    leases::GIVE_BACK,
    snapshots::LOAD,
    snapshots::VALUES,
    snapshots::SAVE,
    statistics::RECORDING,
    recordings::LIST,
    recordings::END_ONLY,
    recordings::END,
    recordings::FLIGHT,
    recordings::START,
    recordings::FETCH,
    playback::STATUS,
    playback::PAUSE,
    playback::RESUME,
    playback::STEP,
    playback::SEEK,
    playback::RATE,
    playback::LOOP,
    history::READ,
    sockets::LIVE,
    sockets::TELEOPERATION,
    layouts::LIST,
    layouts::SAVE,
    layouts::REMOVE,
    tree::DOCUMENTS,
    tree::DOCUMENT,
];

/// Returns the operation of a request.
///
/// # Errors
/// When no operation has that method and path.
pub fn of_request(method: &str, path: &str) -> Result<MatchedOperation, Problem> {
    MatchedOperation::find(OPERATIONS, method, path)
}

/// Returns whether an operation is the stop, which waits for nothing.
pub fn is_stop(found: &MatchedOperation) -> bool {
    found.operation.name == STOP
}

/// Returns the operation of that name.
pub fn by_name(name: &str) -> Option<&'static Operation> {
    OPERATIONS.iter().find(|operation| operation.name == name)
}

/// Carries out an operation for a caller that speaks another protocol.
/// `parts` are the variable parts of its path by name; `agent` is this agent unless given.
///
/// # Errors
/// When none has that name, a part is missing, the caller may not do it, or it can't be done.
pub fn carry_out(
    surface: &Arc<ControlSurface>,
    caller: &Caller,
    name: &str,
    parts: &[(&str, &str)],
    body: Json,
) -> Result<OperationAnswer, Problem> {
    let unknown = || Problem::not_found(format!("no operation is called `{name}`"), "GET /api/v1 lists them");
    let operation = by_name(name).ok_or_else(unknown)?;
    check_role(operation.role, caller.role)?;
    let request = OperationRequest {
        caller: caller.clone(),
        captured: operation.capture(surface.name(), parts)?,
        query: Query::default(),
        accept: String::new(),
        if_match: None,
        last_event: None,
        body: Some(body),
    };
    let answer = operation.carry_out(surface, &request);
    if operation.name != STOP {
        surface.agent.settle();
    }
    answer
}

/// Returns the state of a gate.
pub fn gate(surface: &ControlSurface, actuator: &str) -> Json {
    let newest = surface.board().read(&format!("{actuator}/gate")).ok().flatten();
    newest.and_then(|(value, _)| serde_json::to_value(value).ok()).unwrap_or_default()
}

/// Answers with the result of a call.
fn reply(done: Done) -> Result<OperationAnswer, Problem> {
    Ok(OperationAnswer::json(done?))
}

/// Converts a result like [`reply`]; a refusal is a conflict.
/// It means that the operation is impossible now, or that the name is unknown.
fn conflict(done: Done) -> Result<OperationAnswer, Problem> {
    done.map(OperationAnswer::json).map_err(in_conflict)
}

fn in_conflict(refusal: Refusal) -> Problem {
    Problem::refused(StatusCode::CONFLICT, refusal)
}

/// Converts a result like [`conflict`]; an unknown name in the path is not found.
fn named(done: Done) -> Result<OperationAnswer, Problem> {
    let is_unknown = |refusal: &Refusal| refusal.code.as_deref() == Some(ErrorCode::Name.code());
    done.map(OperationAnswer::json).map_err(|refusal| match is_unknown(&refusal) {
        true => Problem::refused(StatusCode::NOT_FOUND, refusal),
        false => in_conflict(refusal),
    })
}

/// Returns a file that a caller on this machine names by its path.
/// `None` over the network: a caller that may name any file may overwrite any.
fn local_file(request: &OperationRequest, name: &str) -> Option<PathBuf> {
    request.caller.local.as_ref().map(|_| PathBuf::from(name)).filter(|path| path.is_absolute())
}

/// Body that names a file on this machine.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Named {
    file: PathBuf,
}

fn file_shape() -> Json {
    let path = json!({ "type": "string", "description": "Absolute path on the agent's machine." });
    shape::object(&[("file", path)])
}
