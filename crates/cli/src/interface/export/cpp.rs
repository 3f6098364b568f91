//! Header in C++: structs with their descriptions, for `slate.hpp`.

use std::fmt::Write;

use slate::blackboard::interface::{Descriptor, Enumeration, Field, Kind, Primitive};

use super::{HeaderTypes, comment, identifier, literal};

/// Namespace of the structs.
const NAMESPACE: &str = "interfaces";

pub fn header(origin: &str, types: &HeaderTypes) -> String {
    let mut text = format!("// {origin}\n\n#pragma once\n\n#include <slate.hpp>\n");
    for enumeration in &types.enumerations {
        enum_class(&mut text, enumeration);
    }
    let _ = write!(text, "\nnamespace {NAMESPACE} {{\n");
    for descriptor in &types.structs {
        structure(&mut text, descriptor);
    }
    let _ = write!(text, "\n}} // namespace {NAMESPACE}\n");
    text
}

/// Writes an enumeration, and its names as the schema has them.
fn enum_class(text: &mut String, enumeration: &Enumeration) {
    let Enumeration { name, carrier, constants } = enumeration;
    let _ = write!(text, "\nnamespace {NAMESPACE} {{\n\nenum class {name} : {} {{\n", type_name(carrier));
    for constant in *constants {
        text.push_str(&comment("    ", constant.doc, ""));
        let _ = writeln!(text, "    {} = {},", identifier(constant.name), constant.value);
    }
    let _ = write!(
        text,
        "}};\n\n}} // namespace {NAMESPACE}\n\ntemplate <>\nstruct slate::Enumeration<{NAMESPACE}::{name}> {{\n    \
         static constexpr const char *name = \"{name}\";\n    static constexpr slate::Constant constants[] = {{\n"
    );
    for constant in *constants {
        let _ = writeln!(
            text,
            "        {{{}, {}, {}}},",
            literal(constant.name),
            constant.value,
            literal(constant.doc)
        );
    }
    text.push_str("    };\n};\n");
}

fn structure(text: &mut String, descriptor: &Descriptor) {
    let name = descriptor.name;
    let _ = write!(text, "\n{}struct {name} {{\n", comment("", descriptor.doc, ""));
    for field in descriptor.fields {
        match field.kind {
            Kind::Tail(item) => {
                let _ = writeln!(text, "    // Behind it: the tail `{}` of {}.", field.name, type_name(item));
            }
            _ => {
                text.push_str(&comment("    ", field.doc, field.unit));
                let _ = writeln!(text, "    {} {}{{}};", type_name(&field.kind), identifier(field.name));
            }
        }
    }
    let doc = literal(descriptor.doc);
    let _ = write!(
        text,
        "\n    static constexpr auto interface() {{\n        return slate::interface(\n            \"{name}\", {doc}"
    );
    for field in descriptor.fields {
        let _ = write!(text, ",\n            {}", described(name, field));
    }
    text.push_str(");\n    }\n};\n");
}

fn described(name: &str, field: &Field) -> String {
    let what = match field.kind {
        Kind::Tail(item) => format!("tail<{}>", type_name(item)),
        _ => format!("field<&{name}::{}>", identifier(field.name)),
    };
    let arguments: Vec<_> = [field.name, field.unit, field.doc].into_iter().map(literal).collect();
    format!("slate::{what}({})", arguments.join(", "))
}

fn type_name(kind: &Kind) -> String {
    match kind {
        Kind::Primitive(primitive) => match primitive {
            Primitive::Bool => "slate::Bool".into(),
            Primitive::F32 => "float".into(),
            Primitive::F64 => "double".into(),
            integer => integer_name(*integer, "std::"),
        },
        Kind::Enumeration(enumeration) => enumeration.name.into(),
        Kind::Text(capacity) => format!("slate::Text<{capacity}>"),
        Kind::Optional(item) => format!("slate::Optional<{}>", type_name(item)),
        Kind::Array(item, length) => format!("std::array<{}, {length}>", type_name(item)),
        Kind::Sequence(item, capacity) => format!("slate::Sequence<{}, {capacity}>", type_name(item)),
        Kind::Nested(descriptor) => descriptor.name.into(),
        Kind::Tail(item) => type_name(item),
    }
}

/// Returns the name of an integer type, such as `std::uint8_t`.
pub(super) fn integer_name(primitive: Primitive, prefix: &str) -> String {
    let (sign, bits) = primitive.name().split_at(1);
    format!("{prefix}{}int{bits}_t", if sign == "u" { "u" } else { "" })
}
