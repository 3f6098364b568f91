//! Changes of a document that leave everything else as it was written.

use toml_edit::{Decor, DocumentMut, InlineTable, Item, Table};

use super::super::exclusive::counterpart;
use super::super::scope::{SECTIONS, flat_name, in_scope};
use super::super::source::{Span, Spanned};
use super::super::value::Value;
use super::comments;
use super::overwrite::{overwrite, overwrite_value};
use super::senders;

/// The table of a document in which settings are: all of it, or that of an agent, which is added if there is none.
pub(super) fn part<'a>(document: &'a mut DocumentMut, agent: Option<&str>) -> &'a mut Item {
    let mut item = document.as_item_mut();
    for (key, depth) in agent.into_iter().flat_map(|agent| [("agents", 3), (agent, 2)]) {
        let root = has_sections(item);
        make_table(item, key, depth, root);
        item = &mut item[key];
    }
    item
}

/// Whether what is in a table may have a section of its own.
fn has_sections(item: &Item) -> bool {
    item.as_table().is_some_and(|table| !table.is_dotted())
}

/// Sets what stands at a flat path, or else adds it; what it excludes is taken out.
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

/// Makes the single command of an actuator a list before another one is added.
fn list_command(part: &mut Item, path: &[String]) {
    let [section, name, list, _, ..] = path else { return };
    if section != "actuators" || list != "commands" {
        return;
    }
    let single = [section.clone(), name.clone(), "command".to_owned()];
    let (mut keys, _) = locate(part, &single);
    let Some(text) = senders::item_at(part, &keys).and_then(|item| item.as_str().map(str::to_owned)) else {
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

/// The keys that a flat path has in this part, and the robot in whose scope that is.
pub(super) fn locate(part: &Item, path: &[String]) -> (Vec<String>, String) {
    let as_it_is = (path.to_vec(), String::new());
    let Some(root) = part.as_table_like() else { return as_it_is };
    let [section, name, rest @ ..] = path else { return as_it_is };
    if !SECTIONS.contains(&section.as_str()) {
        return as_it_is;
    }
    let place = |scope: &str, key: &str| {
        let mut keys = section_of(scope, section);
        keys.push(key.into());
        keys.extend_from_slice(rest);
        let depth = match (section.as_str(), rest) {
            ("links", [_, ..]) => Some(1),
            ("actuators", [list, _, ..]) if list == "commands" => Some(2),
            _ => None,
        };
        if let Some(at) = depth.map(|depth| section_of(scope, section).len() + depth) {
            keys[at] = senders::written(root, &keys[..=at], scope);
        }
        (keys, scope.to_owned())
    };
    let robots = root.get("robots").and_then(Item::as_table_like);
    let robots: Vec<&str> =
        robots.into_iter().flat_map(|robots| robots.iter()).map(|(name, _)| name).collect();
    for scope in [""].iter().chain(&robots) {
        let mut section_keys = section_of(scope, section).into_iter();
        let first = section_keys.next().and_then(|key| root.get(&key));
        let found = section_keys.try_fold(first, |item, key| Some(item?.as_table_like()?.get(&key)));
        let Some(table) = found.flatten().and_then(Item::as_table_like) else { continue };
        if let Some((key, _)) = table.iter().find(|(key, _)| flat_name(section, key, scope) == *name) {
            return place(scope, key);
        }
    }
    match name.split_once('/') {
        // A link's name must have a module before the port even then.
        Some((robot, own)) if robots.contains(&robot) && (section != "links" || own.contains('/')) => {
            place(robot, own)
        }
        _ => as_it_is,
    }
}

fn section_of(scope: &str, section: &str) -> Vec<String> {
    let keys = if scope.is_empty() { vec![section] } else { vec!["robots", scope, section] };
    keys.into_iter().map(String::from).collect()
}

/// Sets the value below an item that is a table; comments that have lost their place go before the line of the value.
fn put(parent: &mut Item, keys: &[String], value: &Value, mut lost: String, root: bool) {
    let [key, rest @ ..] = keys else { return };
    lost +=
        &if rest.is_empty() { leaf(parent, key, value) } else { make_table(parent, key, rest.len(), root) };
    let Some(lost) = comment(parent, key, lost) else { return };
    if let Some(child) = parent.as_table_like_mut().and_then(|table| table.get_mut(key)) {
        put(child, rest, value, lost, false);
    }
}

/// Puts comments before the line of a key, if it has one; else they are returned.
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

/// Makes sure that there is a table, above `depth` more keys; returns the comments that have lost their place.
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

/// Adds to an inline table; the blank before its brace stays there.
pub(super) fn insert_inline(table: &mut InlineTable, key: &str, mut value: toml_edit::Value) {
    if let Some((_, last)) = table.iter_mut().last()
        && let Some(suffix) = last.decor().suffix().and_then(|suffix| suffix.as_str()).map(str::to_owned)
    {
        last.decor_mut().set_suffix("");
        *value.decor_mut() = Decor::new(" ", suffix);
    }
    table.insert(key, value);
}

/// Takes out all that stands in the table at a flat path, which is then written as an empty one: it could show only by
/// what was in it.
pub(super) fn empty(part: &mut Item, path: &[String]) {
    let (keys, _) = locate(part, path);
    let comments = remove(part, path);
    let root = has_sections(part);
    put(part, &keys, &Value::Table(Default::default()), comments, root);
}

/// Takes out what stands at a flat path; its comments go to a line beside it, or before the line that it stood in.
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

/// Puts comments before the first line of a table, if it has one; else they are returned.
fn comment_first(item: &mut Item, mut comments: String) -> Option<String> {
    let Item::Table(table) = item else { return Some(comments) };
    let keys: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
    for key in keys {
        comments = comment(item, &key, comments)?;
        comments = comment_first(item.as_table_like_mut()?.get_mut(&key)?, comments)?;
    }
    Some(comments)
}

/// Takes out what stands at a flat path, and returns its comments.
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
