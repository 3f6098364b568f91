//! Holders of actuators, and control over plain requests.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::json;
use slate_blackboard::interface::Value;
use slate_runtime::{ControlsError, Teleoperation};

use super::{gate, reply, shape};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::lease::LEASE_DURATION;
use crate::operation::{Operation, OperationRequest, Pace, without_slash};
use crate::problem::Problem;
use crate::schema;
use crate::surface::ControlSurface;

pub(super) const LIST: Operation =
    Operation::get("/leases", "leases", Role::Viewer, "Actuators, and the holder of each control lease")
        .pace(Pace::Prompt)
        .answers(|| shape::list(shape::holder()), |surface, _| reply(surface.agent.holders()));

pub(super) const TAKE: Operation = Operation::post(
    "/leases",
    "take",
    Role::Operator,
    "Acquires the exclusive control lease of an actuator", Pace::Prompt).needs_run().body(|| {
        json!({
            "type": "object",
            "required": ["actuator"],
            "properties": {
                "actuator": shape::text(),
                "who": { "type": "string", "description": "Name of the holder, shown to people." },
                "bound": { "type": "boolean", "description": "True if the lease also ends with this connection." },
            },
            "additionalProperties": false,
        })
    }).answers(shape::lease, take);

pub(super) const DRIVE: Operation = Operation::put(
    "/leases/{lease}",
    super::DRIVE,
    Role::Operator,
    "Renews a control lease for 5 s, and commands the actuator for 150 ms",
    Pace::Prompt,
)
.body(shape::drive)
.answers(
    || shape::object(&[("actuator", shape::text()), ("gate", shape::anything()), ("time", shape::count())]),
    renew,
);

pub(super) const GIVE_BACK: Operation = Operation::delete(
    "/leases/{lease}",
    "give_back",
    Role::Operator,
    "Releases a control lease",
    Pace::Prompt,
)
.answers(|| json!({ "type": "object", "maxProperties": 0 }), give_back);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Take {
    actuator: String,
    #[serde(default)]
    who: String,
    #[serde(default)]
    bound: bool,
}

/// Maximum length of the driver's name, letters.
const MAX_NAME_LENGTH: usize = 80;

/// Returns the holder of the controls, for people.
fn holder(request: &OperationRequest, who: &str) -> String {
    let own: String = who.chars().take(MAX_NAME_LENGTH).collect();
    match (own.is_empty(), &request.caller.local) {
        (true, Some(_)) => "a tool".into(),
        (true, None) => request.caller.who.clone(),
        (false, Some(_)) => own,
        (false, None) => format!("{own} ({})", request.caller.who),
    }
}

fn take(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let Take { actuator, who, bound } = request.body()?;
    let actuator = without_slash(&actuator);
    let taken = surface.agent.composer().take_controls(actuator, &holder(request, &who));
    let taken = taken.map_err(|error| {
        let status = match error {
            ControlsError::Unknown { .. } => StatusCode::NOT_FOUND,
            ControlsError::Taken { .. } => StatusCode::CONFLICT,
        };
        Problem::refused(status, error.into())
    })?;
    let interface = schema::of_interface(taken.descriptor());
    let lease = surface.leases.begin(taken).map_err(|error| {
        let message = format!("no lease can be made: {error}");
        Problem::new(StatusCode::SERVICE_UNAVAILABLE, message, "try again")
    })?;
    if bound && !request.caller.connection.bind_lease(&lease) {
        surface.leases.end(&lease);
        let message = "the connection to which the lease is bound is closed";
        return Err(Problem::new(StatusCode::CONFLICT, message, "take the controls over an open connection"));
    }
    Ok(OperationAnswer::json(json!({
        "lease": lease,
        "actuator": actuator,
        "term_ms": LEASE_DURATION.as_millis() as u64,
        "hold_ms": Teleoperation::COMMAND_DURATION.as_millis() as u64,
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

pub(super) fn renew(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let Renew { command, release } = request.body_or_default()?;
    if command.is_some() && release {
        return Err(Problem::bad("a command and its end in one", "expected `command` or `release`"));
    }
    let done = surface.leases.renew(request.part("lease")?, |controls| -> Result<String, Problem> {
        if release {
            controls.release();
        }
        let help = "see the interface in the answer to POST /api/v1/leases";
        if let Some(command) = command {
            controls.command(&command).map_err(|error| Problem::unfit(error.to_string(), help))?;
        }
        Ok(controls.actuator().to_owned())
    });
    let actuator = done.ok_or_else(unknown)??;
    Ok(OperationAnswer::json(
        json!({ "actuator": actuator, "gate": gate(surface, &actuator), "time": surface.now() }),
    ))
}

pub(super) fn give_back(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    match surface.leases.end(request.part("lease")?) {
        true => Ok(OperationAnswer::Nothing),
        false => Err(unknown()),
    }
}

fn unknown() -> Problem {
    let help = format!(
        "it ends {} s after it was renewed last; POST /api/v1/leases makes one",
        LEASE_DURATION.as_secs()
    );
    Problem::not_found("lease unknown or expired", help)
}
