use std::fmt;
use std::ops::RangeInclusive;
use std::sync::Arc;

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use slate_blackboard::interface::{Kind, Primitive};

/// Value of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A truth value.
    Bool(bool),
    /// A whole number with a sign.
    Signed(i64),
    /// A whole number without a sign.
    Unsigned(u64),
    /// A number of 32 bits.
    Single(f32),
    /// A number of 64 bits.
    Double(f64),
    /// Text.
    Text(Box<str>),
    /// A list of numbers or truth values.
    Numbers(Numbers),
    /// A list of texts or messages.
    List(Vec<Value>),
    /// A message.
    Map(Map),
}

/// A message: its fields in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    names: Arc<Vec<String>>,
    values: Vec<Value>,
}

impl Map {
    pub(super) fn new(names: Arc<Vec<String>>, values: Vec<Value>) -> Self {
        Self { names, values }
    }

    /// Returns the field of that name.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.iter().find(|(other, _)| *other == name).map(|(_, value)| value)
    }

    /// Names and values, which may change.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = (&str, &mut Value)> {
        self.names.iter().map(String::as_str).zip(&mut self.values)
    }

    /// Names and values.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.names.iter().map(String::as_str).zip(&self.values)
    }
}

/// A list of numbers of one type, which takes no more memory than in the message.
#[derive(Clone, PartialEq)]
pub struct Numbers {
    kind: Primitive,
    memory: Vec<u8>,
}

impl Numbers {
    pub(super) fn new(kind: Primitive, memory: Vec<u8>) -> Self {
        Self { kind, memory }
    }

    /// Returns the type of the numbers.
    pub fn kind(&self) -> Primitive {
        self.kind
    }

    /// Returns the number of elements.
    pub fn len(&self) -> usize {
        self.memory.len() / self.kind.size()
    }

    /// Returns true if it has no elements.
    pub fn is_empty(&self) -> bool {
        self.memory.is_empty()
    }

    /// Returns the bytes of all numbers, such as the pixels of an image.
    pub fn bytes(&self) -> &[u8] {
        &self.memory
    }

    /// Returns one number.
    pub fn get(&self, index: usize) -> Option<Value> {
        let start = index.checked_mul(self.kind.size())?;
        let bytes = self.memory.get(start..start.checked_add(self.kind.size())?)?;
        Some(self.kind.value(bytes))
    }

    /// Iterates over the numbers.
    pub fn iter(&self) -> impl Iterator<Item = Value> {
        self.memory.chunks_exact(self.kind.size()).map(|bytes| self.kind.value(bytes))
    }
}

impl fmt::Debug for Numbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

/// Primitive types as ROS has them.
pub(super) trait RosPrimitive: Sized {
    /// Name in a message definition.
    fn ros_name(self) -> &'static str;
    /// Primitive of a name in a message definition.
    fn named(name: &str) -> Option<Self>;
    /// Primitive of a number, truth value or enumeration.
    fn of(kind: &Kind) -> Option<Self>;
    /// Integers that it can hold.
    fn range(self) -> RangeInclusive<i128>;
    /// Value of its bytes in memory.
    fn value(self, bytes: &[u8]) -> Value;
}

impl RosPrimitive for Primitive {
    fn ros_name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::U8 => "uint8",
            Self::U16 => "uint16",
            Self::U32 => "uint32",
            Self::U64 => "uint64",
            Self::I8 => "int8",
            Self::I16 => "int16",
            Self::I32 => "int32",
            Self::I64 => "int64",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    fn named(name: &str) -> Option<Self> {
        // In ROS 2, all three are the same.
        let name = if matches!(name, "byte" | "char") { "uint8" } else { name };
        Self::ALL.into_iter().find(|primitive| primitive.ros_name() == name)
    }

    fn of(kind: &Kind) -> Option<Self> {
        match kind {
            Kind::Primitive(primitive) => Some(*primitive),
            Kind::Enumeration(enumeration) => Self::of(&enumeration.carrier),
            _ => None,
        }
    }

    fn range(self) -> RangeInclusive<i128> {
        match self {
            Self::Bool => 0..=1,
            number => number.integers().unwrap_or(i64::MIN.into()..=i64::MAX.into()),
        }
    }

