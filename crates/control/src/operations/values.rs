//! Values, in the requested form.

use std::sync::Arc;
use std::time::Duration;

use crate::entries::Reading;
use hyper::StatusCode;
use serde_json::{Value as Json, json};
use slate_blackboard::{Access, BoardError, Url};
use slate_runtime::{ErrorCode, Message};

use super::shape;
use crate::Role;
use crate::agent::{KNOWN, refusal};
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace, Parameter};
use crate::picture::{Picture, is_picture};
use crate::problem::Problem;
use crate::select::Selection;
use crate::stream::{StreamContent, ValueStream, Watcher};
use crate::surface::ControlSurface;

const FORMAT: Parameter = Parameter {
    name: "format",
    doc: "Format of the answer, for clients that can't set `Accept`.",
    schema: || json!({ "enum": ValueForm::names() }),
};

pub(super) const POINTER: Parameter =
    Parameter { name: "pointer", doc: "Part of the value, as JSON Pointer.", schema: shape::text };

pub(super) const SELECT: Parameter =
    Parameter { name: "select", doc: "Parts of the value, as JSONPath; a list.", schema: shape::text };

pub(super) const READ: Operation = Operation::get(
    "/slate/{agent}/{path}",
    "read",
    Role::Viewer,
    "Newest value of slate://agent/path, or a stream of its values",
)
.pace(Pace::Prompt)
.parameters(&[
    FORMAT,
    POINTER,
    SELECT,
    Parameter { name: "bare", doc: "Only the value, without sequence and time.", schema: shape::flag },
    Parameter {
        name: "rate",
        doc: "Polling rate of a stream, Hz; 10 unless given.",
        schema: || json!({ "type": "number", "minimum": 0.01, "maximum": 100 }),
    },
    Parameter {
        name: "every",
        doc: "Streams every kept value instead of the newest only.",
        schema: shape::flag,
    },
    Parameter {
        name: "quality",
        doc: "The quality of JPEG; 80 unless given.",
        schema: || json!({ "type": "integer", "minimum": 1, "maximum": 100 }),
    },
])
.kinds(&["text/plain", "image/png", "image/jpeg", "multipart/x-mixed-replace", "text/event-stream"])
.answers(shape::reading, read);

pub(super) const QUEUE: Operation = Operation::get(
    "/queues/{agent}/{path}",
    "queue",
    Role::Viewer,
    "Kept values of a property, oldest first",
)
.pace(Pace::Prompt)
.parameters(&[
    POINTER,
    SELECT,
    Parameter { name: "after", doc: "Only entries after this sequence number.", schema: shape::count },
    Parameter { name: "limit", doc: "Maximum number; 1000 unless given.", schema: shape::count },
])
.answers(
    || {
        shape::object(&[
            ("values", shape::list(shape::reading())),
            ("next", shape::count()),
            ("lost", shape::count()),
        ])
    },
    queue,
);

/// Default polling rate of a stream, Hz.
const DEFAULT_RATE: f64 = 10.0;

/// Default and maximum number of a queue's values in one answer.
const DEFAULT_LIMIT: u64 = 1000;
const MAX_LIMIT: u64 = 100_000;

/// Form of the answer with a value.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ValueForm {
    Json,
    Text,
    Png,
    Jpeg,
    Mjpeg,
    Events,
}

impl ValueForm {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Json, "json", "application/json"),
        (Self::Text, "text", "text/plain"),
        (Self::Png, "png", "image/png"),
        (Self::Jpeg, "jpeg", "image/jpeg"),
        (Self::Mjpeg, "mjpeg", "multipart/x-mixed-replace"),
        (Self::Events, "events", "text/event-stream"),
    ];

    fn names() -> Vec<&'static str> {
        Self::ALL.iter().map(|(_, name, _)| *name).collect()
    }

    /// Returns the form that `format` or `Accept` name.
    /// `picture` is true if the property is an image.
    fn of(request: &OperationRequest, picture: bool) -> Result<Self, Problem> {
        if let Some(name) = request.query.get("format") {
            let found = Self::ALL.iter().find(|(_, known, _)| *known == name).map(|(form, _, _)| *form);
            let help = || format!("expected one of {}", Self::names().join(", "));
            return found.ok_or_else(|| Problem::bad(format!("`format` is `{name}`"), help()));
        }
        let wanted = request.accept.split(',').map(|kind| kind.split(';').next().unwrap_or_default().trim());
        let mut wanted = wanted.filter(|kind| !kind.is_empty()).peekable();
        if wanted.peek().is_none() {
            return Ok(Self::Json);
        }
        let form = |kind: &str| match kind {
            "image/*" if picture => Some(Self::Jpeg),
            "*/*" | "application/*" => Some(Self::Json),
            "text/*" => Some(Self::Text),
            kind => Self::ALL.iter().find(|(_, _, known)| *known == kind).map(|(form, _, _)| *form),
        };
        wanted.find_map(form).ok_or_else(|| {
            let kinds: Vec<_> = Self::ALL.iter().map(|(_, _, kind)| *kind).collect();
            let help = format!("available: {}", kinds.join(", "));
            Problem::new(StatusCode::NOT_ACCEPTABLE, format!("nothing here is `{}`", request.accept), help)
        })
    }
}

