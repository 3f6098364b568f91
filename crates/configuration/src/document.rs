//! Values of a TOML document, each with its place.

use slate_sorted::SortedMap;
use toml_edit::TableLike;

use super::problems::Problems;
use super::source::{Span, Spanned};
use super::value::{Table, TableEntry, Value};

impl Value {
    /// Reads the value of a TOML item.
    /// Types that no setting has, such as dates, are problems.
    pub(super) fn of_item(
        item: &toml_edit::Item,
        key: Span,
        problems: &mut Problems,
    ) -> Option<Spanned<Self>> {
        let span = item.span().map_or(key, |range| Span { start: range.start, end: range.end, ..key });
        if let Some(table) = item.as_table_like() {
            return Some(Spanned::new(Self::Table(Table::of_item(table, key.source, problems)), span));
        }
        let value = match item {
            toml_edit::Item::ArrayOfTables(tables) => {
                let of_table = |table: &toml_edit::Table| {
                    let span = table.span().map_or(span, |range| Span {
                        start: range.start,
                        end: range.end,
                        ..span
                    });
                    Spanned::new(Self::Table(Table::of_item(table, key.source, problems)), span)
                };
                Self::List(tables.iter().map(of_table).collect())
            }
            toml_edit::Item::Value(value) => return Self::of_toml(value, span, problems),
            // An item without a value or with a table's was handled above.
            _ => return None,
        };
        Some(Spanned::new(value, span))
    }

    pub(super) fn of_toml(
        value: &toml_edit::Value,
        outer: Span,
        problems: &mut Problems,
    ) -> Option<Spanned<Self>> {
        let span = value.span().map_or(outer, |range| Span { start: range.start, end: range.end, ..outer });
        let value = match value {
            toml_edit::Value::Boolean(value) => Self::Bool(*value.value()),
            toml_edit::Value::Integer(value) => Self::Integer(*value.value()),
            toml_edit::Value::Float(value) => Self::Float(*value.value()),
            toml_edit::Value::String(value) => Self::Text(value.value().clone()),
            toml_edit::Value::Array(items) => {
                Self::List(items.iter().filter_map(|item| Self::of_toml(item, span, problems)).collect())
            }
            toml_edit::Value::InlineTable(table) => Self::Table(Table::of_item(table, span.source, problems)),
            toml_edit::Value::Datetime(_) => {
                problems.add(
                    span,
                    "no setting is a date or a time of day",
                    "put it in quotes to make it text",
                );
                return None;
            }
        };
        Some(Spanned::new(value, span))
    }
}

impl Table {
    /// Reads the table of a document; `source` is its text.
    pub(super) fn of_item(table: &dyn TableLike, source: usize, problems: &mut Problems) -> Self {
        let mut entries = SortedMap::new();
        for (name, item) in table.iter() {
            let range =
                table.key(name).and_then(toml_edit::Key::span).or_else(|| item.span()).unwrap_or_default();
            let key = Span { source, start: range.start, end: range.end };
            if let Some(value) = Value::of_item(item, key, problems) {
                entries.insert(name.to_owned(), TableEntry { key, value });
            }
        }
        Self { entries }
    }
}
