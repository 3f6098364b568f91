use super::view::{length, read};
use super::{Descriptor, Kind, Primitive, Value};
use crate::board::nearest_names;

fn no_field(interface: &str, field: &str, known: &str) -> String {
    if field.is_empty() {
        return format!("no field of {interface} is named; it has {known}");
    }
    format!("{interface} has no field `{field}`; it has {known}")
}

/// Why a field can't be read or written.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AccessError {
    /// The interface has no such field.
    #[error("{}", no_field(.interface, .field, .known))]
    UnknownField {
        /// The interface that was searched.
        interface: String,
        /// The name that was asked for.
        field: String,
        /// The names there are.
        known: String,
    },
    /// A value of another type was given.
    #[error("`{field}` is {expected}, not {found}")]
    WrongType {
        /// Path of the field.
        field: String,
        /// What it is.
        expected: String,
        /// What was given.
        found: String,
    },
    /// The field can't hold that value exactly.
    #[error("`{field}` is {expected} and can't hold {found} exactly")]
    NotExact {
        /// Path of the field.
        field: String,
        /// What it is.
        expected: String,
        /// What was given.
        found: String,
    },
}

/// A place inside an interface: what a URL says after the property.
#[derive(Clone, Debug)]
pub struct FieldPath {
    kind: Kind,
    offset: usize,
    /// Length prefixes on the way: (offset, capacity, index), which must cover the index.
    guards: Vec<(usize, usize, usize)>,
    tail_index: Option<usize>,
}

impl FieldPath {
    /// The type found there.
    pub fn kind(&self) -> &Kind {
        &self.kind
    }

    /// Bytes from the beginning of the value.
    pub fn offset(&self) -> usize {
        self.offset
    }

    pub(super) fn read(&self, bytes: &[u8], items: usize) -> Option<Value> {
        let covered =
            self.guards.iter().all(|(offset, capacity, index)| *index < length(&bytes[*offset..], *capacity));
        let in_tail = self.tail_index.is_none_or(|index| index < items);
        (covered && in_tail).then(|| read(&self.kind, &bytes[self.offset..], items))
    }
}

/// The names of all fields, those first that may be meant.
fn fields(descriptor: &Descriptor, meant: &str) -> String {
    let names = || descriptor.fields.iter().map(|field| field.name);
    let near = nearest_names(meant, names());
    let others = names().filter(|name| !near.iter().any(|near| near == name));
    near.iter().map(String::as_str).chain(others).collect::<Vec<_>>().join(", ")
}

/// Finds `path` (`position/x`, `ranges/3`) in an interface.
///
/// # Errors
/// [`AccessError::UnknownField`] with the names there are.
pub fn find(descriptor: &Descriptor, path: &str) -> Result<FieldPath, AccessError> {
    let mut found: Option<FieldPath> = None;
    let mut current = Some(descriptor);
    for name in path.split('/') {
        let unknown = |interface: &str, known: String| AccessError::UnknownField {
            interface: interface.into(),
            field: name.into(),
            known,
        };
        let place = match (current.take(), found.take()) {
            (Some(descriptor), before) => {
                let field = descriptor
                    .fields
                    .iter()
                    .find(|field| field.name == name)
                    .ok_or_else(|| unknown(descriptor.name, fields(descriptor, name)))?;
                let (base, guards, tail_index) =
                    before.map_or((0, vec![], None), |p| (p.offset, p.guards, p.tail_index));
                FieldPath { kind: field.kind, offset: base + field.offset, guards, tail_index }
            }
            (None, Some(mut place)) => {
                let index = name.parse::<usize>();
                let missing = || unknown(&place.kind.describe(), "indices from 0".into());
                match (place.kind, index) {
                    (Kind::Array(item, count), Ok(i)) if i < count => {
                        place.offset += i * item.size();
                        place.kind = *item;
                    }
                    (Kind::Sequence(item, capacity), Ok(i)) if i < capacity => {
                        place.guards.push((place.offset, capacity, i));
                        place.offset += 8 + i * item.size();
                        place.kind = *item;
                    }
                    (Kind::Tail(item), Ok(i)) => {
                        place.tail_index = Some(i);
                        // The index is the caller's, and may be beyond any memory.
                        let end =
                            i.checked_mul(item.size()).and_then(|bytes| bytes.checked_add(place.offset));
                        place.offset = end.ok_or_else(missing)?;
                        place.kind = *item;
                    }
                    _ => return Err(missing()),
                }
                place
            }
            (None, None) => return Err(unknown("value", "no fields".into())),
        };
        if let Kind::Nested(inner) = place.kind {
            current = Some(inner);
        }
        found = Some(place);
    }
    found.ok_or_else(|| AccessError::UnknownField {
        interface: descriptor.name.into(),
        field: path.into(),
        known: "its fields".into(),
    })
}

/// Writes `value` into a value of that interface, at `path` or as a whole (empty path); returns the number of tail
/// items the value then has. A table may leave fields out; they keep what they hold. Numbers convert only where
/// that is exact.
///
/// # Errors
/// The first field that doesn't fit. The bytes are unchanged then.
pub fn edit(
    descriptor: &'static Descriptor,
    bytes: &mut [u8],
    items: usize,
    path: &str,
    value: &Value,
) -> Result<usize, AccessError> {
    let mut copy = bytes.to_vec();
    let mut new_items = items;
    if path.is_empty() {
        write(&Kind::Nested(descriptor), &mut copy, &mut new_items, descriptor.name, value)?;
    } else {
        let place = find(descriptor, path)?;
        if place.read(&copy, items).is_none() {
            return Err(AccessError::UnknownField {
                interface: descriptor.name.into(),
                field: path.into(),
                known: "only as many items as its length says".into(),
            });
        }
        write(&place.kind, &mut copy[place.offset..], &mut new_items, path, value)?;
    }
    bytes.copy_from_slice(&copy);
    Ok(new_items)
}

