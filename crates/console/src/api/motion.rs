//! Actuators, and their stop.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_runtime::remote::Call;

use super::{ask, made};
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::Ask;

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
