//! Differences between two tables of values.

use slate_sorted::SortedSet;

use super::source::Spanned;
use super::value::{Table, Value};

/// Path with the values of two tables there.
/// At least one of them is not a table, or an empty one.
pub(super) type ValuePair<'a> = (Vec<String>, Option<&'a Spanned<Value>>, Option<&'a Spanned<Value>>);

/// Calls `found` with each leaf below a table, in the order of the paths.
/// Leaves are values that are no tables, and empty tables.
pub(super) fn leaves<'a>(
    table: &'a Table,
    path: &[String],
    found: &mut impl FnMut(Vec<String>, &'a Spanned<Value>),
) {
    for (name, entry) in table.iter() {
        let path = below(path, name);
        match entry.value.as_table() {
            Some(table) if !table.is_empty() => leaves(table, &path, found),
            _ => found(path, &entry.value),
        }
    }
}

/// Returns the differences between two tables, in the order of the paths.
pub(super) fn differences<'a>(old: &'a Table, new: &'a Table) -> Vec<ValuePair<'a>> {
    let mut found = Vec::new();
    tables(Some(old), Some(new), &[], &mut found);
    found
}

fn tables<'a>(
    old: Option<&'a Table>,
    new: Option<&'a Table>,
    path: &[String],
    found: &mut Vec<ValuePair<'a>>,
) {
    let names: SortedSet<&str> =
        [old, new].into_iter().flatten().flat_map(Table::iter).map(|(name, _)| name).collect();
    for name in names {
        let get = |table: Option<&'a Table>| table.and_then(|table| table.get(name));
        values(get(old), get(new), below(path, name), found);
    }
}

fn values<'a>(
    old: Option<&'a Spanned<Value>>,
    new: Option<&'a Spanned<Value>>,
    path: Vec<String>,
    found: &mut Vec<ValuePair<'a>>,
) {
    let table = |value: Option<&'a Spanned<Value>>| value.and_then(|value| value.as_table());
    let (old_table, new_table) = (table(old), table(new));
    // A table shows by what is in it; only an empty one is a value itself, unless the other one fills it.
    let itself = |value: Option<&'a Spanned<Value>>, other: Option<&'a Table>| {
        let empty = |table: &Table| table.is_empty() && other.is_none_or(Table::is_empty);
        value.filter(|value| value.as_table().is_none_or(empty))
    };
    let (old_itself, new_itself) = (itself(old, new_table), itself(new, old_table));
    let differ = match (old_itself, new_itself) {
        (Some(old), Some(new)) => !same(old, new),
        (None, None) => false,
        _ => true,
    };
    if differ {
        found.push((path.clone(), old_itself, new_itself));
    }
    tables(old_table, new_table, &path, found);
}

/// Returns true if two values are equal, wherever they are written.
pub(super) fn same(old: &Value, new: &Value) -> bool {
    match (old, new) {
        (Value::Float(old), Value::Float(new)) => old.to_bits() == new.to_bits(),
        (Value::List(old), Value::List(new)) => {
            old.len() == new.len() && old.iter().zip(new).all(|(old, new)| same(old, new))
        }
        (Value::Table(old), Value::Table(new)) => {
            old.entries.len() == new.entries.len()
                && old
                    .iter()
                    .zip(new.iter())
                    .all(|(old, new)| old.0 == new.0 && same(&old.1.value, &new.1.value))
        }
        (old, new) => old == new,
    }
}

fn below(path: &[String], name: &str) -> Vec<String> {
    path.iter().cloned().chain([name.to_owned()]).collect()
}
