//! JSON Schema 2020-12 of values.

use serde_json::{Value as Json, json};
use slate_blackboard::interface::{Descriptor, Kind, Primitive};

use crate::agent::missing_fields;
use crate::problem::Problem;

/// Checks that a value names all fields of its interface.
/// Otherwise the error names the missing ones.
pub fn complete(descriptor: &Descriptor, names: impl Fn(&str) -> bool, help: &str) -> Result<(), Problem> {
    let missing = missing_fields(descriptor, names);
    if missing.is_empty() {
        return Ok(());
    }
    Err(Problem::unfit(format!("it lacks {}", missing.join(", ")), help))
}

/// Returns the schema of an interface's values.
pub fn of_interface(descriptor: &Descriptor) -> Json {
    let mut schema = of_fields(descriptor);
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!(descriptor.name);
    schema["x-schema"] = json!(format!("{:016x}", descriptor.hash));
    if !descriptor.ros.is_empty() {
        schema["x-ros"] = json!(descriptor.ros);
    }
    schema
}

fn of_fields(descriptor: &Descriptor) -> Json {
    let mut properties = serde_json::Map::new();
    for field in descriptor.fields {
        let mut schema = of_kind(&field.kind);
        if !field.doc.is_empty() {
            schema["description"] = json!(field.doc);
        }
        if !field.unit.is_empty() {
            schema["x-unit"] = json!(field.unit);
        }
        properties.insert(field.name.into(), schema);
    }
    // A JSON object has no order, but a value is shown in the order of its interface: x before theta.
    let order: Vec<_> = descriptor.fields.iter().map(|field| field.name).collect();
    json!({
        "type": "object",
        "description": descriptor.doc,
        "properties": properties,
        "x-order": order,
        "additionalProperties": false,
    })
}

fn of_kind(kind: &Kind) -> Json {
    match kind {
        Kind::Primitive(Primitive::Bool) => json!({ "type": "boolean" }),
        Kind::Primitive(Primitive::U8) => whole(0, u8::MAX.into()),
        Kind::Primitive(Primitive::U16) => whole(0, u16::MAX.into()),
        Kind::Primitive(Primitive::U32) => whole(0, u32::MAX.into()),
        Kind::Primitive(Primitive::U64) => json!({ "type": "integer", "minimum": 0, "maximum": u64::MAX }),
        Kind::Primitive(Primitive::I8) => whole(i8::MIN.into(), i8::MAX.into()),
        Kind::Primitive(Primitive::I16) => whole(i16::MIN.into(), i16::MAX.into()),
        Kind::Primitive(Primitive::I32) => whole(i32::MIN.into(), i32::MAX.into()),
        Kind::Primitive(Primitive::I64) => whole(i64::MIN, i64::MAX),
        // Infinity and NaN are null, as JSON has neither.
        Kind::Primitive(Primitive::F32) => json!({ "type": ["number", "null"], "format": "float" }),
        Kind::Primitive(Primitive::F64) => json!({ "type": ["number", "null"], "format": "double" }),
        Kind::Enumeration(enumeration) => {
            let names: Vec<_> = enumeration.constants.iter().map(|constant| constant.name).collect();
            json!({ "anyOf": [{ "enum": names }, of_kind(&enumeration.carrier)], "title": enumeration.name })
        }
        Kind::Text(capacity) => json!({ "type": "string", "x-bytes": capacity }),
        Kind::Optional(item) => json!({ "anyOf": [of_kind(item), { "type": "null" }] }),
        Kind::Array(item, count) => {
            json!({ "type": "array", "items": of_kind(item), "minItems": count, "maxItems": count })
        }
        Kind::Sequence(item, capacity) => {
            json!({ "type": "array", "items": of_kind(item), "maxItems": capacity })
        }
        Kind::Nested(descriptor) => of_fields(descriptor),
        Kind::Tail(item) => json!({ "type": "array", "items": of_kind(item) }),
    }
}

fn whole(minimum: i64, maximum: i64) -> Json {
    json!({ "type": "integer", "minimum": minimum, "maximum": maximum })
}