fn write(
    kind: &Kind,
    bytes: &mut [u8],
    items: &mut usize,
    field: &str,
    value: &Value,
) -> Result<(), AccessError> {
    let wrong = || AccessError::WrongType {
        field: field.into(),
        expected: kind.describe(),
        found: format!("{} ({value})", value.describe()),
    };
    let inexact =
        || AccessError::NotExact { field: field.into(), expected: kind.describe(), found: value.to_string() };
    macro_rules! integer {
        ($type:ty) => {{
            let number = match value {
                Value::Integer(number) => *number,
                Value::Float(number) if *number == (*number as i128) as f64 => *number as i128,
                Value::Float(_) => return Err(inexact()),
                _ => return Err(wrong()),
            };
            let number = <$type>::try_from(number).map_err(|_| inexact())?;
            bytes[..size_of::<$type>()].copy_from_slice(&number.to_ne_bytes());
        }};
    }
    match kind {
        Kind::Primitive(Primitive::Bool) => bytes[0] = value.as_bool().ok_or_else(wrong)?.into(),
        Kind::Primitive(Primitive::U8) => integer!(u8),
        Kind::Primitive(Primitive::U16) => integer!(u16),
        Kind::Primitive(Primitive::U32) => integer!(u32),
        Kind::Primitive(Primitive::U64) => integer!(u64),
        Kind::Primitive(Primitive::I8) => integer!(i8),
        Kind::Primitive(Primitive::I16) => integer!(i16),
        Kind::Primitive(Primitive::I32) => integer!(i32),
        Kind::Primitive(Primitive::I64) => integer!(i64),
        Kind::Primitive(Primitive::F32) => {
            // Decimal text such as 0.1 is nearest in either width, so rounding to f32 is what the user means.
            let number = value.as_f64().ok_or_else(wrong)?;
            let nearest = number as f32;
            let whole = matches!(value, Value::Integer(whole) if nearest as i128 != *whole);
            if whole || nearest.is_infinite() && number.is_finite() {
                return Err(inexact());
            }
            bytes[..4].copy_from_slice(&nearest.to_ne_bytes());
        }
        Kind::Primitive(Primitive::F64) => {
            let number = value.as_f64().ok_or_else(wrong)?;
            if matches!(value, Value::Integer(whole) if number as i128 != *whole) {
                return Err(inexact());
            }
            bytes[..8].copy_from_slice(&number.to_ne_bytes());
        }
        Kind::Enumeration(enumeration) => match value {
            Value::Text(name) => {
                let constant =
                    enumeration.constants.iter().find(|constant| constant.name.eq_ignore_ascii_case(name));
                let number = Value::Integer(constant.ok_or_else(wrong)?.value.into());
                write(&enumeration.carrier, bytes, items, field, &number)?;
            }
            other => write(&enumeration.carrier, bytes, items, field, other)?,
        },
        Kind::Text(capacity) => {
            let text = value.as_str().ok_or_else(wrong)?;
            if text.len() > *capacity {
                return Err(inexact());
            }
            bytes[..4].copy_from_slice(&(text.len() as u32).to_ne_bytes());
            bytes[4..4 + capacity].fill(0);
            bytes[4..4 + text.len()].copy_from_slice(text.as_bytes());
        }
        Kind::Optional(item) => {
            let present = *value != Value::Null;
            bytes[..4].copy_from_slice(&u32::from(present).to_ne_bytes());
            if present {
                write(item, &mut bytes[8..], items, field, value)?;
            }
        }
        Kind::Array(item, count) => {
            let Value::List(list) = value else { return Err(wrong()) };
            if list.len() != *count {
                return Err(wrong());
            }
            write_items(item, bytes, field, list)?;
        }
        Kind::Sequence(item, capacity) => {
            let Value::List(list) = value else { return Err(wrong()) };
            if list.len() > *capacity {
                return Err(inexact());
            }
            bytes[..4].copy_from_slice(&(list.len() as u32).to_ne_bytes());
            write_items(item, &mut bytes[8..], field, list)?;
        }
        Kind::Nested(descriptor) => {
            let Value::Table(entries) = value else { return Err(wrong()) };
            for (name, entry) in entries {
                let place = find(descriptor, name)?;
                let path = if field.is_empty() { name.clone() } else { format!("{field}/{name}") };
                write(&place.kind, &mut bytes[place.offset..], items, &path, entry)?;
            }
        }
        Kind::Tail(item) => {
            let Value::List(list) = value else { return Err(wrong()) };
            if list.len() * item.size() > bytes.len() {
                return Err(inexact());
            }
            write_items(item, bytes, field, list)?;
            *items = list.len();
        }
    }
    Ok(())
}

fn write_items(item: &Kind, bytes: &mut [u8], field: &str, list: &[Value]) -> Result<(), AccessError> {
    for (i, value) in list.iter().enumerate() {
        write(item, &mut bytes[i * item.size()..], &mut 0, &format!("{field}/{i}"), value)?;
    }
    Ok(())
}
