//! Header in C: structs, and their descriptions for the JSON of a module.

use std::fmt::Write;

use serde_json::Value;
use slate::blackboard::interface::{Descriptor, Enumeration, Kind, Primitive};
use slate::module::{decode, encode_interface};

use super::cpp::integer_name;
use super::{HeaderTypes, comment, identifier, literal};
use crate::failure::Failure;

pub fn header(origin: &str, types: &HeaderTypes) -> Result<String, Failure> {
    let mut text = format!("// {origin}\n\n#pragma once\n\n#include <slate.h>\n");
    for enumeration in &types.enumerations {
        constants(&mut text, enumeration);
    }
    for descriptor in &types.structs {
        structure(&mut text, descriptor)?;
    }
    Ok(text)
}

/// Writes the named values of an enumeration.
/// Its fields have the type that carries it.
fn constants(text: &mut String, enumeration: &Enumeration) {
    let _ = write!(text, "\nenum {{\n");
    for constant in enumeration.constants {
        text.push_str(&comment("    ", constant.doc, ""));
        let _ = writeln!(
            text,
            "    {}_{} = {},",
            upper(enumeration.name),
            constant.name.to_uppercase(),
            constant.value
        );
    }
    text.push_str("};\n");
}

fn structure(text: &mut String, descriptor: &Descriptor) -> Result<(), Failure> {
    let name = descriptor.name;
    let doc = comment("", descriptor.doc, "");
    let has_members = descriptor.fields.iter().any(|field| !matches!(field.kind, Kind::Tail(_)));
    let begin = if has_members { " {\n" } else { "" };
    let _ = write!(text, "\n{doc}typedef struct {name}{begin}");
    for field in descriptor.fields {
        if let Kind::Tail(_) = field.kind {
            continue;
        }
        text.push_str(&comment("    ", field.doc, field.unit));
        let _ = writeln!(text, "    {};", declared(&field.kind, &identifier(field.name)));
    }
    // One of a tail alone has no members, and no value in C.
    let end = if has_members { "}" } else { "" };
    let _ = writeln!(text, "{end} {name};");
    if let Some(item) = descriptor.tail() {
        let size = descriptor.size;
        let _ = write!(
            text,
            "\n// Items of the tail behind a {name}, whose number is in the slot of the port. Their size is {} bytes.\n\
             #define {}_TAIL(value) ((const void *)((const uint8_t *)(value) + {size}))\n",
            item.size(),
            upper(name)
        );
    }
    let json = description(descriptor)?;
    let _ = write!(
        text,
        "\n// Description of {name}, for `interface` of a port.\n#define {}_INTERFACE {}\n",
        upper(name),
        literal(&json)
    );
    Ok(())
}

/// Returns the JSON of an interface without documentation.
/// String literals of C have little room.
fn description(descriptor: &Descriptor) -> Result<String, Failure> {
    let refused = |refusal: slate::module::Refusal| Failure::Interface {
        place: descriptor.name.into(),
        problem: refusal.to_string(),
    };
    let mut value: Value = decode(&encode_interface(descriptor).map_err(refused)?).map_err(refused)?;
    remove_texts(&mut value);
    Ok(value.to_string())
}

fn remove_texts(value: &mut Value) {
    match value {
        Value::Object(object) => {
            object.remove("doc");
            object.retain(|key, value| !(key == "unit" || key == "ros") || value.as_str() != Some(""));
            object.values_mut().for_each(remove_texts);
        }
        Value::Array(items) => items.iter_mut().for_each(remove_texts),
        _ => {}
    }
}

/// Returns the declaration of a member of that name.
fn declared(kind: &Kind, name: &str) -> String {
    match kind {
        Kind::Primitive(primitive) => format!("{} {name}", primitive_name(*primitive)),
        Kind::Enumeration(enumeration) => declared(&enumeration.carrier, name),
        Kind::Text(capacity) => format!("struct {{ uint32_t length; char bytes[{capacity}]; }} {name}"),
        Kind::Optional(item) => {
            format!("struct {{ uint32_t present; uint32_t reserved; {}; }} {name}", declared(item, "value"))
        }
        Kind::Sequence(item, capacity) => {
            let items = declared(item, &format!("items[{capacity}]"));
            format!("struct {{ uint32_t length; uint32_t reserved; {items}; }} {name}")
        }
        Kind::Array(item, length) => declared(item, &format!("{name}[{length}]")),
        Kind::Nested(descriptor) => format!("{} {name}", descriptor.name),
        Kind::Tail(item) => declared(item, name),
    }
}

fn primitive_name(primitive: Primitive) -> String {
    match primitive {
        Primitive::Bool => "uint8_t".into(),
        Primitive::F32 => "float".into(),
        Primitive::F64 => "double".into(),
        integer => integer_name(integer, ""),
    }
}

/// Returns `LaserScan` as `LASER_SCAN`.
fn upper(name: &str) -> String {
    lower(name).to_uppercase()
}

/// Returns `LaserScan` as `laser_scan`.
fn lower(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}
