//! Location of an error in an unreadable `[world]` table.

use serde_json::{Map, Value};
use slate_module::blackboard::nearest_names;

use crate::error::{DescriptionError, key};

/// Function that returns the reader's error for a table, if any.
type SectionError = fn(Value) -> Option<String>;

/// Returns the error of a table that can't be read, at the invalid key.
/// `error` is that of the reader.
pub(crate) fn misread(table: &Value, error: &str, read: SectionError) -> DescriptionError {
    let mut path = Vec::new();
    descend(table, &mut path, error, read);
    let mut setting = String::from("world");
    path.iter().for_each(|name| setting.extend([".", &key(name)]));
    DescriptionError::new(&setting, reworded(error))
}

/// Adds the keys that lead to the error.
fn descend<'a>(inner: &'a Value, path: &mut Vec<&'a str>, error: &str, read: SectionError) {
    let Value::Object(entries) = inner else { return };
    let missing = error.strip_prefix("missing field `").and_then(|rest| rest.split('`').next());
    if let Some(missing) = missing.filter(|missing| !entries.contains_key(*missing)) {
        let is_here = match &path[..] {
            [] => matches!(missing, "arena" | "robots"),
            // Tables of names; what is in them has the keys.
            ["robots" | "layouts" | "goals" | "faults" | "doors"] => false,
            _ => true,
        };
        if is_here {
            return;
        }
    }
    for (name, value) in entries {
        if missing.is_some() && !value.is_object() {
            continue;
        }
        path.push(name);
        let alone = path
            .iter()
            .rev()
            .fold(value.clone(), |value, name| Value::Object(Map::from_iter([((*name).to_owned(), value)])));
        if read(alone).is_some_and(|own| own == error) {
            return descend(value, path, error, read);
        }
        path.pop();
    }
}

/// Rewords the reader's message like other errors.
fn reworded(error: &str) -> String {
    if let Some((found, expected)) =
        error.strip_prefix("invalid type: ").and_then(|rest| rest.split_once(", expected "))
    {
        return format!("expected {expected}, found {found}");
    }
    if let Some(rest) = error.strip_prefix("missing field ") {
        return format!("missing key {rest}");
    }
    let Some(rest) = error.strip_prefix("unknown field `") else { return error.into() };
    let mut names = rest.split('`');
    let name = names.next().unwrap_or_default();
    let known: Vec<_> = names.skip(1).step_by(2).collect();
    let near = nearest_names(name, known.iter().copied()).into_iter().next();
    let near = near.map_or_else(String::new, |near| format!(" (did you mean `{near}`?)"));
    format!("unknown key `{name}`{near}; expected {}", known.join(", "))
}
