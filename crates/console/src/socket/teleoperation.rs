//! Teleoperation over a socket of its own.
//! Commands of the operator never wait behind other messages.
//!
//! The client says `{"take": "r2/wheels"}`, then `{"command": {"left": 1, "right": 1}, "sequence": 7}` at 20 Hz as long as a key
//! is held, and `{"release": true}` when it is let go. It is answered how the gate stands. A command holds for 150 ms
//! ([`Teleoperation::COMMAND_DURATION`]) and ends by the agent's own clock, whatever became of the key, the page, the machine or the network.
//! `{"stop": "reason"}` stops all actuators at once.

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_blackboard::interface::Value;
use slate_runtime::{ControlsError, ErrorCode, Teleoperation};

use super::{ClientMessage, Listener, Sink, SocketClient, send_text};
use slate_control::operations::gate;
use slate_control::{self as schema, Problem, without_slash};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DriveRequest {
    #[serde(default)]
    take: Option<String>,
    #[serde(default)]
    command: Option<Value>,
    #[serde(default)]
    release: Option<bool>,
    #[serde(default)]
    leave: Option<bool>,
    /// Sequence number, returned with the answer to measure the round-trip time.
    #[serde(default)]
    sequence: Option<u64>,
}

pub(super) async fn serve(client: SocketClient, mut sink: Sink, mut listener: Listener) {
    let mut controls = None;
    // With the visit end the controls, wherever it is left.
    while let Some(message) = listener.next().await {
        let ClientMessage::Text(text) = message else { continue };
        let answer = handle(&client, &mut controls, &text)
            .unwrap_or_else(|(sequence, problem)| json!({ "problem": problem.json(), "sequence": sequence }));
        if !send_text(&mut sink, answer.to_string()).await {
            return;
        }
    }
}

fn handle(
    client: &SocketClient,
    controls: &mut Option<Teleoperation>,
    text: &str,
) -> Result<Json, (Option<u64>, Problem)> {
    let surface = &client.surface;
    let invalid = |error| {
        let help = "such as {\"take\": \"r2/wheels\"} or {\"command\": {...}, \"sequence\": 1}";
        (None, Problem::bad(format!("this can't be understood: {error}"), help))
    };
    let mut message: Json = serde_json::from_str(text).map_err(invalid)?;
    if let Some(reason) = stop(&mut message) {
        let sequence = message.get("sequence").and_then(Json::as_u64);
        let reason = reason.unwrap_or_else(|| format!("by the {}", client.who));
        if let Some(controls) = controls {
            controls.release();
        }
        surface.agent.stop(&reason);
        return Ok(json!({ "stopped": true, "sequence": sequence }));
    }
    let request = DriveRequest::deserialize(message).map_err(invalid)?;
    let sequence = request.sequence;
    let wrong = |problem| (sequence, problem);
    if let Some(name) = request.take {
        // A client has at most one.
        *controls = None;
        let taken = surface.agent.composer().take_controls(without_slash(&name), &client.who);
        let taken = taken.map_err(|error| {
            wrong(match error {
                ControlsError::Unknown { .. } => {
                    Problem::not_found(error.to_string(), "GET /api/v1/actuators lists the actuators")
                }
                ControlsError::Taken { .. } => {
                    let help = "their holder releases them with {\"leave\": true}; a stop needs no controls";
                    Problem::new(StatusCode::CONFLICT, error.to_string(), help).of(ErrorCode::Held)
                }
            })
        })?;
        let answer = json!({
            "taken": name,
            "hold_ms": Teleoperation::COMMAND_DURATION.as_millis() as u64,
            "interface": schema::of_interface(taken.descriptor()),
            "gate": gate(surface, &name),
            "sequence": sequence,
        });
        *controls = Some(taken);
        return Ok(answer);
    }
    if request.leave == Some(true) {
        *controls = None;
        return Ok(json!({ "left": true, "sequence": sequence }));
    }
    let Some(controls) = controls else {
        let problem =
            Problem::new(StatusCode::CONFLICT, "you have no controls", "send {\"take\": \"ACTUATOR\"} first");
        return Err(wrong(problem));
    };
    match (request.command, request.release) {
        (Some(command), None | Some(false)) => {
            let help = "see the interface in the answer to `take`";
            controls.command(&command).map_err(|error| wrong(Problem::unfit(error.to_string(), help)))?;
        }
        (None, Some(true)) => controls.release(),
        _ => {
            let help = "expected take, command, release, leave and stop";
            return Err(wrong(Problem::bad("the message is empty", help)));
        }
    }
    Ok(json!({ "gate": gate(surface, controls.actuator()), "time": surface.now(), "sequence": sequence }))
}

/// Takes the stop out of a message, with its reason; `None` if it is no stop.
/// Invalid reasons or other content never prevent a stop; a null or false one beside another action means no stop.
fn stop(message: &mut Json) -> Option<Option<String>> {
    let message = message.as_object_mut()?;
    let reason = message.remove("stop")?;
    let is_denied = matches!(reason, Json::Null | Json::Bool(false));
    let is_other = |name: &&str| message.get(*name).is_some_and(|value| !value.is_null());
    if is_denied && ["take", "command", "release", "leave"].iter().any(is_other) {
        return None;
    }
    Some(reason.as_str().filter(|reason| !reason.is_empty()).map(str::to_owned))
}
