//! Recording that is played in the agent.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_runtime::playback::{LoopSection, Order};

use super::{conflict, shape};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;
use crate::surface::ControlSurface;

/// Maximum number of cycles in one request.
const MAX_CYCLES: u64 = 1_000_000;

pub(super) const STATUS: Operation = Operation::get(
    "/playback",
    "playback",
    Role::Viewer,
    "State of the playback, if a recording is played; times are nanoseconds after its first value",
)
.answers(
    || shape::optional(status()),
    |surface, _| match surface.agent.composer().playback() {
        None => Ok(OperationAnswer::json(Json::Null)),
        Some(_) => order(surface, Order::Status),
    },
);

pub(super) const PAUSE: Operation =
    Operation::post("/playback/pause", "pause_playback", Role::Operator, "Pauses the playback", Pace::Slow)
        .answers(status, |surface, _| order(surface, Order::Pause));

pub(super) const RESUME: Operation = Operation::post(
    "/playback/resume",
    "resume_playback",
    Role::Operator,
    "Resumes the playback",
    Pace::Slow,
)
.answers(status, |surface, _| order(surface, Order::Resume));

pub(super) const STEP: Operation = Operation::post(
    "/playback/step",
    "step_playback",
    Role::Operator,
    "Plays a number of cycles, one unless given, then pauses",
    Pace::Slow,
)
.body(|| {
    let cycles = json!({ "type": "integer", "minimum": 1, "maximum": MAX_CYCLES });
    json!({ "type": "object", "properties": { "cycles": cycles }, "additionalProperties": false })
})
.answers(status, step);

pub(super) const SEEK: Operation = Operation::post(
    "/playback/seek",
    "seek_playback",
    Role::Operator,
    "Seeks to a time: each property gets its last value at that time",
    Pace::Slow,
)
.body(|| shape::object(&[("time", shape::count())]))
.answers(status, |surface, request| order(surface, Order::Seek(request.body::<SeekRequest>()?.time)));

pub(super) const RATE: Operation = Operation::post(
    "/playback/rate",
    "rate_playback",
    Role::Operator,
    "Sets the playback rate as a factor of the recorded pace, or null for the maximum",
    Pace::Slow,
)
.body(|| {
    let factor = json!({ "type": "number", "exclusiveMinimum": 0 });
    shape::object(&[("factor", shape::optional(factor))])
})
.answers(status, |surface, request| order(surface, Order::Rate(request.body::<RateRequest>()?.factor)));

pub(super) const LOOP: Operation = Operation::post(
    "/playback/loop",
    "loop_playback",
    Role::Operator,
    "Repeats the range between two times, or null to stop repeating",
    Pace::Slow,
)
.body(|| shape::object(&[("section", shape::optional(section()))]))
.answers(status, |surface, request| order(surface, Order::Loop(request.body::<LoopRequest>()?.section)));

fn section() -> Json {
    shape::object(&[("from", shape::count()), ("to", shape::count())])
}

fn status() -> Json {
    shape::object(&[
        ("file", shape::text()),
        ("begin", shape::count()),
        ("time", shape::count()),
        ("from", shape::count()),
        ("to", shape::count()),
        ("is_paused", shape::flag()),
        ("rate", shape::optional(json!({ "type": "number" }))),
        ("section", shape::optional(section())),
        ("values", shape::count()),
        ("modules", shape::list(shape::text())),
    ])
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepRequest {
    #[serde(default = "one")]
    cycles: u64,
}

fn one() -> u64 {
    1
}

impl Default for StepRequest {
    fn default() -> Self {
        Self { cycles: one() }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SeekRequest {
    time: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RateRequest {
    factor: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoopRequest {
    section: Option<LoopSection>,
}

fn order(surface: &ControlSurface, order: Order) -> Result<OperationAnswer, Problem> {
    conflict(surface.agent.replay(order))
}

fn step(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let StepRequest { cycles } = request.body_or_default()?;
    if !(1..=MAX_CYCLES).contains(&cycles) {
        return Err(Problem::unfit(
            format!("{cycles} cycles are no step"),
            format!("make 1 to {MAX_CYCLES}"),
        ));
    }
    order(surface, Order::Step(cycles))
}
