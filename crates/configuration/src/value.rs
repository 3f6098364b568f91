use std::collections::BTreeMap;
use std::fmt;

use slate_blackboard::interface;
use toml_edit::TableLike;

use super::problems::Problems;
use super::source::{Span, Spanned};

/// A value as it is written; what it must be is decided by who reads it.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A truth value.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Float(f64),
    /// Text.
    Text(String),
    /// A list.
    List(Vec<Spanned<Value>>),
    /// Named values.
    Table(Table),
}

/// Named values, ordered by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    pub(super) entries: BTreeMap<String, Entry>,
}

/// A value in a [`Table`].
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Where its key is written.
    pub key: Span,
    /// The value.
    pub value: Spanned<Value>,
}

impl Value {
    /// What a message calls a value of this type.
    pub fn describe(&self) -> &'static str {
        match self {
            Self::Bool(_) => "a truth value",
            Self::Integer(_) => "a whole number",
            Self::Float(_) => "a number",
            Self::Text(_) => "text",
            Self::List(_) => "a list",
            Self::Table(_) => "a table",
        }
    }

    /// A truth value.
    pub fn as_bool(&self) -> Option<bool> {
        if let Self::Bool(value) = self { Some(*value) } else { None }
    }

    /// A whole number.
    pub fn as_integer(&self) -> Option<i64> {
        if let Self::Integer(value) = self { Some(*value) } else { None }
    }

    /// A number, also a whole one.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Self::Float(value) => Some(*value),
            Self::Integer(value) => Some(*value as f64),
            _ => None,
        }
    }

    /// Text.
    pub fn as_str(&self) -> Option<&str> {
        if let Self::Text(value) = self { Some(value) } else { None }
    }

    /// A list.
    pub fn as_list(&self) -> Option<&[Spanned<Value>]> {
        if let Self::List(items) = self { Some(items) } else { None }
    }

    /// A table.
    pub fn as_table(&self) -> Option<&Table> {
        if let Self::Table(table) = self { Some(table) } else { None }
    }

    /// The value of a TOML item; what no setting can be (a date) is a problem.
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

/// TOML, which reads as the same value.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        toml_edit::Value::from(self).fmt(f)
    }
}

impl From<&Value> for toml_edit::Value {
    fn from(value: &Value) -> Self {
        match value {
            Value::Bool(value) => (*value).into(),
            Value::Integer(value) => (*value).into(),
            Value::Float(value) => (*value).into(),
            Value::Text(value) => value.into(),
            Value::List(items) => items.iter().map(|item| Self::from(&item.value)).collect(),
            Value::Table(table) => {
                table.iter().map(|(name, entry)| (name, Self::from(&entry.value.value))).collect()
            }
        }
    }
}

impl From<&Value> for interface::Value {
    fn from(value: &Value) -> Self {
        match value {
            Value::Bool(value) => Self::Bool(*value),
            Value::Integer(value) => Self::Integer(i128::from(*value)),
            Value::Float(value) => Self::Float(*value),
            Value::Text(value) => Self::Text(value.clone()),
            Value::List(items) => Self::List(items.iter().map(|item| Self::from(&item.value)).collect()),
            Value::Table(table) => Self::from(table),
        }
    }
}

impl From<&Table> for interface::Value {
    fn from(table: &Table) -> Self {
        Self::Table(table.iter().map(|(name, entry)| (name.into(), Self::from(&entry.value.value))).collect())
    }
}

impl Table {
    /// The entries, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Entry)> {
        self.entries.iter().map(|(name, entry)| (name.as_str(), entry))
    }

    /// The value of that name.
    pub fn get(&self, name: &str) -> Option<&Spanned<Value>> {
        self.entries.get(name).map(|entry| &entry.value)
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    pub(super) fn of_item(table: &dyn TableLike, source: usize, problems: &mut Problems) -> Self {
        let mut entries = BTreeMap::new();
        for (name, item) in table.iter() {
            let range =
                table.key(name).and_then(toml_edit::Key::span).or_else(|| item.span()).unwrap_or_default();
            let key = Span { source, start: range.start, end: range.end };
            if let Some(value) = Value::of_item(item, key, problems) {
                entries.insert(name.to_owned(), Entry { key, value });
            }
        }
        Self { entries }
    }

    /// The entry at a path.
    pub(super) fn entry(&self, path: &[String]) -> Option<&Entry> {
        match path {
            [] => None,
            [name] => self.entries.get(name),
            [name, rest @ ..] => self.get(name)?.as_table()?.entry(rest),
        }
    }

    /// Takes out what is at a path.
    pub(super) fn remove(&mut self, path: &[String]) {
        match path {
            [] => {}
            [name] => drop(self.entries.remove(name)),
            [name, rest @ ..] => {
                if let Some(Value::Table(table)) =
                    self.entries.get_mut(name).map(|entry| &mut entry.value.value)
                {
                    table.remove(rest);
                }
            }
        }
    }

    /// Follows names through tables.
    pub(super) fn at<'a>(&self, mut path: impl Iterator<Item = &'a str>) -> Option<&Spanned<Value>> {
        let value = self.get(path.next()?)?;
        path.try_fold(value, |value, name| value.as_table()?.get(name))
    }

    /// Takes over what another layer says: tables are united, everything else is replaced.
    pub(super) fn merge(&mut self, layer: Self) {
        for (name, entry) in layer.entries {
            match (self.entries.get_mut(&name).map(|old| &mut old.value.value), entry) {
                (Some(Value::Table(old)), Entry { value: Spanned { value: Value::Table(new), .. }, .. }) => {
                    old.merge(new);
                }
                (_, entry) => {
                    self.entries.insert(name, entry);
                }
            }
        }
    }
}
