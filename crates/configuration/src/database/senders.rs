//! Changes of a list of senders or commands in a document.

use toml_edit::{Array, InlineTable, Item};

use super::super::senders::{UNNAMED, is_sender};
use super::super::value::Value;
use super::location::{is_it, item_at, locate, short};

/// Splits a path to an entry of a list into the list, entry and rest.
/// The list is that of a link's senders, or of an actuator's commands.
fn list_of(path: &[String]) -> Option<(&[String], &str, &[String])> {
    match path {
        [section, _, sender, rest @ ..] if section == "links" && is_sender(sender) => {
            Some((&path[..2], sender, rest))
        }
        [section, _, list, command, rest @ ..] if section == "actuators" && list == "commands" => {
            Some((&path[..3], command, rest))
        }
        _ => None,
    }
}

/// Adds a sender to a list; true if that was all.
/// A list that can't express it becomes a table.
pub(super) fn set(part: &mut Item, path: &[String], value: &Value) -> bool {
    let Some((list, sender, rest)) = list_of(path) else { return false };
    let (keys, scope) = locate(part, list);
    let Some(item) = item_at(part, &keys).filter(|item| item.is_array() || item.is_str()) else {
        return false;
    };
    if let Some(text) = item.as_str().map(str::to_owned) {
        *item = Item::Value(Array::from_iter([text]).into());
    }
    let Some(list) = item.as_array_mut() else { return false };
    if rest.is_empty() && *value == Value::Bool(true) {
        if !list.iter().any(|own| own.as_str().is_some_and(|own| is_it(own, sender, &scope))) {
            list.push(short(sender, &scope));
        }
        return true;
    }
    if sender == UNNAMED && *value == Value::Bool(false) {
        if !list.iter().any(|own| own.as_bool() == Some(false)) {
            list.push(false);
        }
        return true;
    }
    let mut table = InlineTable::new();
    *table.decor_mut() = list.decor().clone();
    for own in list.iter() {
        if let Some(text) = own.as_str() {
            table.insert(text, true.into());
        } else if own.as_bool() == Some(false) {
            table.insert(UNNAMED, false.into());
        } else if let Some(own) = own.as_inline_table() {
            let mut own = own.clone();
            if let Some(from) = own.remove("from").as_ref().and_then(toml_edit::Value::as_str) {
                table.insert(from, own.into());
            }
        }
    }
    *item = Item::Value(table.into());
    false
}

/// Removes a sender from a list, and returns its comments.
/// `None` if the path leads to no list.
pub(super) fn remove(part: &mut Item, path: &[String]) -> Option<String> {
    let (list, sender, _) = list_of(path)?;
    let (keys, scope) = locate(part, list);
    let list = item_at(part, &keys)?.as_array_mut()?;
    let from = |value: &toml_edit::Value| match value.as_inline_table() {
        Some(table) => table.get("from").and_then(|from| from.as_str().map(str::to_owned)),
        None if value.as_bool() == Some(false) => Some(UNNAMED.to_owned()),
        None => value.as_str().map(str::to_owned),
    };
    list.retain(|own| !from(own).is_some_and(|own| is_it(&own, sender, &scope)));
    Some(String::new())
}
