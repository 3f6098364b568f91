//! Lists of senders of an inbox, and of commands of an actuator.
//! They are tables once they are read.
//!
//! `"execute/reflexes" = ["a/reflex", "b/reflex"]` becomes `{ "/r2/a/reflex" = true, "/r2/b/reflex" = true }`, so that
//! lists of several layers unite and `false` removes one of them.

use super::external::ExternalUrl;
use super::problems::Problems;
use super::source::{Span, Spanned};
use super::value::{Table, TableEntry, Value};

/// Key for all senders that no layer names.
/// `false` in a list of senders is `{ "*" = false }` in the table.
pub(super) const UNNAMED: &str = "*";

/// Returns true if a table lists senders, not the options of one source.
pub(super) fn is_of_senders(table: &Table) -> bool {
    table.iter().any(|(name, _)| is_sender(name))
}

/// Returns true if a key in the table of a link names a sender.
pub(super) fn is_sender(key: &str) -> bool {
    key.contains('/') || key == UNNAMED || ExternalUrl::parse(key).is_some()
}

/// Makes the sources of a link absolute, and a list of them a table.
pub(super) fn make_table(
    link: &mut Spanned<Value>,
    resolve: &dyn Fn(&str) -> Option<String>,
    problems: &mut Problems,
) {
    let absolute = |text: String| resolve(&text).unwrap_or(text);
    match &mut link.value {
        Value::Text(text) => *text = absolute(std::mem::take(text)),
        Value::List(items) if !items.is_empty() => {
            let mut senders = Table::default();
            for item in std::mem::take(items) {
                if let Some((name, value)) = sender(item.clone(), problems) {
                    senders.entries.insert(absolute(name), TableEntry { key: item.span, value });
                }
            }
            link.value = Value::Table(senders);
        }
        Value::Table(table) if is_of_senders(table) => {
            let senders = std::mem::take(&mut table.entries).into_iter();
            table.entries = senders.map(|(name, entry)| (absolute(name), entry)).collect();
        }
        Value::Table(table) => match table.entries.remove("from") {
            // Options of a list are those of each sender.
            Some(TableEntry { value: Spanned { value: Value::List(items), .. }, .. }) => {
                let options = Value::Table(std::mem::take(table));
                let named = items.into_iter().filter_map(|item| {
                    sender(item, problems).map(|(name, value)| {
                        let span = value.span;
                        let said = if name == UNNAMED { value.value } else { options.clone() };
                        (absolute(name), TableEntry { key: span, value: Spanned::new(said, span) })
                    })
                });
                table.entries = named.collect();
            }
            Some(mut entry) => {
                if let Value::Text(text) = &mut entry.value.value {
                    *text = absolute(std::mem::take(text));
                }
                table.entries.insert("from".into(), entry);
            }
            None => {}
        },
        _ => {}
    }
}

/// Makes the commands of an actuator absolute, and a list of them a table.
pub(super) fn make_commands(
    actuator: &mut Spanned<Value>,
    resolve: &dyn Fn(&str) -> Option<String>,
    problems: &mut Problems,
) {
    let absolute = |text: String| resolve(&text).unwrap_or(text);
    let Value::Table(actuator) = &mut actuator.value else { return };
    if let Some(Value::Text(text)) = actuator.entries.get_mut("command").map(|entry| &mut entry.value.value) {
        *text = absolute(std::mem::take(text));
    }
    let Some(entry) = actuator.entries.get_mut("commands") else { return };
    let span = entry.value.span;
    match &mut entry.value.value {
        Value::Table(table) => {
            let commands = std::mem::take(&mut table.entries).into_iter();
            table.entries = commands.map(|(name, entry)| (absolute(name), entry)).collect();
        }
        Value::List(list) if list.is_empty() => drop(actuator.entries.remove("commands")),
        Value::List(_) | Value::Text(_) => {
            let names = problems.texts("commands", &entry.value, "module/property").into_iter();
            let named = |name: Spanned<String>| {
                let value = Spanned::new(Value::Bool(true), name.span);
                (absolute(name.value), TableEntry { key: name.span, value })
            };
            entry.value = Spanned::new(Value::Table(Table { entries: names.map(named).collect() }), span);
        }
        // The reader of the section reports another type.
        _ => {}
    }
}

