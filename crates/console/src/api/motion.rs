//! Actuators, and their stop.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_runtime::remote::Call;

use super::{TOKEN, ask, made, shape};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::{Ask, Operation};

pub(super) const ACTUATORS: Operation = Operation {
    method: "GET",
    path: "/actuators",
    name: "actuators",
    summary: "The actuators, how their gates stand, and what they get",
    role: Role::Viewer,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::actuator()),
    kinds: &[],
    handler: actuators,
};

pub(super) const STOP: Operation = Operation {
    method: "POST",
    path: "/stop",
    name: super::STOP,
    summary: "Stops all actuators until `reset` and `arm`; it is no emergency stop",
    role: Role::Viewer,
    parameters: &[],
    body: Some(
        || json!({ "description": "Such as {\"reason\": \"...\"}; nothing that comes with it is a reason not to stop." }),
    ),
    answer: || shape::object(&[("stopped", shape::list(shape::text()))]),
    kinds: &[],
    handler: stop,
};

pub(super) const RESET: Operation = Operation {
    method: "POST",
    path: "/reset",
    name: "reset",
    summary: "Ends a stop; nothing moves before the actuators are armed",
    role: Role::Operator,
    parameters: &[],
    body: None,
    answer: || shape::object(&[("was_stopped", shape::flag())]),
    kinds: &[],
    handler: reset,
};

pub(super) const ARM: Operation = Operation {
    method: "POST",
    path: "/arm",
    name: "arm",
    summary: "Lets commands through to the actuators, or to one",
    role: Role::Operator,
    parameters: &[],
    body: Some(|| {
        let actuator = shape::optional(shape::text());
        json!({ "type": "object", "properties": { "actuator": actuator }, "additionalProperties": false })
    }),
    answer: || json!({ "type": "object", "maxProperties": 0 }),
    kinds: &[],
    handler: arm,
};

pub(super) fn actuators(context: &Arc<Context>, _: &Ask) -> Result<Answer, Problem> {
    let newest = |path: String| {
        let read = context.board().read(&path).ok().flatten();
        read.and_then(|(value, _)| serde_json::to_value(value).ok()).unwrap_or_default()
    };
    let entry = |(name, stopped): (String, Option<String>)| {
        let command = context.board().find(&format!("{name}/command")).ok();
        json!({
            "gate": newest(format!("{name}/gate")),
            "command": newest(format!("{name}/command")),
            "interface": command.map_or("", |(property, _)| property.descriptor().name),
            "name": name,
            "stopped": stopped,
        })
    };
    Ok(Answer::json(context.desk.composer().actuators().into_iter().map(entry).collect()))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stop {
    #[serde(default)]
    reason: String,
}

pub(super) fn stop(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    // What comes with it is no reason not to stop.
    let stop: Stop = asked.body_or_default().unwrap_or_default();
    let reason = if stop.reason.is_empty() { format!("by the {}", asked.who) } else { stop.reason };
    made(context, Call::Stop { reason })?;
    let stopped: Vec<_> = context.desk.composer().actuators().into_iter().map(|(name, _)| name).collect();
    Ok(Answer::json(json!({ "stopped": stopped })))
}

pub(super) fn reset(context: &Arc<Context>, _: &Ask) -> Result<Answer, Problem> {
    Ok(Answer::json(json!({ "was_stopped": made(context, Call::Reset {})? })))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Arm {
    #[serde(default)]
    actuator: Option<String>,
}

pub(super) fn arm(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let arm: Arm = asked.body_or_default()?;
    if let Some(name) = &arm.actuator
        && context.desk.composer().actuators().iter().all(|(known, _)| known != name)
    {
        return ask(context, Call::Arm { actuator: arm.actuator.clone() });
    }
    let armed: Result<Json, _> = context.desk.make(Call::Arm { actuator: arm.actuator });
    armed.map(|_| Answer::Nothing).map_err(|refusal| Problem::refused(StatusCode::CONFLICT, refusal))
}
