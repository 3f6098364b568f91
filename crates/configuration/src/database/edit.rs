//! Changes of a document that leave the rest of its text unchanged.

use toml_edit::{Decor, DocumentMut, InlineTable, Item, Table};

use super::super::exclusive::counterpart;
use super::super::scope::in_scope;
use super::super::source::{Span, Spanned};
use super::super::value::Value;
use super::comments;
use super::location::{item_at, locate};
use super::overwrite::{insert_inline, overwrite, overwrite_value};
use super::senders;

/// Returns the table of a document at a path, created if it is missing.
/// An empty path is the whole document.
pub(super) fn part<'a>(document: &'a mut DocumentMut, path: &[&str]) -> &'a mut Item {
    let mut item = document.as_item_mut();
    for (at, key) in path.iter().enumerate() {
        let root = has_sections(item);
        make_table(item, key, path.len() + 1 - at, root);
        item = &mut item[key];
    }
    item
}

/// Returns true if entries of a table may have sections of their own.
fn has_sections(item: &Item) -> bool {
    item.as_table().is_some_and(|table| !table.is_dotted())
}

/// Sets or adds the value at a flat path, and removes settings that it excludes.
pub(super) fn set(part: &mut Item, path: &[String], value: &Value) {
    list_command(part, path);
    if senders::set(part, path, value) {
        return;
    }
    let comments = counterpart(path).map_or(String::new(), |other| remove(part, &other));
    let (keys, scope) = locate(part, path);
    let root = has_sections(part);
    put(part, &keys, &in_scope(path, value, &scope), comments, root);
}

/// Makes a list of an actuator's single command, before another one is added.
fn list_command(part: &mut Item, path: &[String]) {
    let [section, name, list, _, ..] = path else { return };
    if section != "actuators" || list != "commands" {
        return;
    }
    let single = [section.clone(), name.clone(), "command".to_owned()];
    let (mut keys, _) = locate(part, &single);
    let Some(text) = item_at(part, &keys).and_then(|item| item.as_str().map(str::to_owned)) else {
        return;
    };
    let comments = remove(part, &single);
    if let Some(last) = keys.last_mut() {
        list.clone_into(last);
    }
    let nowhere = Span { source: 0, start: 0, end: 0 };
    let root = has_sections(part);
    put(part, &keys, &Value::List(vec![Spanned::new(Value::Text(text), nowhere)]), comments, root);
}

/// Sets the value below an item that is a table.
/// Comments that have lost their place go before the line of the value.
fn put(parent: &mut Item, keys: &[String], value: &Value, mut lost: String, root: bool) {
    let [key, rest @ ..] = keys else { return };
    lost +=
        &if rest.is_empty() { leaf(parent, key, value) } else { make_table(parent, key, rest.len(), root) };
    let Some(lost) = comment(parent, key, lost) else { return };
    if let Some(child) = parent.as_table_like_mut().and_then(|table| table.get_mut(key)) {
        put(child, rest, value, lost, false);
    }
}

/// Puts comments before the line of a key; returns them if it has none.
fn comment(parent: &mut Item, key: &str, comments: String) -> Option<String> {
    let Item::Table(table) = parent else { return Some(comments) };
    if comments.is_empty() {
        return Some(comments);
    }
    let prepend = |decor: &mut Decor| {
        let prefix = decor.prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
        decor.set_prefix(format!("{comments}{prefix}"));
    };
    match table.get_mut(key) {
        Some(Item::ArrayOfTables(tables)) => prepend(tables.get_mut(0)?.decor_mut()),
        Some(Item::Value(_)) => prepend(table.key_mut(key)?.leaf_decor_mut()),
        _ => return Some(comments),
    }
    Some(String::new())
}

/// Sets the value of a key, and returns the comments that have lost their place.
fn leaf(parent: &mut Item, key: &str, value: &Value) -> String {
    let Some(table) = parent.as_table_like_mut() else { return String::new() };
    let Some(item) = table.get_mut(key) else {
        insert(parent, key, Item::Value(value.into()));
        return String::new();
    };
    // An empty table adds nothing to one that is there.
    if item.is_table_like() && value.as_table().is_some() {
        return String::new();
    }
    let was_line = item.is_value();
    let lost = overwrite(item, value);
    if item.is_value()
        && !was_line
        && let Some(mut key) = table.key_mut(key)
    {
        key.fmt();
    }
    lost
}

