//! New values where old ones stand, which change no more of the text than they must.

use toml_edit::{Array, Item, RawString};

use super::super::compare::same;
use super::super::problems::Problems;
use super::super::source::Span;
use super::super::value::Value;
use super::edit::insert_inline;

/// Makes an item what a value says, and returns the comments that have lost their place.
pub(super) fn overwrite(item: &mut Item, value: &Value) -> String {
    match (&mut *item, value) {
        (Item::Value(old), new) => overwrite_value(old, new),
        (Item::Table(old), Value::Table(new)) => {
            old.retain(|key, _| new.get(key).is_some());
            for (key, entry) in new.iter() {
                match old.get_mut(key) {
                    Some(item) => drop(overwrite(item, &entry.value)),
                    None => drop(old.insert(key, Item::Value((&entry.value.value).into()))),
                }
            }
        }
        (Item::ArrayOfTables(old), Value::List(new))
            if !new.is_empty() && new.iter().all(|item| item.as_table().is_some()) =>
        {
            while old.len() > new.len() {
                old.remove(old.len() - 1);
            }
            for (i, new) in new.iter().enumerate() {
                if i == old.len() {
                    old.push(toml_edit::Table::new());
                }
                let Some(table) = old.get_mut(i) else { continue };
                let mut item = Item::Table(std::mem::take(table));
                overwrite(&mut item, new);
                *table = item.into_table().unwrap_or_default();
            }
        }
        (_, new) => {
            let comments = comments_in(item);
            *item = Item::Value(new.into());
            return comments;
        }
    }
    String::new()
}

/// Makes a value of a document another one; what is the same already stays as it is written.
pub(super) fn overwrite_value(old: &mut toml_edit::Value, new: &Value) {
    let nowhere = Span { source: 0, start: 0, end: 0 };
    let present = Value::of_toml(old, nowhere, &mut Problems::default());
    match (&mut *old, new) {
        _ if present.is_some_and(|present| same(&present, new)) => {}
        (toml_edit::Value::Array(old), Value::List(new)) => {
            for (i, new) in new.iter().enumerate() {
                match old.get_mut(i) {
                    Some(old) => overwrite_value(old, new),
                    None => push(old, (&new.value).into()),
                }
            }
            while old.len() > new.len() {
                let removed = old.remove(old.len() - 1);
                keep_comments(old, &removed);
            }
        }
        (toml_edit::Value::InlineTable(old), Value::Table(new)) => {
            old.retain(|key, _| new.get(key).is_some());
            for (key, entry) in new.iter() {
                match old.get_mut(key) {
                    Some(old) => overwrite_value(old, &entry.value),
                    None => insert_inline(old, key, (&entry.value.value).into()),
                }
            }
        }
        (old, new) => {
            let decor = old.decor().clone();
            *old = new.into();
            *old.decor_mut() = decor;
        }
    }
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

/// The comments around an element stay when it goes.
fn keep_comments(array: &mut Array, removed: &toml_edit::Value) {
    let text = |raw: Option<&RawString>| raw.and_then(RawString::as_str).unwrap_or_default().to_owned();
    let around = text(removed.decor().prefix()) + &text(removed.decor().suffix());
    if around.contains('#') {
        array.set_trailing(around + array.trailing().as_str().unwrap_or_default());
    }
}

/// The comments that stand with an item and in it, a line each.
pub(super) fn comments_in(item: &Item) -> String {
    match item {
        Item::None => String::new(),
        Item::Value(value) => comments(value.decor().suffix()),
        Item::Table(table) => comments(table.decor().prefix()) + &comment_lines(&table.to_string()),
        Item::ArrayOfTables(tables) => {
            tables.iter().map(|table| comments_in(&Item::Table(table.clone()))).collect()
        }
    }
}

/// The comments before or after something, a line each.
pub(super) fn comments(decor: Option<&RawString>) -> String {
    comment_lines(decor.and_then(RawString::as_str).unwrap_or_default())
}

fn comment_lines(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| line.starts_with('#')).map(|line| format!("{line}\n")).collect()
}
