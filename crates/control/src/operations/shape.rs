//! Shapes of bodies and answers, as JSON Schema.

use serde_json::{Map, Value as Json, json};

pub(super) fn anything() -> Json {
    json!({})
}

pub(super) fn flag() -> Json {
    json!({ "type": "boolean" })
}

pub(super) fn text() -> Json {
    json!({ "type": "string" })
}

pub(super) fn count() -> Json {
    json!({ "type": "integer", "minimum": 0 })
}

pub(super) fn list(of: Json) -> Json {
    json!({ "type": "array", "items": of })
}

pub(super) fn optional(of: Json) -> Json {
    json!({ "anyOf": [of, { "type": "null" }] })
}

/// Returns an object with these fields and no others.
pub(super) fn object(fields: &[(&str, Json)]) -> Json {
    let properties: Map<_, _> = fields.iter().map(|(name, of)| ((*name).to_owned(), of.clone())).collect();
    let required: Vec<_> = fields.iter().map(|(name, _)| *name).collect();
    json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": false })
}

pub(super) fn problem() -> Json {
    json!({
        "type": "object",
        "properties": {
            "type": text(),
            "title": text(),
            "status": { "type": "integer" },
            "detail": text(),
            "help": { "type": "string", "description": "Remedy." },
            "code": { "type": "string", "description": "Error code; see `slate explain CODE`." },
            "report": { "type": "string", "description": "File, line and caret of the error in a configuration." },
        },
        "required": ["type", "title", "status", "detail"],
    })
}

pub(super) fn agent() -> Json {
    object(&[
        ("api", count()),
        ("name", text()),
        ("version", text()),
        ("run", json!({ "type": "string", "description": "Differs after each start of the agent." })),
        ("role", json!({ "enum": ["viewer", "operator", "developer"] })),
        ("time", count()),
        ("lockstep", flag()),
        ("stopped", optional(text())),
        (
            "over",
            json!({ "type": ["string", "null"], "description": "Result of the run; null while it runs." }),
        ),
    ])
}

pub(super) fn property() -> Json {
    json!({
        "type": "object",
        "properties": {
            "path": text(),
            "url": text(),
            "interface": text(),
            "doc": text(),
            "access": { "enum": ["output", "setting", "queue", "messages"] },
            "sequence": count(),
            "readers": count(),
            "value": {},
            "time": count(),
        },
        "required": ["path", "interface", "doc"],
    })
}

pub(super) fn reading() -> Json {
    json!({
        "type": "object",
        "properties": { "value": {}, "sequence": count(), "time": count() },
        "required": ["value", "sequence", "time"],
    })
}

pub(super) fn changed() -> Json {
    json!({
        "type": "object",
        "properties": {
            "path": text(),
            "before": optional(text()),
            "after": optional(text()),
            "default": optional(text()),
            "conversion": text(),
            "needs_reload": text(),
        },
        "required": ["path"],
        "additionalProperties": false,
    })
}

pub(super) fn different() -> Json {
    json!({
        "type": "object",
        "properties": {
            "path": text(),
            "file": optional(text()),
            "present": optional(text()),
            "origin": optional(text()),
            "default": optional(text()),
        },
        "required": ["path"],
        "additionalProperties": false,
    })
}

pub(super) fn setting() -> Json {
    object(&[("path", text()), ("value", anything()), ("text", text()), ("origin", text())])
}

pub(super) fn module() -> Json {
    object(&[
        ("name", text()),
        ("kind", text()),
        ("plugin", text()),
        ("condition", text()),
        ("waiting_for", optional(text())),
        ("ticks", count()),
        ("misses", count()),
        ("panics", count()),
        ("has_shadow", flag()),
    ])
}

pub(super) fn parameter() -> Json {
    object(&[
        ("module", text()),
        ("name", text()),
        ("default", anything()),
        ("range", optional(list(json!({ "type": "number" })))),
        ("operable", flag()),
    ])
}

pub(super) fn plugin() -> Json {
    object(&[
        ("name", text()),
        ("version", text()),
        ("file", optional(text())),
        ("loaded", flag()),
        ("kinds", list(text())),
        ("modules", list(text())),
        ("shadow", optional(text())),
    ])
}

pub(super) fn link() -> Json {
    json!({
        "type": "object",
        "properties": {
            "to": text(),
            "from": text(),
            "sends": { "type": "boolean", "description": "True if it carries messages from an outbox to an inbox." },
            "inferred": { "type": "boolean", "description": "True if it was inferred from types and roles." },
            "options": list(list(text())),
            "queue": optional(list(count())),
            "age": { "type": "integer", "minimum": 0, "description": "Age of the value in the last measured step of its reader, ns." },
            "evicted": flag(),
            "trouble": text(),
        },
        "required": ["to", "from", "sends", "inferred", "evicted"],
        "additionalProperties": false,
    })
}

pub(super) fn line() -> Json {
    object(&[
        ("sequence", count()),
        ("time", count()),
        ("level", text()),
        ("module", text()),
        ("text", text()),
        ("dropped", count()),
    ])
}

pub(super) fn actuator() -> Json {
    object(&[
        ("name", text()),
        ("stopped", optional(text())),
        ("gate", anything()),
        ("command", anything()),
        ("interface", text()),
    ])
}

pub(super) fn snapshot() -> Json {
    object(&[("agent", text()), ("time", count()), ("cycle", count()), ("file", text())])
}

pub(super) fn holder() -> Json {
    object(&[("actuator", text()), ("holder", optional(text())), ("since", optional(count()))])
}

pub(super) fn lease() -> Json {
    object(&[
        ("lease", text()),
        ("actuator", text()),
        ("term_ms", count()),
        ("hold_ms", count()),
        ("interface", json!({ "type": "object" })),
    ])
}

pub(super) fn drive() -> Json {
    json!({
        "type": "object",
        "properties": {
            "command": { "type": "object", "description": "A value of the actuator's interface." },
            "release": { "type": "boolean", "description": "Ends the command." },
        },
        "additionalProperties": false,
    })
}
