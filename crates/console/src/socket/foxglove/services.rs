//! Stop, reset and arm, as services.

use serde_json::{Value as Json, json};
use slate_runtime::remote;

use super::Out;
use super::request::Call;
use crate::Role;
use crate::context::Context;

const NAMES: [(&str, Role); 3] = [("stop", Role::Viewer), ("reset", Role::Operator), ("arm", Role::Operator)];

/// Says which there are; each is known by its place among them, from 1.
pub(super) fn advertise() -> Out {
    let schema =
        |text: &str| json!({ "type": "object", "properties": { text: { "type": "string" } } }).to_string();
    let services: Vec<_> = NAMES
        .iter()
        .zip(1..)
        .map(|((name, _), id)| {
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

pub(super) fn call(context: &Context, role: Role, who: &str, call: &Call) -> Result<Json, String> {
    let place = (call.service as usize).checked_sub(1);
    let Some((name, needed)) = place.and_then(|place| NAMES.get(place)) else {
        return Err(format!("there is no service {}", call.service));
    };
    if role < *needed {
        return Err(format!("{} may not do this: ask with the token of {}", role.one(), needed.one()));
    }
    // What comes with a stop is no reason not to stop.
    let body: Json = serde_json::from_slice(&call.payload).unwrap_or_default();
    if *name != "stop" && call.encoding != "json" {
        return Err(format!("the call is in `{}`; only json is taken", call.encoding));
    }
    let text = |name: &str| body[name].as_str().filter(|text| !text.is_empty()).map(ToOwned::to_owned);
    let asked = match *name {
        "stop" => remote::Call::Stop { reason: text("reason").unwrap_or_else(|| format!("by the {who}")) },
        "reset" => remote::Call::Reset {},
        _ => remote::Call::Arm { actuator: text("actuator") },
    };
    context.desk.make(asked).map(|_| json!({ "done": name })).map_err(|refusal| refusal.message)
}