/// Makes a table if it is missing, above `depth` more keys.
/// Returns the comments that have lost their place.
fn make_table(parent: &mut Item, key: &str, depth: usize, root: bool) -> String {
    let table = match parent {
        Item::Table(parent) => {
            let mut table = Table::new();
            // A section of its own, unless that would take a line out of the section that it stands in.
            if root || (parent.is_implicit() && !parent.is_dotted()) {
                table.set_implicit(depth > 1);
            } else {
                table.set_dotted(true);
            }
            Item::Table(table)
        }
        _ => Item::Value(InlineTable::new().into()),
    };
    match parent.as_table_like_mut().and_then(|table| table.get_mut(key)) {
        Some(item) if item.is_table_like() => {}
        Some(Item::Value(value)) => return overwrite_value(value, &Value::Table(Default::default())),
        Some(item) => return comments::of_item(&std::mem::replace(item, table)),
        None => insert(parent, key, table),
    }
    String::new()
}

fn insert(parent: &mut Item, key: &str, item: Item) {
    match parent {
        Item::Table(table) => drop(table.insert(key, item)),
        Item::Value(toml_edit::Value::InlineTable(table)) => {
            let Ok(value) = item.into_value() else { return };
            insert_inline(table, key, value);
        }
        _ => {}
    }
}

/// Empties the table at a flat path, and writes it as an empty one.
/// Without entries it would not appear in the text.
pub(super) fn empty(part: &mut Item, path: &[String]) {
    let (keys, _) = locate(part, path);
    let comments = remove(part, path);
    let root = has_sections(part);
    put(part, &keys, &Value::Table(Default::default()), comments, root);
}

/// Removes the value at a flat path.
/// Its comments go to a line beside it, or before the line that contained it.
pub(super) fn take_out(part: &mut Item, path: &[String]) {
    let (keys, _) = locate(part, path);
    let mut lost = remove(part, path);
    for depth in (1..keys.len()).rev() {
        let mut parent = Some(&mut *part);
        for key in &keys[..depth - 1] {
            parent = parent.and_then(|item| item.as_table_like_mut()?.get_mut(key));
        }
        let Some(parent) = parent else { continue };
        let key = &keys[depth - 1];
        let beside = parent.as_table_like_mut().and_then(|table| table.get_mut(key));
        let left = beside.map_or(Some(lost.clone()), |table| comment_first(table, lost.clone()));
        let Some(left) = left.and_then(|left| comment(parent, key, left)) else { return };
        lost = left;
    }
}

/// Puts comments before the first line of a table.
/// Returns them if it has none.
fn comment_first(item: &mut Item, mut comments: String) -> Option<String> {
    let Item::Table(table) = item else { return Some(comments) };
    let keys: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
    for key in keys {
        comments = comment(item, &key, comments)?;
        comments = comment_first(item.as_table_like_mut()?.get_mut(&key)?, comments)?;
    }
    Some(comments)
}

/// Removes the value at a flat path, and returns its comments.
fn remove(part: &mut Item, path: &[String]) -> String {
    if let Some(comments) = senders::remove(part, path) {
        return comments;
    }
    let (keys, _) = locate(part, path);
    let Some((last, parents)) = keys.split_last() else { return String::new() };
    let mut item = Some(part);
    for key in parents {
        item = item.and_then(|item| item.as_table_like_mut()?.get_mut(key));
    }
    let removed = match item {
        Some(Item::Table(table)) => table.remove_entry(last),
        Some(Item::Value(toml_edit::Value::InlineTable(table))) => {
            let removed = table.remove_entry(last);
            // The blank before the brace stays there.
            let blank = removed.as_ref().and_then(|(_, value)| value.decor().suffix()?.as_str());
            if let (Some(blank), Some((_, end))) =
                (blank.filter(|blank| !blank.is_empty()), table.iter_mut().last())
            {
                end.decor_mut().set_suffix(blank);
            }
            removed.map(|(key, value)| (key, Item::Value(value)))
        }
        _ => None,
    };
    removed.map_or(String::new(), |(key, item)| comments::of_entry(&key, item))
}
