//! Replacement of values in a document, with a minimal change of its text.
//!
//! All of these return the comments that have lost their place, a line each.

use toml_edit::{Array, Decor, InlineTable, Item, Table};

use super::super::compare::same;
use super::super::problems::Problems;
use super::super::source::Span;
use super::super::value::{self, Value};
use super::comments;

/// Replaces an item by a value.
pub(super) fn overwrite(item: &mut Item, value: &Value) -> String {
    match (&mut *item, value) {
        (Item::Value(old), new) => overwrite_value(old, new),
        (Item::Table(old), Value::Table(new)) => overwrite_table(old, new),
        (Item::ArrayOfTables(old), Value::List(new))
            if !new.is_empty() && new.iter().all(|item| item.as_table().is_some()) =>
        {
            let mut lost = String::new();
            for removed in (new.len()..old.len()).rev() {
                lost = comments::of_item(&Item::Table(old.remove(removed))) + &lost;
            }
            for (i, new) in new.iter().enumerate() {
                if i == old.len() {
                    old.push(Table::new());
                }
                if let (Some(table), Some(new)) = (old.get_mut(i), new.as_table()) {
                    lost += &overwrite_table(table, new);
                }
            }
            lost
        }
        (_, new) => comments::of_item(&std::mem::replace(item, Item::Value(new.into()))),
    }
}

fn overwrite_table(old: &mut Table, new: &value::Table) -> String {
    let mut lost = String::new();
    let gone: Vec<String> =
        old.iter().map(|(key, _)| key.to_owned()).filter(|key| new.get(key).is_none()).collect();
    for key in gone {
        lost += &old.remove_entry(&key).map_or(String::new(), |(key, item)| comments::of_entry(&key, item));
    }
    for (key, entry) in new.iter() {
        match old.get_mut(key) {
            Some(item) => lost += &overwrite(item, &entry.value),
            None => drop(old.insert(key, Item::Value((&entry.value.value).into()))),
        }
    }
    lost
}

/// Replaces a value of a document; equal parts keep their text.
pub(super) fn overwrite_value(old: &mut toml_edit::Value, new: &Value) -> String {
    let nowhere = Span { source: 0, start: 0, end: 0 };
    let present = Value::of_toml(old, nowhere, &mut Problems::default());
    let mut lost = String::new();
    match (&mut *old, new) {
        _ if present.is_some_and(|present| same(&present, new)) => {}
        (toml_edit::Value::Array(old), Value::List(new)) => {
            for (i, new) in new.iter().enumerate() {
                match old.get_mut(i) {
                    Some(old) => lost += &overwrite_value(old, new),
                    None => push(old, (&new.value).into()),
                }
            }
            shorten(old, new.len());
        }
        (toml_edit::Value::InlineTable(old), Value::Table(new)) => {
            let gone: Vec<String> =
                old.iter().map(|(key, _)| key.to_owned()).filter(|key| new.get(key).is_none()).collect();
            for key in gone {
                let removed = old.remove_entry(&key);
                lost += &removed
                    .map_or(String::new(), |(key, value)| comments::of_entry(&key, Item::Value(value)));
            }
            for (key, entry) in new.iter() {
                match old.get_mut(key) {
                    Some(old) => lost += &overwrite_value(old, &entry.value),
                    None => insert_inline(old, key, (&entry.value.value).into()),
                }
            }
        }
        (old, new) => {
            lost = comments::of_value(old);
            let decor = old.decor().clone();
            *old = new.into();
            *old.decor_mut() = decor;
        }
    }
    lost
}

/// Adds an element, on a line of its own if the last one has one.
fn push(array: &mut Array, mut value: toml_edit::Value) {
    let last = array.len().checked_sub(1).and_then(|last| array.get(last));
    let prefix = last.and_then(|last| last.decor().prefix()?.as_str());
    match prefix.and_then(|prefix| prefix.rfind('\n').map(|line| prefix[line..].to_owned())) {
        Some(indent) => {
            value.decor_mut().set_prefix(indent);
            array.push_formatted(value);
        }
        None => array.push(value),
    }
}

/// Removes elements at the end of an array; their comments stay in the list.
fn shorten(array: &mut Array, length: usize) {
    let mut kept = String::new();
    while array.len() > length {
        kept = comments::of_text(&array.remove(array.len() - 1).to_string()) + &kept;
    }
    if !kept.is_empty() {
        let trailing = array.trailing().as_str().unwrap_or_default();
        let trailing = format!("\n{kept}{}", trailing.strip_prefix('\n').unwrap_or(trailing));
        array.set_trailing(trailing);
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
