//! A recording that is played in the agent.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_runtime::playback::{LoopSection, Order};

use super::{TOKEN, conflict, shape};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::operation::{Ask, Operation, Pace};
use crate::problem::Problem;

/// The most cycles that are made at once.
const STEPS: u64 = 1_000_000;

pub(super) const STATUS: Operation = Operation {
    method: "GET",
    path: "/playback",
    name: "playback",
    summary: "How the recording stands that is played, if one is; times are nanoseconds after its first value",
    role: Role::Viewer,
    pace: Pace::Slow,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::optional(status()),
    kinds: &[],
    handler: |context, _| match context.agent.composer().playback() {
        None => Ok(Answer::json(Json::Null)),
        Some(_) => order(context, Order::Status),
    },
};

pub(super) const PAUSE: Operation = Operation {
    path: "/playback/pause",
    name: "pause_playback",
    summary: "Lets the playback stand still",
    handler: |context, _| order(context, Order::Pause),
    ..CHANGE
};

pub(super) const RESUME: Operation = Operation {
    path: "/playback/resume",
    name: "resume_playback",
    summary: "Lets the playback go on",
    handler: |context, _| order(context, Order::Resume),
    ..CHANGE
};

pub(super) const STEP: Operation = Operation {
    path: "/playback/step",
    name: "step_playback",
    summary: "Makes so many cycles, one unless given, and stands still",
    body: Some(|| {
        let cycles = json!({ "type": "integer", "minimum": 1, "maximum": STEPS });
        json!({ "type": "object", "properties": { "cycles": cycles }, "additionalProperties": false })
    }),
    handler: step,
    ..CHANGE
};

pub(super) const SEEK: Operation = Operation {
    path: "/playback/seek",
    name: "seek_playback",
    summary: "Goes on from another time: each property has the last value that it had then",
    body: Some(|| shape::object(&[("time", shape::count())])),
    handler: |context, ask| order(context, Order::Seek(ask.body::<Seek>()?.time)),
    ..CHANGE
};

pub(super) const RATE: Operation = Operation {
    path: "/playback/rate",
    name: "rate_playback",
    summary: "Goes so many times as fast as it was recorded, or with null as fast as it can",
    body: Some(|| {
        let factor = json!({ "type": "number", "exclusiveMinimum": 0 });
        shape::object(&[("factor", shape::optional(factor))])
    }),
    handler: |context, ask| order(context, Order::Rate(ask.body::<Rate>()?.factor)),
    ..CHANGE
};

pub(super) const LOOP: Operation = Operation {
    path: "/playback/loop",
    name: "loop_playback",
    summary: "Plays what is between two times again and again, or with null no more",
    body: Some(|| shape::object(&[("section", shape::optional(section()))])),
    handler: |context, ask| order(context, Order::Loop(ask.body::<Loop>()?.section)),
    ..CHANGE
};

/// What those have in common that change how it is played.
const CHANGE: Operation = Operation {
    method: "POST",
    path: "",
    name: "",
    summary: "",
    role: Role::Operator,
    pace: Pace::Slow,
    parameters: &[],
    body: None,
    answer: status,
    kinds: &[],
    handler: |_, _| Ok(Answer::Nothing),
};

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
struct Step {
    #[serde(default = "one")]
    cycles: u64,
}

fn one() -> u64 {
    1
}

impl Default for Step {
    fn default() -> Self {
        Self { cycles: one() }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Seek {
    time: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Rate {
    factor: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Loop {
    section: Option<LoopSection>,
}

fn order(context: &Context, order: Order) -> Result<Answer, Problem> {
    conflict(context.agent.replay(order))
}

fn step(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let Step { cycles } = ask.body_or_default()?;
    if !(1..=STEPS).contains(&cycles) {
        return Err(Problem::unfit(format!("{cycles} cycles are no step"), format!("make 1 to {STEPS}")));
    }
    order(context, Order::Step(cycles))
}
