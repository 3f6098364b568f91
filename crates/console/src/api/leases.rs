//! Who has the controls of what, and controls over plain requests.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::json;
use slate_blackboard::interface::Value;
use slate_runtime::remote::Call;
use slate_runtime::{ControlsError, Teleoperation};

use super::ask;
use crate::answer::Answer;
use crate::context::Context;
use crate::lease::TERM;
use crate::problem::Problem;
use crate::route::Ask;
use crate::schema;
use crate::socket::gate;

pub(super) fn list(context: &Arc<Context>, _: &Ask) -> Result<Answer, Problem> {
    ask(context, Call::ControlsList {})
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Take {
    actuator: String,
}

pub(super) fn take(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let Take { actuator } = asked.body()?;
    let taken =
        context.desk.composer().take_controls(&actuator, &asked.who).map_err(|error| match error {
            ControlsError::Unknown { .. } => {
                Problem::not_found(error.to_string(), "GET /api/v1/leases lists them")
            }
            ControlsError::Taken { .. } => {
                let help = "wait until they are given back; a stop needs no controls";
                Problem::new(StatusCode::CONFLICT, error.to_string(), help)
            }
        })?;
    let interface = schema::of_interface(taken.descriptor());
    let lease = context.leases.begin(taken).map_err(|error| {
        let message = format!("no lease can be made: {error}");
        Problem::new(StatusCode::SERVICE_UNAVAILABLE, message, "try again")
    })?;
    Ok(Answer::json(json!({
        "lease": lease,
        "actuator": actuator,
        "term_ms": TERM.as_millis() as u64,
        "hold_ms": Teleoperation::HOLD.as_millis() as u64,
        "interface": interface,
    })))
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Renew {
    #[serde(default)]
    command: Option<Value>,
    #[serde(default)]
    release: bool,
}

pub(super) fn renew(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    let Renew { command, release } = asked.body_or_default()?;
    if command.is_some() && release {
        return Err(Problem::bad("a command and its end in one", "say one of `command` and `release`"));
    }
    let done = context.leases.renew(asked.part("lease"), |controls| -> Result<String, Problem> {
        if release {
            controls.release();
        }
        let help = "see the interface in the answer to POST /api/v1/leases";
        if let Some(command) = command {
            // What is forgotten must not be zero: a robot would turn with one wheel.
            schema::complete(controls.descriptor(), |name| command.get(name).is_some(), help)?;
            controls.command(&command).map_err(|error| Problem::unfit(error.to_string(), help))?;
        }
        Ok(controls.actuator().to_owned())
    });
    let actuator = done.ok_or_else(unknown)??;
    Ok(Answer::json(json!({ "actuator": actuator, "gate": gate(context, &actuator), "time": context.now() })))
}

pub(super) fn give_back(context: &Arc<Context>, asked: &Ask) -> Result<Answer, Problem> {
    match context.leases.end(asked.part("lease")) {
        true => Ok(Answer::Nothing),
        false => Err(unknown()),
    }
}

fn unknown() -> Problem {
    let help =
        format!("it ends {} s after it was renewed last; POST /api/v1/leases makes one", TERM.as_secs());
    Problem::not_found("there is no such lease", help)
}
