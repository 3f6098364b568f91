//! Log.

use std::sync::Arc;
use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_blackboard::Stamp;
use slate_blackboard::interface::Value;
use slate_module::Level;

use super::shape;
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace, Parameter, without_slash};
use crate::problem::Problem;
use crate::select::Selection;
use crate::stream::{StreamContent, ValueStream, Watcher};
use crate::surface::ControlSurface;

pub(super) const LINES: Operation =
    Operation::get("/log", "log", Role::Viewer, "Newest lines of the log, or new lines as an event stream")
        .parameters(&[
            Parameter {
                name: "format",
                doc: "`events` for a stream.",
                schema: || json!({ "enum": ["json", "events"] }),
            },
            Parameter {
                name: "after",
                doc: "Only entries after this sequence number.",
                schema: shape::count,
            },
            Parameter {
                name: "level",
                doc: "Minimum severity.",
                schema: || json!({ "enum": ["error", "warn", "info", "debug", "trace"] }),
            },
            Parameter {
                name: "module",
                doc: "Only lines of modules whose names start with this.",
                schema: shape::text,
            },
        ])
        .kinds(&["text/event-stream"])
        .answers(|| shape::list(shape::line()), lines);

pub(super) const NOTE: Operation = Operation::post(
    "/log",
    "note",
    Role::Operator,
    "Writes a line to the log, for example to mark a moment in the recording",
    Pace::Slow,
)
.body(|| shape::object(&[("text", json!({ "type": "string", "minLength": 1, "maxLength": 256 }))]))
.answers(|| json!({ "type": "object", "maxProperties": 0 }), note);

/// Path of the last lines of the log.
const LOG_TAIL: &str = "log/tail";

/// Levels, the most important one first.
const LEVELS: &[&str] = &["error", "warn", "info", "debug", "trace"];

pub(super) fn lines(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let after = request.query.count("after", u64::MAX)?.or(request.last_event).unwrap_or(0);
    let rank = |level: &str| LEVELS.iter().position(|known| level.eq_ignore_ascii_case(known));
    let least = request.query.get("level").map(|level| {
        let help = format!("available: {}", LEVELS.join(", "));
        rank(level).ok_or_else(|| Problem::bad(format!("`level` is `{level}`"), help))
    });
    let least = least.transpose()?.unwrap_or(LEVELS.len());
    let module = request.query.get("module").map(without_slash);
    let events = match request.query.get("format") {
        None => request.accept.contains("text/event-stream"),
        Some("events") => true,
        Some("json") => false,
        Some(other) => {
            return Err(Problem::bad(format!("`format` is `{other}`"), "expected json or events"));
        }
    };
    if events {
        if request.query.get("level").is_some() || module.is_some() {
            let help = "request all lines, and filter them yourself";
            return Err(Problem::bad("a stream of the log has all lines", help));
        }
        let watcher = Watcher::new(surface, LOG_TAIL, after)?;
        let content = StreamContent::Events { selection: Selection::Whole, every: true };
        let period = Duration::from_millis(100);
        return Ok(OperationAnswer::ValueStream(ValueStream {
            surface: Arc::clone(surface),
            watcher,
            period,
            content,
        }));
    }
    let is_wanted = |line: &Json| {
        let level = line["level"].as_str().and_then(rank).unwrap_or(0);
        let of_module = |prefix: &str| {
            line["module"].as_str().is_some_and(|name| slate_blackboard::is_within(name, prefix))
        };
        level <= least && module.is_none_or(of_module)
    };
    let kept = surface.board().history(LOG_TAIL)?.into_iter().filter(|(_, stamp)| stamp.sequence > after);
    Ok(OperationAnswer::json(kept.map(line).filter(is_wanted).collect()))
}

/// Maximum length of a text that is written to the log, bytes.
const MAX_NOTE_LENGTH: usize = 256;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Note {
    text: String,
}

pub(super) fn note(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let Note { text } = request.body()?;
    if text.trim().is_empty() || text.len() > MAX_NOTE_LENGTH || text.chars().any(char::is_control) {
        let help = format!("it is one line of 1 to {MAX_NOTE_LENGTH} bytes");
        return Err(Problem::unfit("this is no line for the log", help));
    }
    surface.log(Level::Info, &format!("{}: {text}", request.caller.name()));
    Ok(OperationAnswer::Nothing)
}

fn line((value, stamp): (Value, Stamp)) -> Json {
    let text = |name| value.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
    let dropped = value.get("dropped").and_then(Value::as_integer).unwrap_or(0);
    json!({
        "sequence": stamp.sequence,
        "time": stamp.time,
        "level": text("level").to_ascii_lowercase(),
        "module": text("module"),
        "text": text("text"),
        "dropped": u64::try_from(dropped).unwrap_or(0),
    })
}
