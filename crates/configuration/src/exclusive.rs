//! Settings that exclude each other.

use std::cmp::Ordering;

use super::problems::Problems;
use super::source::Sources;
use super::value::{Table, TableEntry, Value};
use crate::error_code::ErrorCode;

/// Returns the path of the setting that this one replaces, if that exists.
/// For `every` it is `on`, for a link the value of the input.
pub(super) fn counterpart(path: &[String]) -> Option<Vec<String>> {
    let path: Vec<&str> = path.iter().map(String::as_str).collect();
    let other = match path[..] {
        ["modules", module, "every"] => vec!["modules", module, "on"],
        ["modules", module, "on"] => vec!["modules", module, "every"],
        ["actuators", actuator, "command"] => vec!["actuators", actuator, "commands"],
        ["actuators", actuator, "commands"] => vec!["actuators", actuator, "command"],
        ["modules", module, "inputs", port, ..] => {
            return Some(vec!["links".into(), format!("{module}/{port}")]);
        }
        ["links", input, ..] => {
            let (module, port) = input.rsplit_once('/')?;
            vec!["modules", module, "inputs", port]
        }
        _ => return None,
    };
    Some(other.into_iter().map(String::from).collect())
}

/// Keeps the settings of the later layer among those that exclude each other.
pub(super) fn settle(merged: &mut Table, sources: &Sources) {
    let mut lost = Vec::new();
    let mut candidates = |section: &str, found: &dyn Fn(&str, &Table) -> Vec<Vec<String>>| {
        let Some(section) = merged.get(section).and_then(|value| value.as_table()) else { return };
        for path in section.iter().flat_map(|(name, entry)| match &entry.value.value {
            Value::Table(table) => found(name, table),
            _ => Vec::new(),
        }) {
            let Some(other) = counterpart(&path) else { continue };
            let rank = |path: &[String]| Some(sources.rank(merged.entry(path)?.key));
            match (rank(&path), rank(&other)) {
                (Some(one), Some(two)) if one < two => lost.push(path),
                (Some(one), Some(two)) if one > two => lost.push(other),
                _ => {}
            }
        }
    };
    let path = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
    candidates("modules", &|name, module| {
        let inputs = module.get("inputs").and_then(|inputs| inputs.as_table());
        let ports = inputs.into_iter().flat_map(Table::iter);
        let inputs = ports.map(|(port, _)| path(&["modules", name, "inputs", port]));
        inputs.chain([path(&["modules", name, "every"])]).collect()
    });
    for path in lost {
        merged.remove(&path);
    }
    // No inputs are the same as no table of them.
    let Some(Value::Table(modules)) = merged.entries.get_mut("modules").map(|entry| &mut entry.value.value)
    else {
        return;
    };
    for entry in modules.entries.values_mut() {
        if let Value::Table(module) = &mut entry.value.value
            && module.get("inputs").and_then(|inputs| inputs.as_table()).is_some_and(Table::is_empty)
        {
            module.entries.remove("inputs");
        }
    }
}

/// Returns that of two exclusive keys which the later layer sets.
/// One layer can't set both.
pub(super) fn one_of<'k, 't>(
    sources: &Sources,
    problems: &mut Problems,
    table: &'t Table,
    a: &'k str,
    b: &'k str,
) -> Option<(&'k str, &'t TableEntry)> {
    match (table.entries.get(a), table.entries.get(b)) {
        (Some(first), Some(second)) => match sources.rank(first.key).cmp(&sources.rank(second.key)) {
            Ordering::Less => Some((b, second)),
            Ordering::Greater => Some((a, first)),
            Ordering::Equal => {
                problems.add(
                    second.key,
                    ErrorCode::Key.of(format!("`{a}` and `{b}` exclude each other")),
                    "keep one of the two",
                );
                None
            }
        },
        (Some(entry), None) => Some((a, entry)),
        (None, Some(entry)) => Some((b, entry)),
        (None, None) => None,
    }
}
