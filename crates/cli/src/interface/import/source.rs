//! Imported interfaces as source of Rust.

use std::fmt::Write;

use slate::blackboard::interface::Primitive;
use slate::ros_messages::{DefinedConstant, DefinedItem};

use super::constants::{ImportedEnumeration, boolean, integer};
use super::{ImportInterface, ImportedField, ImportedInterface, ros_name};
use crate::interface::comment;
use crate::interface::word::identifier_error;

/// Returns the source of interfaces.
/// The last one has the fields of the whole message.
pub(super) fn source(options: &ImportInterface, name: &str, imported: &[ImportedInterface<'_>]) -> String {
    let topic = name.rsplit('/').next().unwrap_or_default().to_ascii_lowercase();
    let file = &options.file;
    let kind = options.kind.as_ref().map(|kind| format!(", type = {kind:?}")).unwrap_or_default();
    let ros = if options.ros1 { "ROS 1" } else { "ROS 2" };
    let mut text = format!(
        "// {name}, for topics of {ros} such as\n\
         // read.\"module/input\" = {{ topic = \"/{topic}\", definition = {file:?}{kind} }}\n"
    );
    if let Some(whole) = imported.last().filter(|whole| whole.has_tail) {
        let own = whole.fields.last().map(|field| field.defined.name).unwrap_or_default();
        add(&mut text, format_args!("// Its `{own}` has any length: ports of it take `#[capacity(n)]`.\n"));
    }
    text.push_str("use slate_plugin::prelude::*;\n");
    for interface in imported {
        add_interface(&mut text, interface);
    }
    text
}

/// Appends formatted text, which can't fail for a string.
fn add(text: &mut String, more: std::fmt::Arguments<'_>) {
    let _ = text.write_fmt(more);
}

fn add_interface(text: &mut String, interface: &ImportedInterface<'_>) {
    let ImportedInterface { name, message, fields, enumerations, constants, has_tail } = interface;
    let ros = ros_name(&message.key);
    for enumeration in enumerations {
        add_enumeration(text, enumeration);
    }
    let doc = if message.doc.is_empty() { format!("`{ros}` of ROS.") } else { documentation(&message.doc).0 };
    let comparable = if *has_tail { "" } else { "#[derive(PartialEq)]\n" };
    text.push('\n');
    text.push_str(&comment("", &doc));
    add(text, format_args!("#[interface(ros = {ros:?})]\n{comparable}pub struct {name} {{\n"));
    for field in fields {
        add_field(text, field);
    }
    text.push_str("}\n");
    if !constants.is_empty() {
        add(text, format_args!("\nimpl {name} {{\n"));
        for constant in constants {
            add_constant(text, constant);
        }
        text.push_str("}\n");
    }
}

fn add_field(text: &mut String, ImportedField { defined, kind }: &ImportedField<'_>) {
    let (doc, unit) = documentation(&defined.doc);
    let name = defined.name;
    let doc = if doc.is_empty() { format!("The {}.", name.replace('_', " ")) } else { doc };
    text.push_str(&comment("    ", &doc));
    if !unit.is_empty() {
        add(text, format_args!("    #[unit({unit:?})]\n"));
    }
    let raw = if identifier_error(name).is_some() { "r#" } else { "" };
    add(text, format_args!("    pub {raw}{name}: {kind},\n"));
}

fn add_enumeration(text: &mut String, enumeration: &ImportedEnumeration<'_>) {
    let ImportedEnumeration { name, field, carrier, constants } = enumeration;
    add(text, format_args!("\n/// Values of `{field}`.\n#[interface]\n"));
    if *carrier != Primitive::U8 {
        add(text, format_args!("#[repr({})]\n", carrier.name()));
    }
    add(text, format_args!("pub enum {name} {{\n"));
    for constant in constants {
        text.push_str(&comment("    ", &constant_doc(constant.defined)));
        add(text, format_args!("    {} = {},\n", constant.name, constant.value));
    }
    text.push_str("}\n");
}

fn add_constant(text: &mut String, constant: &DefinedConstant<'_>) {
    let name = constant.name.to_ascii_uppercase();
    let (kind, value) = match constant.item {
        DefinedItem::Number(Primitive::Bool) => {
            ("bool", boolean(constant.value).unwrap_or_default().to_string())
        }
        DefinedItem::Number(number) => {
            let float = || constant.value.parse::<f64>().unwrap_or(f64::NAN);
            let value = integer(constant.value).filter(|_| number.integers().is_some());
            (number.name(), value.map_or_else(|| format!("{:?}", float()), |value| value.to_string()))
        }
        _ => ("&str", format!("{:?}", unquoted(constant.value))),
    };
    let doc = constant_doc(constant);
    text.push_str(&comment("    ", if doc.is_empty() { "Constant of the message." } else { &doc }));
    add(text, format_args!("    pub const {name}: {kind} = {value};\n"));
}

fn constant_doc(constant: &DefinedConstant<'_>) -> String {
    match documentation(&constant.doc) {
        (doc, unit) if unit.is_empty() => doc,
        (doc, unit) => format!("{doc} ({unit})"),
    }
}

/// Returns the text in quotes, or the whole text.
fn unquoted(text: &str) -> &str {
    let inside = |quote| text.strip_prefix(quote).and_then(|text| text.strip_suffix(quote));
    inside('"').or_else(|| inside('\'')).unwrap_or(text)
}

/// Comments as documentation, and the unit in brackets at their end.
fn documentation(lines: &[&str]) -> (String, String) {
    let text = lines.join("\n");
    let (text, unit) = match text.strip_suffix(']').and_then(|text| text.rsplit_once('[')) {
        Some((text, unit)) if is_unit(unit) => (text.trim_end(), unit),
        _ => (text.as_str(), ""),
    };
    let mut letters = text.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string()).unwrap_or_default();
    // Brackets are links in documentation.
    let text = (first + letters.as_str()).replace('[', "(").replace(']', ")");
    (text, unit.to_owned())
}

/// Returns whether a word in brackets is a unit, such as `m/s^2`.
/// Ranges and remarks are not types.
fn is_unit(word: &str) -> bool {
    let is_sign = |c: char| c.is_alphanumeric() || "/*^%°·-".contains(c);
    word.len() <= 16
        && word.starts_with(|c: char| c.is_alphabetic() || "%°".contains(c))
        && word.chars().all(is_sign)
}
