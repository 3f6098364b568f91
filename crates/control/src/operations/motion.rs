//! Actuators, and their stop.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::json;

use super::shape;
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace, Parameter, without_slash};
use crate::problem::Problem;
use crate::surface::ControlSurface;

pub(super) const ACTUATORS: Operation = Operation::get(
    "/actuators",
    "actuators",
    Role::Viewer,
    "Actuators, the states of their gates, and their commands",
)
.answers(|| shape::list(shape::actuator()), actuators);

pub(super) const STOP: Operation = Operation::post(
    "/stop",
    super::STOP,
    Role::Viewer,
    "Stops all actuators until `reset` and `arm`; it is no emergency stop",
    Pace::Prompt,
)
.parameters(&[Parameter {
    name: "reason",
    doc: "Reason, kept and shown until `reset`.",
    schema: shape::text,
}])
.body(|| json!({ "description": "Such as {\"reason\": \"...\"}; nothing in it is a reason not to stop." }))
.answers(|| shape::object(&[("stopped", shape::list(shape::text()))]), stop);

pub(super) const RESET: Operation = Operation::post(
    "/reset",
    "reset",
    Role::Operator,
    "Ends a stop; nothing moves before the actuators are armed",
    Pace::Prompt,
)
.answers(|| shape::object(&[("was_stopped", shape::flag())]), reset);

pub(super) const ARM: Operation =
    Operation::post("/arm", "arm", Role::Operator, "Arms all actuators, or one", Pace::Prompt)
        .body(|| {
            let actuator = shape::optional(shape::text());
            json!({ "type": "object", "properties": { "actuator": actuator }, "additionalProperties": false })
        })
        .answers(|| json!({ "type": "object", "maxProperties": 0 }), arm);

pub(super) fn actuators(
    surface: &Arc<ControlSurface>,
    _: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let newest = |path: String| {
        let read = surface.board().read(&path).ok().flatten();
        read.and_then(|(value, _)| serde_json::to_value(value).ok()).unwrap_or_default()
    };
    let entry = |(name, stopped): (String, Option<String>)| {
        let command = surface.board().find(&format!("{name}/command")).ok();
        json!({
            "gate": newest(format!("{name}/gate")),
            "command": newest(format!("{name}/command")),
            "interface": command.map_or("", |(property, _)| property.descriptor().name),
            "name": name,
            "stopped": stopped,
        })
    };
    Ok(OperationAnswer::json(surface.agent.composer().actuators().into_iter().map(entry).collect()))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct StopRequest {
    #[serde(default)]
    reason: String,
}

/// Stops at once, for a reason in the query or in the body.
pub(crate) fn stop(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    // An invalid body is ignored; the stop is carried out.
    let stop: StopRequest = request.body_or_default().unwrap_or_default();
    let reason = [stop.reason.as_str(), request.query.get("reason").unwrap_or_default()]
        .into_iter()
        .find(|reason| !reason.is_empty())
        .map_or_else(|| format!("by the {}", request.caller.who), str::to_owned);
    surface.agent.stop(&reason);
    let stopped: Vec<_> = surface.agent.composer().actuators().into_iter().map(|(name, _)| name).collect();
    Ok(OperationAnswer::json(json!({ "stopped": stopped })))
}

fn reset(surface: &Arc<ControlSurface>, _: &OperationRequest) -> Result<OperationAnswer, Problem> {
    Ok(OperationAnswer::json(json!({ "was_stopped": surface.agent.reset() })))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Arm {
    #[serde(default)]
    actuator: Option<String>,
}

fn arm(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let arm: Arm = request.body_or_default()?;
    let actuator = arm.actuator.as_deref().map(without_slash);
    let is_unknown = |name: &str| surface.agent.composer().actuators().iter().all(|(known, _)| known != name);
    let status = match actuator.is_some_and(is_unknown) {
        true => StatusCode::UNPROCESSABLE_ENTITY,
        false => StatusCode::CONFLICT,
    };
    let armed = surface.agent.arm(actuator);
    armed.map(|()| OperationAnswer::Nothing).map_err(|refusal| Problem::refused(status, refusal))
}
