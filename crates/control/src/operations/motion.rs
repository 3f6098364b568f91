//! Actuators, and their stop.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::json;

use super::{TOKEN, shape};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::operation::{Ask, Operation, Pace, Parameter};
use crate::problem::Problem;

pub(super) const ACTUATORS: Operation = Operation {
    method: "GET",
    path: "/actuators",
    name: "actuators",
    summary: "The actuators, how their gates stand, and what they get",
    role: Role::Viewer,
    pace: Pace::Slow,
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
    pace: Pace::Prompt,
    parameters: &[Parameter { name: "reason", doc: "Why; it is kept and shown.", schema: shape::text }],
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
    pace: Pace::Prompt,
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
    pace: Pace::Prompt,
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
    Ok(Answer::json(context.agent.composer().actuators().into_iter().map(entry).collect()))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stop {
    #[serde(default)]
    reason: String,
}

/// Stops at once, for a reason that may stand in the query or in the body.
pub(crate) fn stop(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    // What comes with it is no reason not to stop.
    let stop: Stop = asked.body_or_default().unwrap_or_default();
    let reason = [stop.reason.as_str(), asked.query.get("reason").unwrap_or_default()]
        .into_iter()
        .find(|reason| !reason.is_empty())
        .map_or_else(|| format!("by the {}", asked.caller.who), str::to_owned);
    context.agent.stop(&reason);
    let stopped: Vec<_> = context.agent.composer().actuators().into_iter().map(|(name, _)| name).collect();
    Ok(Answer::json(json!({ "stopped": stopped })))
}

fn reset(context: &Arc<Context>, _: &Ask) -> Result<Answer, Problem> {
    Ok(Answer::json(json!({ "was_stopped": context.agent.reset() })))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Arm {
    #[serde(default)]
    actuator: Option<String>,
}

fn arm(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let arm: Arm = asked.body_or_default()?;
    let is_unknown =
        |name: &String| context.agent.composer().actuators().iter().all(|(known, _)| known != name);
    let status = match arm.actuator.as_ref().is_some_and(is_unknown) {
        true => StatusCode::UNPROCESSABLE_ENTITY,
        false => StatusCode::CONFLICT,
    };
    let armed = context.agent.arm(arm.actuator.as_deref());
    armed.map(|()| Answer::Nothing).map_err(|refusal| Problem::refused(status, refusal))
}
