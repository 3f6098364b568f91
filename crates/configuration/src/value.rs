use std::fmt;

use slate_blackboard::interface;
use slate_sorted::SortedMap;

use super::source::{Span, Spanned};

/// Value as written; its reader decides on the type.
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
    pub(super) entries: SortedMap<String, TableEntry>,
}

/// A value in a [`Table`].
#[derive(Clone, Debug, PartialEq)]
pub struct TableEntry {
    /// Place of its key.
    pub key: Span,
    /// The value.
    pub value: Spanned<Value>,
}

impl Value {
    /// Returns the name of this type in messages.
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
}

/// Writes TOML, which reads as the same value.
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
    pub fn iter(&self) -> impl Iterator<Item = (&str, &TableEntry)> {
        self.entries.iter().map(|(name, entry)| (name.as_str(), entry))
    }

    /// Returns the value of a name.
    pub fn get(&self, name: &str) -> Option<&Spanned<Value>> {
        self.entries.get(name).map(|entry| &entry.value)
    }

    /// Returns true if it has no entries.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Returns the entry at a path.
    pub(super) fn entry(&self, path: &[String]) -> Option<&TableEntry> {
        match path {
            [] => None,
            [name] => self.entries.get(name),
            [name, rest @ ..] => self.get(name)?.as_table()?.entry(rest),
        }
    }

    /// Removes the entry at a path.
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

    /// Returns the value at the end of names through tables.
    pub(super) fn at<'a>(&self, mut path: impl Iterator<Item = &'a str>) -> Option<&Spanned<Value>> {
        let value = self.get(path.next()?)?;
        path.try_fold(value, |value, name| value.as_table()?.get(name))
    }

    /// Merges another layer: tables are united, other values are replaced.
    pub(super) fn merge(&mut self, layer: Self) {
        for (name, entry) in layer.entries {
            match (self.entries.get_mut(&name).map(|old| &mut old.value.value), entry) {
                (
                    Some(Value::Table(old)),
                    TableEntry { value: Spanned { value: Value::Table(new), .. }, .. },
                ) => {
                    old.merge(new);
                }
                (_, entry) => {
                    self.entries.insert(name, entry);
                }
            }
        }
    }
}
