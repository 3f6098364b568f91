//! Lists of senders: what a link of an inbox names, a table of its senders once it is read.
//!
//! `"execute/reflexes" = ["a/reflex", "b/reflex"]` becomes `{ "/r2/a/reflex" = true, "/r2/b/reflex" = true }`, so that
//! lists of several layers unite and `false` removes one of them.

use super::problems::Problems;
use super::source::{Span, Spanned};
use super::value::{Entry, Table, Value};

/// Whether a table is one of senders, and not of what a link says of its one source.
pub(super) fn is_of_senders(table: &Table) -> bool {
    table.iter().any(|(name, _)| name.contains('/'))
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
                    senders.entries.insert(absolute(name), Entry { key: item.span, value });
                }
            }
            link.value = Value::Table(senders);
        }
        Value::Table(table) if is_of_senders(table) => {
            let senders = std::mem::take(&mut table.entries).into_iter();
            table.entries = senders.map(|(name, entry)| (absolute(name), entry)).collect();
        }
        Value::Table(table) => match table.entries.remove("from") {
            // What is said of a list is said of each.
            Some(Entry { value: Spanned { value: Value::List(items), .. }, .. }) => {
                let options = Value::Table(std::mem::take(table));
                let named = items.into_iter().filter_map(|item| {
                    sender(item, problems).map(|(name, value)| {
                        let span = value.span;
                        (absolute(name), Entry { key: span, value: Spanned::new(options.clone(), span) })
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

/// A sender of a list, and what is said of it: a text, or a table as that of a link.
fn sender(item: Spanned<Value>, problems: &mut Problems) -> Option<(String, Spanned<Value>)> {
    let span = item.span;
    match item.value {
        Value::Text(name) => Some((name, Spanned::new(Value::Bool(true), span))),
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

/// Takes over what another layer says: tables are united, the senders of inboxes too, and all else is replaced.
pub(super) fn merge_layer(merged: &mut Table, mut layer: Table) {
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

fn merge_link(old: &mut Entry, new: Entry) {
    let unites = match &new.value.value {
        Value::List(list) => list.is_empty(),
        Value::Table(table) => is_of_senders(table),
        _ => false,
    };
    if !unites {
        match (&mut old.value.value, new.value.value) {
            // What else is said of a link, beside its source.
            (Value::Table(before), Value::Table(table)) if !is_of_senders(before) => before.merge(table),
            (_, value) => *old = Entry { key: new.key, value: Spanned::new(value, new.value.span) },
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

/// A link with one source as a table of one sender.
fn as_senders(link: &mut Entry) {
    let span: Span = link.value.span;
    let (name, value) = match &mut link.value.value {
        Value::Text(name) => (std::mem::take(name), Value::Bool(true)),
        Value::Table(table) if !is_of_senders(table) => match table.entries.remove("from") {
            Some(Entry { value: Spanned { value: Value::Text(name), .. }, .. }) => {
                (name, Value::Table(std::mem::take(table)))
            }
            _ => return,
        },
        _ => return,
    };
    let entry = Entry { key: span, value: Spanned::new(value, span) };
    link.value.value = Value::Table(Table { entries: [(name, entry)].into() });
}