    fn value(self, bytes: &[u8]) -> Value {
        macro_rules! number {
            ($type:ty) => {{
                let mut memory = [0; size_of::<$type>()];
                memory.copy_from_slice(&bytes[..size_of::<$type>()]);
                <$type>::from_ne_bytes(memory)
            }};
        }
        match self {
            Self::Bool => Value::Bool(bytes[0] != 0),
            Self::U8 => Value::Unsigned(bytes[0].into()),
            Self::U16 => Value::Unsigned(number!(u16).into()),
            Self::U32 => Value::Unsigned(number!(u32).into()),
            Self::U64 => Value::Unsigned(number!(u64)),
            Self::I8 => Value::Signed(number!(i8).into()),
            Self::I16 => Value::Signed(number!(i16).into()),
            Self::I32 => Value::Signed(number!(i32).into()),
            Self::I64 => Value::Signed(number!(i64)),
            Self::F32 => Value::Single(number!(f32)),
            Self::F64 => Value::Double(number!(f64)),
        }
    }
}

impl Value {
    /// Returns the field of a message.
    pub fn get(&self, name: &str) -> Option<&Value> {
        match self {
            Self::Map(map) => map.get(name),
            _ => None,
        }
    }

    /// Returns the value at a path such as `pose/position/x` or `ranges/3`.
    /// An empty path gives the value itself.
    pub fn at(&self, path: &str) -> Option<Value> {
        if path.is_empty() {
            return Some(self.clone());
        }
        let (first, rest) = path.split_once('/').unwrap_or((path, ""));
        match self {
            Self::Map(map) => map.get(first)?.at(rest),
            Self::List(items) => items.get(first.parse::<usize>().ok()?)?.at(rest),
            Self::Numbers(numbers) if rest.is_empty() => numbers.get(first.parse().ok()?),
            _ => None,
        }
    }

    /// Returns a number of any type as `f64`.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Self::Signed(number) => Some(*number as f64),
            Self::Unsigned(number) => Some(*number as f64),
            Self::Single(number) => Some((*number).into()),
            Self::Double(number) => Some(*number),
            _ => None,
        }
    }

    /// Returns a whole number.
    pub fn as_integer(&self) -> Option<i128> {
        match self {
            Self::Signed(number) => Some((*number).into()),
            Self::Unsigned(number) => Some((*number).into()),
            _ => None,
        }
    }

    /// Returns a text.
    pub fn as_str(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Returns a boolean.
    pub fn as_bool(&self) -> Option<bool> {
        match self {
            Self::Bool(value) => Some(*value),
            _ => None,
        }
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Bool(value) => serializer.serialize_bool(*value),
            Self::Signed(value) => serializer.serialize_i64(*value),
            Self::Unsigned(value) => serializer.serialize_u64(*value),
            Self::Single(value) => serializer.serialize_f32(*value),
            Self::Double(value) => serializer.serialize_f64(*value),
            Self::Text(value) => serializer.serialize_str(value),
            Self::Numbers(numbers) => serializer.collect_seq(numbers.iter()),
            Self::List(items) => serializer.collect_seq(items),
            Self::Map(fields) => {
                let mut map = serializer.serialize_map(Some(fields.values.len()))?;
                for (name, value) in fields.iter() {
                    map.serialize_entry(name, value)?;
                }
                map.end()
            }
        }
    }
}

/// Formats a value as those of the blackboard: `{ x = 1.5, names = ["a", "b"] }`.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Signed(value) => value.fmt(f),
            Self::Unsigned(value) => value.fmt(f),
            Self::Single(value) => value.fmt(f),
            Self::Double(value) => value.fmt(f),
            Self::Text(value) => write!(f, "{value:?}"),
            Self::Numbers(numbers) => list(f, numbers.iter()),
            Self::List(items) => list(f, items.iter()),
            Self::Map(map) => {
                f.write_str("{")?;
                for (i, (name, value)) in map.iter().enumerate() {
                    write!(f, "{}{name} = {value}", if i == 0 { " " } else { ", " })?;
                }
                f.write_str(" }")
            }
        }
    }
}

fn list(f: &mut fmt::Formatter<'_>, items: impl Iterator<Item = impl fmt::Display>) -> fmt::Result {
    f.write_str("[")?;
    for (i, item) in items.enumerate() {
        write!(f, "{}{item}", if i == 0 { "" } else { ", " })?;
    }
    f.write_str("]")
}
