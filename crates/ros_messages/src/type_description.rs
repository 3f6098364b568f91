//! Type descriptions, whose hashes ROS 2 nodes compare (REP 2011, `RIHS01`).

use std::fmt::Write;

use slate_sorted::SortedMap;

use super::schema::{SchemaField, reference, sections};
use super::{Definition, Error};

/// Numbers of types, as `type_description_interfaces/msg/FieldType` has them.
const NESTED: u32 = 1;
const STRING: u32 = 17;
const WIDE_STRING: u32 = 18;
const BOUNDED_STRING: u32 = 21;
const BOUNDED_WIDE_STRING: u32 = 22;
const TYPES: [(&str, u32); 14] = [
    ("int8", 2),
    ("uint8", 3),
    ("char", 3),
    ("int16", 4),
    ("uint16", 5),
    ("int32", 6),
    ("uint32", 7),
    ("int64", 8),
    ("uint64", 9),
    ("float32", 10),
    ("float64", 11),
    ("bool", 15),
    ("byte", 16),
    ("string", STRING),
];

/// Added to those of their items by an array, a bounded and an unbounded sequence.
const ARRAY: u32 = 48;
const BOUNDED_SEQUENCE: u32 = 96;
const SEQUENCE: u32 = 144;

/// Field of a message that has none.
const NO_FIELD: &str = "structure_needs_at_least_one_member";

/// Messages that definitions may leave out.
const BUILTIN: [(&str, &str); 2] = [
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec"),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec"),
];

/// Returns the canonical description of a ROS 2 type.
/// Its SHA-256 is the type hash.
///
/// # Errors
/// The definition is invalid, or lacks a message.
pub fn type_description(definition: &Definition) -> Result<String, Error> {
    let wrong = |line, reason: String| Error::Definition { name: definition.name.clone(), line, reason };
    let mut messages = SortedMap::new();
    for (name, fields) in sections(&definition.name, &definition.text)? {
        messages.entry(name).or_insert(fields);
    }
    for (name, text) in BUILTIN {
        if !messages.contains_key(name)
            && let Some((name, fields)) = sections(name, text)?.pop()
        {
            messages.insert(name, fields);
        }
    }
    let top = &definition.name;
    let mut described: SortedMap<String, String> = SortedMap::new();
    let mut waiting = vec![reference("", top)];
    while let Some(key) = waiting.pop() {
        let name = if described.is_empty() { top.clone() } else { whole_name(top, &key) };
        if described.contains_key(&name) {
            continue;
        }
        let fields = messages.get(&key).map_or(&[][..], Vec::as_slice);
        let mut list = Vec::new();
        for field in fields {
            let known = |key: &str| messages.contains_key(key);
            let (of, nested) =
                field_type(top, &key, field, known).map_err(|reason| wrong(field.number, reason))?;
            list.push(format!("{{\"name\": \"{}\", \"type\": {of}}}", field.name));
            waiting.extend(nested);
        }
        if list.is_empty() {
            list.push(format!("{{\"name\": \"{NO_FIELD}\", \"type\": {}}}", type_text(3, 0, 0, "")));
        }
        let text = format!("{{\"type_name\": \"{name}\", \"fields\": [{}]}}", list.join(", "));
        described.insert(name, text);
    }
    let own = described.remove(top).unwrap_or_default();
    // In the order of their names, as the map has them.
    let others: Vec<_> = described.into_values().collect();
    let others = others.join(", ");
    Ok(format!("{{\"type_description\": {own}, \"referenced_type_descriptions\": [{others}]}}"))
}

/// Returns the full name of a nested message, such as `std_msgs/msg/Header`.
/// Parts of a service or an action, such as `test_msgs/action/Fibonacci_Goal`, are in its folder; no other name has a
/// `_`.
fn whole_name(top: &str, key: &str) -> String {
    let parts: Vec<_> = top.split('/').collect();
    let folder = match (&parts[..], key.split_once('/')) {
        ([own, folder, _], Some((package, name))) if *own == package && name.contains('_') => folder,
        _ => "msg",
    };
    key.replacen('/', &format!("/{folder}/"), 1)
}

fn type_text(id: u32, capacity: u32, string_capacity: u32, nested: &str) -> String {
    let mut text = String::new();
    // Writing into a string can't fail.
    let _ = write!(
        text,
        "{{\"type_id\": {id}, \"capacity\": {capacity}, \"string_capacity\": {string_capacity}, \"nested_type_name\": \"{nested}\"}}"
    );
    text
}

/// Returns the description of a field's type, and the message in it.
fn field_type(
    top: &str,
    owner: &str,
    field: &SchemaField<'_>,
    is_known: impl Fn(&str) -> bool,
) -> Result<(String, Option<String>), String> {
    let number = |text: &str| text.parse::<u32>().map_err(|_| format!("`{text}` is not a number of items"));
    let (item, offset, capacity) = match field.of.strip_suffix(']').and_then(|of| of.rsplit_once('[')) {
        None => (field.of, 0, 0),
        Some((item, "")) => (item, SEQUENCE, 0),
        Some((item, inside)) => match inside.strip_prefix("<=") {
            Some(bound) => (item, BOUNDED_SEQUENCE, number(bound)?),
            None => (item, ARRAY, number(inside)?),
        },
    };
    let (base, bound) = match item.split_once("<=") {
        Some((base, bound)) => (base, number(bound)?),
        None => (item, 0),
    };
    let known = TYPES.iter().find(|(name, _)| *name == base).map(|(_, id)| *id);
    let id = match (base, known) {
        ("string", _) if bound > 0 => Some(BOUNDED_STRING),
        ("wstring", _) if bound > 0 => Some(BOUNDED_WIDE_STRING),
        ("wstring", _) => Some(WIDE_STRING),
        (_, known) => known,
    };
    if let Some(id) = id {
        return Ok((type_text(id + offset, capacity, bound, ""), None));
    }
    let package = owner.split('/').next().unwrap_or_default();
    let own = reference(package, base);
    let key = if base == "Header" && !is_known(&own) { "std_msgs/Header".to_owned() } else { own };
    if !is_known(&key) {
        return Err(format!("`{base}` is not defined in the text"));
    }
    Ok((type_text(NESTED + offset, capacity, 0, &whole_name(top, &key)), Some(key)))
}
