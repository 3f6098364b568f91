//! Past values of a property between two times.

use std::sync::Arc;

use hyper::StatusCode;
use serde_json::{Value as Json, json};
use slate_blackboard::channel::StampedValue;
use slate_blackboard::interface::{AccessError, Descriptor, View, find};
use slate_blackboard::{Access, BoardError};
use slate_runtime::recording::{History, HistoryRequest, Left, RecordingRefusal};

use super::shape;
use super::values::{POINTER, SELECT, own_path, url};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Parameter};
use crate::problem::Problem;
use crate::select::Selection;
use crate::surface::ControlSurface;

/// Default and maximum number of values in one answer.
const DEFAULT_LIMIT: u64 = 1000;
const MAX_LIMIT: u64 = 10_000;

/// Maximum size of an answer's values, bytes, unless a single one is larger.
const MAX_SIZE: usize = 8 << 20;

pub(super) const READ: Operation = Operation::get(
    "/history/{agent}/{path}",
    "history",
    Role::Viewer,
    "The values that a property had between two times, from the last seconds that are in memory, \
     or from the recording that is played. Where the answer would have more than 8 MiB, \
     `left_out` says how many values are not in it, and `next` is the `from` to go on with",
).parameters(&[
        Parameter {
            name: "from",
            doc: "The earliest time, of the agent; 0 unless given. Continue from the `next` of an answer.",
            schema: position,
        },
        Parameter { name: "to", doc: "Latest time; no limit unless given.", schema: shape::count },
        Parameter {
            name: "limit",
            doc: "Maximum number of values, spread evenly, the last one included; 1000 unless given. 1 returns the value at `to`.",
            schema: || json!({ "type": "integer", "minimum": 1, "maximum": MAX_LIMIT }),
        },
        POINTER,
        SELECT,
    ]).answers(|| {
        shape::object(&[
            ("values", shape::list(shape::reading())),
            ("count", shape::count()),
            ("from", shape::count()),
            ("to", shape::count()),
            ("left_out", shape::count()),
            ("next", shape::optional(position())),
        ])
    }, read);

/// Returns the schema of a position: a time, and optionally a sequence number.
/// Where several values have that time, the sequence number is that of the first one meant.
fn position() -> Json {
    json!({ "type": "string", "pattern": "^[0-9]+(:[0-9]+)?$" })
}

/// Returns the time and the sequence number of a place.
fn parse_position(text: &str) -> Result<(u64, u64), Problem> {
    let (time, sequence) = text.split_once(':').unwrap_or((text, "0"));
    let number = |text: &str| {
        let is_number = text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse::<u64>().ok().filter(|_| is_number)
    };
    number(time).zip(number(sequence)).ok_or_else(|| {
        let help = "it is a time in nanoseconds of the agent, such as 1320000000, or the `next` of an answer";
        Problem::bad(format!("`from` is `{text}`"), help)
    })
}

fn read(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let selection = Selection::parse(request.query.get("pointer"), request.query.get("select"))?;
    let (from, sequence) = request.query.get("from").map(parse_position).transpose()?.unwrap_or_default();
    let to = request.query.count("to", u64::MAX)?.unwrap_or(u64::MAX);
    let most = match request.query.count("limit", MAX_LIMIT)? {
        Some(0) => {
            return Err(Problem::bad("`limit` is 0", format!("it is a whole number from 1 to {MAX_LIMIT}")));
        }
        limit => limit.unwrap_or(DEFAULT_LIMIT) as usize,
    };
    let url = url(request)?;
    let remote = || Problem::unfit("history is of this agent's properties", "ask the other agent");
    let path = own_path(surface, &url).ok_or_else(remote)?;
    let (property, field) = surface.board().find(&path)?;
    if property.access() == Access::Messages {
        let message = format!("/{} takes messages, and has no value", property.path());
        return Err(Problem::unfit(message, "ask for what its module writes"));
    }
    let wanted = HistoryRequest { path: property.path().into(), from, sequence, to, most };
    let access_error = |error| BoardError::Access { url: format!("/{path}"), error };
    if !field.is_empty() {
        find(property.descriptor(), &field).map_err(access_error)?;
    }
    let (mut values, mut failure) = (Vec::<u8>::new(), None);
    let mut take = |descriptor: &'static Descriptor, kept: StampedValue| {
        if failure.is_some() || values.len() > MAX_SIZE {
            return false;
        }
        match text(descriptor, &field, &selection, &kept) {
            Ok(Some(value)) if !values.is_empty() && values.len() + value.len() > MAX_SIZE => return false,
            Ok(Some(value)) => {
                if !values.is_empty() {
                    values.push(b',');
                }
                values.extend(value);
            }
            Ok(None) => {}
            Err(HistoryError::Field(error)) => failure = Some(Problem::from(access_error(error))),
            Err(HistoryError::Selection(problem)) => failure = Some(problem),
        }
        failure.is_none()
    };
    let history = surface.agent.composer().history(&wanted, &mut take);
    let refused = |refusal: RecordingRefusal| Problem::refused(StatusCode::CONFLICT, refusal.into());
    let History { left, count, from, to } = history.map_err(refused)?;
    if let Some(problem) = failure {
        return Err(problem);
    }
    let left_out = left.map_or(0, |left| left.count);
    // Several values may have one time; the sequence number lets a client continue after the last one.
    let next = left.map(|Left { time, sequence, .. }| format!("{time}:{sequence}"));
    let rest =
        json!({ "count": count, "from": from, "to": to, "left_out": left_out, "next": next }).to_string();
    let body = [&b"{\"values\":["[..], &values, b"],", &rest.as_bytes()[1..]].concat();
    Ok(OperationAnswer::Bytes("application/json", body))
}

/// Failure to return a value.
enum HistoryError {
    Field(AccessError),
    Selection(Problem),
}

/// Returns a value as JSON; `None` for a value that is not of its interface.
fn text(
    descriptor: &'static Descriptor,
    field: &str,
    selection: &Selection,
    kept: &StampedValue,
) -> Result<Option<Vec<u8>>, HistoryError> {
    let Some(view) = View::new(descriptor, &kept.bytes, kept.items) else { return Ok(None) };
    let value = match field {
        "" => serde_json::to_value(view),
        field => serde_json::to_value(view.at(&find(descriptor, field).map_err(HistoryError::Field)?)),
    };
    let value: Json = selection.of(&value.unwrap_or_default()).map_err(HistoryError::Selection)?;
    let entry = json!({ "value": value, "sequence": kept.stamp.sequence, "time": kept.stamp.time });
    Ok(Some(entry.to_string().into_bytes()))
}
