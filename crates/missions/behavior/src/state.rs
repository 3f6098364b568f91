//! State of a mission as plain data.

use mlua::{Lua, Table, Value};
use serde::{Deserialize, Serialize};

/// State of a mission: changes in machines, states and variables.
/// They are relative to the loaded mission.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BehaviorState(Vec<ObjectChange>);

/// Changed field of an object that the engine knows by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct ObjectChange {
    /// Name, such as `state:visit/GO`.
    object: String,
    field: SavedValue,
    /// Value; none for a field that was removed.
    value: Option<SavedValue>,
}

/// Value of Lua as plain data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum SavedValue {
    Boolean(bool),
    Integer(i64),
    Number(f64),
    /// Bits of a number that is not finite, which some formats don't have.
    Special(u64),
    Text(String),
    /// Text that is not UTF-8.
    Bytes(Vec<u8>),
    /// Object that the engine knows by name.
    Reference(String),
    /// Table that was saved before, by its number.
    Same(i64),
    Table {
        number: i64,
        /// Name of its class; empty for none.
        class: String,
        entries: Vec<(Self, Self)>,
    },
}

impl BehaviorState {
    /// Returns true if the state has no changes.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Reads the list made by the prelude.
    pub(crate) fn read(list: &Table) -> mlua::Result<Self> {
        let change = |change: mlua::Result<Table>| {
            let change = change?;
            let value = match change.get(3)? {
                Value::Nil => None,
                value => Some(SavedValue::read(&value)?),
            };
            Ok(ObjectChange { object: change.get(1)?, field: SavedValue::read(&change.get(2)?)?, value })
        };
        Ok(Self(list.sequence_values().map(change).collect::<mlua::Result<_>>()?))
    }

    /// Writes the list that the prelude reads.
    pub(crate) fn write(&self, lua: &Lua) -> mlua::Result<Table> {
        let list = lua.create_table_with_capacity(self.0.len(), 0)?;
        for change in &self.0 {
            let triple = lua.create_table_with_capacity(3, 0)?;
            triple.set(1, change.object.as_str())?;
            triple.set(2, change.field.write(lua)?)?;
            if let Some(value) = &change.value {
                triple.set(3, value.write(lua)?)?;
            }
            list.push(triple)?;
        }
        Ok(list)
    }
}

impl SavedValue {
    fn read(value: &Value) -> mlua::Result<Self> {
        Ok(match value {
            Value::Boolean(value) => Self::Boolean(*value),
            Value::Integer(value) => Self::Integer(*value),
            Value::Number(value) if value.is_finite() => Self::Number(*value),
            Value::Number(value) => Self::Special(value.to_bits()),
            Value::String(text) => match text.to_str() {
                Ok(text) => Self::Text(text.to_owned()),
                Err(_) => Self::Bytes(text.as_bytes().to_vec()),
            },
            Value::Table(table) => Self::read_table(table)?,
            other => {
                return Err(mlua::Error::runtime(format!("a {} can't be saved", other.type_name())));
            }
        })
    }

    fn read_table(table: &Table) -> mlua::Result<Self> {
        let kind: String = table.get(1)?;
        match kind.as_str() {
            "reference" => return Ok(Self::Reference(table.get(2)?)),
            "same" => return Ok(Self::Same(table.get(2)?)),
            _ => {}
        }
        let entry = |index: i64| Ok((Self::read(&table.get(index)?)?, Self::read(&table.get(index + 1)?)?));
        let length = i64::try_from(table.raw_len()).unwrap_or(0);
        let entries = (4..=length).step_by(2).map(entry).collect::<mlua::Result<_>>()?;
        Ok(Self::Table { number: table.get(2)?, class: table.get(3)?, entries })
    }

    fn write(&self, lua: &Lua) -> mlua::Result<Value> {
        let tagged = |tag: &str| {
            let table = lua.create_table()?;
            table.push(tag)?;
            Ok::<Table, mlua::Error>(table)
        };
        Ok(match self {
            Self::Boolean(value) => Value::Boolean(*value),
            Self::Integer(value) => Value::Integer(*value),
            Self::Number(value) => Value::Number(*value),
            Self::Special(bits) => Value::Number(f64::from_bits(*bits)),
            Self::Text(text) => Value::String(lua.create_string(text)?),
            Self::Bytes(bytes) => Value::String(lua.create_string(bytes)?),
            Self::Reference(name) => {
                let table = tagged("reference")?;
                table.push(name.as_str())?;
                Value::Table(table)
            }
            Self::Same(number) => {
                let table = tagged("same")?;
                table.push(*number)?;
                Value::Table(table)
            }
            Self::Table { number, class, entries } => {
                let table = tagged("table")?;
                table.push(*number)?;
                table.push(class.as_str())?;
                for (key, value) in entries {
                    table.push(key.write(lua)?)?;
                    table.push(value.write(lua)?)?;
                }
                Value::Table(table)
            }
        })
    }
}
