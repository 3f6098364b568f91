//! The past: what was written to a property between two times.

use std::sync::Arc;

use hyper::StatusCode;
use serde_json::{Value as Json, json};
use slate_blackboard::interface::{View, find};
use slate_blackboard::{Access, BoardError};
use slate_runtime::recording::{History, HistoryWish, RecordingRefusal};

use super::values::SELECTION;
use super::values::{own_path, url};
use super::{TOKEN, shape};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::{Ask, Operation, Parameter};
use crate::select::Selection;

/// How many values are told at once when nothing else is said, and at most.
const LIMIT: u64 = 1000;
const MOST: u64 = 10_000;

pub(super) const READ: Operation = Operation {
    method: "GET",
    path: "/history/{agent}/{path}",
    name: "history",
    summary: "The values that a property had between two times, from the last seconds that are in memory, or from the recording \
              that is played",
    role: Role::Viewer,
    parameters: &[
        Parameter {
            name: "from",
            doc: "The earliest time, of the agent; 0 unless given.",
            schema: shape::count,
        },
        Parameter { name: "to", doc: "The latest time; there is none unless given.", schema: shape::count },
        Parameter {
            name: "limit",
            doc: "At most so many, spread evenly, with the last one; 1000 unless given. With 1 it is what held at `to`.",
            schema: || json!({ "type": "integer", "minimum": 1, "maximum": MOST }),
        },
        SELECTION[0],
        SELECTION[1],
        TOKEN,
    ],
    body: None,
    answer: || {
        shape::object(&[
            ("values", shape::list(shape::reading())),
            ("count", shape::count()),
            ("from", shape::count()),
            ("to", shape::count()),
        ])
    },
    kinds: &[],
    handler: read,
};

fn read(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let selection = Selection::parse(ask.query.get("pointer"), ask.query.get("select"))?;
    let from = ask.query.count("from", u64::MAX)?.unwrap_or(0);
    let to = ask.query.count("to", u64::MAX)?.unwrap_or(u64::MAX);
    let most = match ask.query.count("limit", MOST)? {
        Some(0) => {
            return Err(Problem::bad("`limit` is 0", format!("it is a whole number from 1 to {MOST}")));
        }
        limit => limit.unwrap_or(LIMIT) as usize,
    };
    let url = url(ask)?;
    let elsewhere = || Problem::unfit("history is of this agent's properties", "ask the other agent");
    let path = own_path(context, &url).ok_or_else(elsewhere)?;
    let (property, field) = context.board().find(&path)?;
    if property.access() == Access::Messages {
        let message = format!("/{} takes messages, and has no value", property.path());
        return Err(Problem::unfit(message, "ask for what its module writes"));
    }
    let wish = HistoryWish { path: property.path().into(), from, to, most };
    let history = context.desk.composer().history(&wish);
    let refused = |refusal: RecordingRefusal| Problem::refused(StatusCode::CONFLICT, refusal.into());
    let History { descriptor, values, count, from, to } = history.map_err(refused)?;
    let wrong = |error| BoardError::Access { url: format!("/{path}"), error };
    let field = (!field.is_empty()).then(|| find(descriptor, &field)).transpose().map_err(wrong)?;
    let mut told = Vec::with_capacity(values.len());
    for kept in values {
        let Some(view) = View::new(descriptor, &kept.bytes, kept.items) else { continue };
        let value = match &field {
            None => serde_json::to_value(view),
            Some(field) => serde_json::to_value(view.at(field)),
        };
        let value: Json = selection.of(&value.unwrap_or_default())?;
        told.push(json!({ "value": value, "sequence": kept.stamp.sequence, "time": kept.stamp.time }));
    }
    Ok(Answer::json(json!({ "values": told, "count": count, "from": from, "to": to })))
}
