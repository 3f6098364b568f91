//! The operations: each subject has a file, with what can be asked of it and how that is answered.

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
pub(crate) mod recordings;
mod settings;
mod shape;
pub(crate) mod snapshots;
mod sockets;
mod statistics;
mod threads;
mod tree;
mod values;
mod write;

use std::sync::Arc;

use hyper::StatusCode;
use serde_json::Value as Json;
use slate_runtime::remote::Call;

use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::query::Query;
use crate::route::{Ask, Operation, Parameter};

/// The name of the operation that waits for nobody.
pub(crate) const STOP: &str = "stop";

/// The name of the operation that somebody who drives calls again and again.
pub(crate) const DRIVE: &str = "drive";

const DRY_RUN: Parameter =
    Parameter { name: "dry_run", doc: "Only finds out whether it can be done.", schema: shape::flag };

const TOKEN: Parameter =
    Parameter { name: "token", doc: "The token, where a browser can set no header.", schema: shape::text };

/// All of them. What is more special stands before what is more general.
pub(crate) const OPERATIONS: &[Operation] = &[
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
    modules::LIST,
    modules::SWITCH,
    plugins::LIST,
    plugins::RELOAD,
    plugins::LOAD,
    plugins::UNLOAD,
    links::LIST,
    links::LINK,
    links::UNLINK,
    links::PEERS,
    settings::LIST,
    modules::PARAMETERS,
    settings::SET,
    settings::REVERT,
    settings::DIFFERENCES,
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
    snapshots::SAVE,
    statistics::RECORDING,
    recordings::LIST,
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
    sockets::REMOTE,
    layouts::LIST,
    layouts::SAVE,
    layouts::REMOVE,
    tree::DOCUMENTS,
    tree::DOCUMENT,
];

/// Sets what the host sets, for a client that speaks otherwise.
pub(crate) fn put_value(
    context: &Arc<Context>,
    role: Role,
    who: &str,
    path: &str,
    value: &Json,
) -> Result<Answer, Problem> {
    write::put(context, &spoken(context, role, who, path, value))
}

/// Sends a message, for a client that speaks otherwise.
pub(crate) fn send_value(
    context: &Arc<Context>,
    role: Role,
    who: &str,
    path: &str,
    value: &Json,
) -> Result<Answer, Problem> {
    write::send(context, &spoken(context, role, who, path, value))
}

fn spoken(context: &Context, role: Role, who: &str, path: &str, value: &Json) -> Ask {
    Ask {
        role,
        who: who.to_owned(),
        captured: vec![("agent", context.agent().to_owned()), ("path", path.to_owned())],
        query: Query::default(),
        accept: String::new(),
        if_match: None,
        last_event: None,
        body: Some(value.clone()),
    }
}

/// Asks the desk that the tools at the local socket ask too.
fn ask(context: &Context, call: Call) -> Result<Answer, Problem> {
    Ok(Answer::json(made(context, call)?))
}

fn made(context: &Context, call: Call) -> Result<Json, Problem> {
    context.desk.make(call).map_err(Problem::from)
}

/// What is made of it can't be changed so now.
fn conflict(context: &Context, call: Call) -> Result<Answer, Problem> {
    let made = context.desk.make(call);
    made.map(Answer::json).map_err(|refusal| Problem::refused(StatusCode::CONFLICT, refusal))
}