/// Returns the URL of a path.
pub(super) fn url(request: &OperationRequest) -> Result<Url, Problem> {
    let text = format!("slate://{}/{}", request.part("agent")?, request.board_path("path")?);
    Url::parse(&request.own_url(&text)).map_err(|error| {
        let help = "such as /api/v1/slate/exp1/r2/planner/state";
        match request.caller.local {
            // A tool tells a wrong URL from a name that nothing has.
            Some(_) => Problem::unfit(error.to_string(), help),
            None => Problem::not_found(error.to_string(), help),
        }
    })
}

/// Returns the path on the board, when the URL is of this agent.
pub(super) fn own_path(surface: &ControlSurface, url: &Url) -> Option<String> {
    url.agent().is_none_or(|agent| agent == surface.name()).then(|| url.path_in(""))
}

/// Converts the error of a path without a readable value.
fn unknown(error: BoardError) -> Problem {
    let status = match error {
        BoardError::Unknown { .. } | BoardError::OtherAgent { .. } => StatusCode::NOT_FOUND,
        _ => StatusCode::UNPROCESSABLE_ENTITY,
    };
    Problem::refused(status, refusal(Message::from(&error), KNOWN))
}

pub(super) fn read(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let url = url(request)?;
    let selection = Selection::parse(request.query.get("pointer"), request.query.get("select"))?;
    let bare = request.query.flag("bare")?;
    let rate = request.query.number("rate", 0.01, 100.0)?.unwrap_or(DEFAULT_RATE);
    let every = request.query.flag("every")?;
    let quality = match request.query.count("quality", 100)? {
        Some(0) => return Err(Problem::bad("`quality` is 0", "it is a whole number from 1 to 100")),
        quality => quality.map_or(80, |quality| quality as u8),
    };
    let Some(path) = own_path(surface, &url) else {
        return match ValueForm::of(request, false)? {
            ValueForm::Json | ValueForm::Text => elsewhere(surface, request, &url, &selection, bare),
            _ => Err(Problem::unfit(
                "a stream or a picture is of this agent's properties",
                "ask the other agent",
            )),
        };
    };
    let (property, field) = surface.board().find(&path).map_err(unknown)?;
    if property.access() == Access::Messages {
        let message = format!("/{} takes messages, and has no value", property.path());
        return Err(Problem::unfit(message, KNOWN).of(ErrorCode::Messages));
    }
    let picture = is_picture(property.descriptor()) && field.is_empty();
    let form = ValueForm::of(request, picture)?;
    if matches!(form, ValueForm::Png | ValueForm::Jpeg | ValueForm::Mjpeg) && !picture {
        let message = format!("/{path} is {}, and no image", property.descriptor().name);
        return Err(Problem::new(StatusCode::NOT_ACCEPTABLE, message, "ask for application/json"));
    }
    let follow = |content| {
        let watcher = Watcher::new(surface, &path, request.last_event.unwrap_or(0))?;
        let period = Duration::from_secs_f64(1.0 / rate);
        Ok(OperationAnswer::ValueStream(ValueStream {
            surface: Arc::clone(surface),
            watcher,
            period,
            content,
        }))
    };
    match form {
        ValueForm::Json | ValueForm::Text => {
            let newest = surface.board().read(&path).map_err(unknown)?;
            let (value, sequence, time) = match newest {
                Some((value, stamp)) => {
                    (serde_json::to_value(value).unwrap_or_default(), stamp.sequence, stamp.time)
                }
                None => (Json::Null, 0, 0),
            };
            value_answer(&selection.of(&value)?, sequence, time, form, bare)
        }
        ValueForm::Png | ValueForm::Jpeg => {
            let nothing = || Problem::not_found(format!("there is no picture at /{path} yet"), "wait for it");
            let (bytes, items, _) = property.newest()?.ok_or_else(nothing)?;
            let wrong =
                || Problem::unfit(format!("the image at /{path} has fewer bytes than its size requires"), "");
            let picture = Picture::of(property.descriptor(), &bytes, items).ok_or_else(wrong)?;
            if form == ValueForm::Png {
                return Ok(OperationAnswer::Bytes("image/png", picture.png()));
            }
            let jpeg = picture.jpeg(quality).map_err(|reason| Problem::unfit(reason, "ask for image/png"))?;
            Ok(OperationAnswer::Bytes("image/jpeg", jpeg))
        }
        ValueForm::Mjpeg => follow(StreamContent::Pictures(quality)),
        ValueForm::Events => follow(StreamContent::Events { selection, every }),
    }
}

