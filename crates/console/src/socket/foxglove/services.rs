//! Stop, reset and arm, as services.

use std::sync::Arc;

use serde_json::{Value as Json, json};
use slate_control::operations::{by_name, carry_out};
use slate_control::{Caller, Context};

use super::Out;
use super::request::Call;

/// The operations that are services.
const NAMES: [&str; 3] = ["stop", "reset", "arm"];

/// Says which there are; each is known by its place among them, from 1.
pub(super) fn advertise() -> Out {
    let schema =
        |text: &str| json!({ "type": "object", "properties": { text: { "type": "string" } } }).to_string();
    let services: Vec<_> = NAMES
        .iter()
        .zip(1..)
        .map(|(name, id)| {
            let request = schema(if *name == "stop" { "reason" } else { "actuator" });
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
    Out::Text(json!({ "op": "advertiseServices", "services": services }).to_string())
}

pub(super) fn call(context: &Arc<Context>, caller: &Caller, call: &Call) -> Result<Json, String> {
    let place = (call.service as usize).checked_sub(1);
    let Some(name) = place.and_then(|place| NAMES.get(place)) else {
        return Err(format!("there is no service {}", call.service));
    };
    if let Some(needed) = by_name(name).map(|operation| operation.role).filter(|needed| caller.role < *needed)
    {
        return Err(format!("{} may not do this: ask with the token of {}", caller.role.one(), needed.one()));
    }
    // What comes with a stop is no reason not to stop.
    let body: Json = serde_json::from_slice(&call.payload).unwrap_or_default();
    if *name != "stop" && call.encoding != "json" {
        return Err(format!("the call is in `{}`; only json is taken", call.encoding));
    }
    let text = |name: &str| body[name].as_str().filter(|text| !text.is_empty());
    let body = match *name {
        "stop" => json!({ "reason": text("reason").unwrap_or_default() }),
        "reset" => Json::Null,
        _ => json!({ "actuator": text("actuator") }),
    };
    carry_out(context, caller, name, "", body)
        .map(|_| json!({ "done": name }))
        .map_err(|problem| problem.detail().to_owned())
}