/// Returns a sender of a list with its options.
/// The item is a text, or a table as that of a link; `false` stands for senders without a name.
fn sender(item: Spanned<Value>, problems: &mut Problems) -> Option<(String, Spanned<Value>)> {
    let span = item.span;
    match item.value {
        Value::Text(name) => Some((name, Spanned::new(Value::Bool(true), span))),
        Value::Bool(false) => Some((UNNAMED.into(), Spanned::new(Value::Bool(false), span))),
        Value::Table(mut table) => {
            let Some(from) = table.entries.remove("from") else {
                problems.add(
                    span,
                    "a sender of this list has no `from`",
                    "write { from = \"module/outbox\" }",
                );
                return None;
            };
            let name = problems.as_text("from", &from.value, "module/outbox")?;
            Some((name.value, Spanned::new(Value::Table(table), span)))
        }
        other => {
            let other = Spanned::new(other, span);
            problems.wrong_type("a link", &other, "a list of texts", "write [\"module/outbox\", ...]");
            None
        }
    }
}

/// Merges another layer.
/// Tables are united, also the senders of inboxes and the commands of actuators; other values are replaced.
pub(super) fn merge_layer(merged: &mut Table, mut layer: Table) {
    merge_commands(merged, &layer);
    let links = layer.entries.remove("links");
    merged.merge(layer);
    let Some(links) = links else { return };
    let (Some(Value::Table(old)), Value::Table(_)) =
        (merged.entries.get_mut("links").map(|entry| &mut entry.value.value), &links.value.value)
    else {
        merged.entries.insert("links".into(), links);
        return;
    };
    let Value::Table(new) = links.value.value else { return };
    for (name, entry) in new.entries {
        match old.entries.get_mut(&name) {
            Some(link) => merge_link(link, entry),
            None => drop(old.entries.insert(name, entry)),
        }
    }
}

fn merge_link(old: &mut TableEntry, new: TableEntry) {
    let unites = match &new.value.value {
        Value::List(list) => list.is_empty(),
        Value::Table(table) => is_of_senders(table),
        _ => false,
    };
    if !unites {
        match (&mut old.value.value, new.value.value) {
            // Options of a link, beside its source.
            (Value::Table(before), Value::Table(table)) if !is_of_senders(before) => before.merge(table),
            (_, value) => *old = TableEntry { key: new.key, value: Spanned::new(value, new.value.span) },
        }
        return;
    }
    let Value::Table(added) = new.value.value else { return };
    as_senders(old);
    match &mut old.value.value {
        Value::Table(senders) => senders.merge(added),
        other => *other = Value::Table(added),
    }
    old.key = new.key;
}

/// Prepares actuators for the commands of a later layer.
/// A list adds to a single command, and a single command replaces a list.
fn merge_commands(merged: &mut Table, layer: &Table) {
    let Some(Value::Table(actuators)) =
        merged.entries.get_mut("actuators").map(|entry| &mut entry.value.value)
    else {
        return;
    };
    let later = layer.get("actuators").and_then(|actuators| actuators.as_table());
    for (name, entry) in later.into_iter().flat_map(Table::iter) {
        let (Some(new), Some(Value::Table(old))) =
            (entry.value.as_table(), actuators.entries.get_mut(name).map(|entry| &mut entry.value.value))
        else {
            continue;
        };
        if new.get("command").is_some() {
            old.entries.remove("commands");
        } else if new.get("commands").is_some_and(|commands| commands.as_table().is_some())
            && let Some(command) = old.get("command").and_then(|command| command.as_str()).map(str::to_owned)
            && let Some(TableEntry { key, value: Spanned { span, .. } }) = old.entries.remove("command")
        {
            let only = TableEntry { key: span, value: Spanned::new(Value::Bool(true), span) };
            let commands = Value::Table(Table { entries: [(command, only)].into() });
            old.entries.insert("commands".into(), TableEntry { key, value: Spanned::new(commands, span) });
        }
    }
}

/// Converts a link with one source into a table of one sender.
fn as_senders(link: &mut TableEntry) {
    let span: Span = link.value.span;
    let (name, value) = match &mut link.value.value {
        Value::Text(name) => (std::mem::take(name), Value::Bool(true)),
        Value::Table(table) if !is_of_senders(table) => match table.entries.remove("from") {
            Some(TableEntry { value: Spanned { value: Value::Text(name), .. }, .. }) => {
                (name, Value::Table(std::mem::take(table)))
            }
            _ => return,
        },
        _ => return,
    };
    let entry = TableEntry { key: span, value: Spanned::new(value, span) };
    link.value.value = Value::Table(Table { entries: [(name, entry)].into() });
}