/// Returns a value of another agent, or of the team's knowledge.
fn elsewhere(
    surface: &ControlSurface,
    request: &OperationRequest,
    url: &Url,
    selection: &Selection,
    bare: bool,
) -> Result<OperationAnswer, Problem> {
    let read = surface.agent.properties.read(&url.to_string());
    let read = read.map_err(|refusal| match request.caller.local {
        // A tool tells an agent that is not there from a name that nothing has.
        Some(_) if refusal.code.is_none() => Problem::refused(StatusCode::CONFLICT, refusal),
        _ => Problem::refused(StatusCode::NOT_FOUND, refusal),
    })?;
    let reading: Option<Reading> = serde_json::from_value(read).unwrap_or_default();
    let reading = reading.unwrap_or(Reading { value: Json::Null, sequence: 0, time: 0 });
    let form = ValueForm::of(request, false)?;
    value_answer(&selection.of(&reading.value)?, reading.sequence, reading.time, form, bare)
}

fn value_answer(
    value: &Json,
    sequence: u64,
    time: u64,
    form: ValueForm,
    bare: bool,
) -> Result<OperationAnswer, Problem> {
    if form == ValueForm::Text {
        let text = match value {
            Json::String(text) => text.clone(),
            other => other.to_string(),
        };
        return Ok(OperationAnswer::text(format!("{text}\n")));
    }
    let version = Some(version(sequence));
    let body =
        if bare { value.clone() } else { json!({ "value": value, "sequence": sequence, "time": time }) };
    Ok(OperationAnswer::Json(StatusCode::OK, body, version))
}

/// Returns the entity tag of a value's version.
pub(super) fn version(sequence: u64) -> String {
    format!("\"{sequence}\"")
}

pub(super) fn queue(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let selection = Selection::parse(request.query.get("pointer"), request.query.get("select"))?;
    let after = request.query.count("after", u64::MAX)?.unwrap_or(0);
    let limit = request.query.count("limit", MAX_LIMIT)?.unwrap_or(DEFAULT_LIMIT);
    let url = url(request)?;
    let elsewhere = || Problem::unfit("a queue is of this agent's properties", "ask the other agent");
    let path = own_path(surface, &url).ok_or_else(elsewhere)?;
    let kept = surface.board().history(&path).map_err(unknown)?;
    let oldest = kept.first().map_or(after.saturating_add(1), |(_, stamp)| stamp.sequence);
    // Without a place to continue from, nothing is missed.
    let lost = if after == 0 { 0 } else { oldest.saturating_sub(after.saturating_add(1)) };
    let fresh = kept.into_iter().filter(|(_, stamp)| stamp.sequence > after);
    let mut next = after;
    let mut values = Vec::new();
    for (value, stamp) in fresh.take(usize::try_from(limit).unwrap_or(usize::MAX)) {
        let value = selection.of(&serde_json::to_value(value).unwrap_or_default())?;
        values.push(json!({ "value": value, "sequence": stamp.sequence, "time": stamp.time }));
        next = stamp.sequence;
    }
    Ok(OperationAnswer::json(json!({ "values": values, "next": next, "lost": lost })))
}
