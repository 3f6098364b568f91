//! Stop, reset and arm, as services.

use serde_json::{Value as Json, json};
use slate_control::operations::{STOP, by_name};
use slate_control::{Caller, Dispatcher};

use super::request::{Call, FoxgloveRequest};
use super::{ClientMessage, OutgoingMessage};

/// Operations that are services.
const SERVICE_NAMES: [&str; 3] = [STOP, "reset", "arm"];

/// Returns the advertisement of the services, numbered from 1.
pub(super) fn advertise() -> OutgoingMessage {
    let schema =
        |text: &str| json!({ "type": "object", "properties": { text: { "type": "string" } } }).to_string();
    let services: Vec<_> = SERVICE_NAMES
        .iter()
        .zip(1..)
        .map(|(name, id)| {
            let request = schema(if *name == STOP { "reason" } else { "actuator" });
            let part = |schema: &str| json!({ "encoding": "json", "schemaName": name, "schemaEncoding": "jsonschema", "schema": schema });
            json!({
                "id": id,
                "name": format!("/{name}"),
                "type": format!("slate/{name}"),
                "requestSchema": request,
                "responseSchema": schema("done"),
                "request": part(&request),
                "response": part(&schema("done")),
            })
        })
        .collect();
    OutgoingMessage::Text(json!({ "op": "advertiseServices", "services": services }).to_string())
}

/// Returns the call of a stop in a message, if it is one.
pub(super) fn stop_call(message: &ClientMessage) -> Option<Call> {
    let ClientMessage::Binary(bytes) = message else { return None };
    let Ok(FoxgloveRequest::Call(call)) = FoxgloveRequest::parse_bytes(bytes) else { return None };
    (name(&call) == Some(STOP)).then_some(call)
}

/// Returns the operation of a call.
pub(super) fn name(call: &Call) -> Option<&'static str> {
    (call.service as usize).checked_sub(1).and_then(|number| SERVICE_NAMES.get(number)).copied()
}

/// Carries out a call; its answer.
pub(super) fn answer(dispatcher: &Dispatcher, caller: &Caller, call: &Call) -> OutgoingMessage {
    match carry_out(dispatcher, caller, call) {
        Ok(answer) => {
            let encoding = b"json";
            let mut bytes = vec![3];
            bytes.extend(call.service.to_le_bytes());
            bytes.extend(call.id.to_le_bytes());
            bytes.extend((encoding.len() as u32).to_le_bytes());
            bytes.extend(encoding);
            bytes.extend(answer.to_string().into_bytes());
            OutgoingMessage::Bytes(bytes)
        }
        Err(message) => {
            let (service, id) = (call.service, call.id);
            let text =
                json!({ "op": "serviceCallFailure", "serviceId": service, "callId": id, "message": message });
            OutgoingMessage::Text(text.to_string())
        }
    }
}

fn carry_out(dispatcher: &Dispatcher, caller: &Caller, call: &Call) -> Result<Json, String> {
    let Some(name) = name(call) else {
        return Err(format!("there is no service {}", call.service));
    };
    if let Some(needed) = by_name(name).map(|operation| operation.role).filter(|needed| caller.role < *needed)
    {
        return Err(format!(
            "{} may not do this: ask with the token of {}",
            caller.role.with_article(),
            needed.with_article()
        ));
    }
    // Invalid arguments never prevent a stop.
    let body: Json = serde_json::from_slice(&call.payload).unwrap_or_default();
    if name != STOP && call.encoding != "json" {
        return Err(format!("the call is in `{}`; only json is taken", call.encoding));
    }
    let text = |name: &str| body[name].as_str().filter(|text| !text.is_empty());
    let body = match name {
        STOP => json!({ "reason": text("reason").unwrap_or_default() }),
        "reset" => Json::Null,
        _ => json!({ "actuator": text("actuator") }),
    };
    dispatcher
        .carry_out(caller, name, &[], body)
        .map(|_| json!({ "done": name }))
        .map_err(|problem| problem.detail().to_owned())
}
