//! Encoding of values to bytes.

use super::path::find;
use super::{AccessError, Descriptor, Enumeration, Kind, Primitive, Value};

/// Writes `value` into a value of that interface; returns its number of tail items.
/// It is written at `path` or as a whole (empty path). A table may leave fields out; they keep their content. Numbers
/// convert only exactly.
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
        let field_path = find(descriptor, path)?;
        if field_path.read(&copy, items).is_none() {
            return Err(AccessError::UnknownField {
                interface: descriptor.name.into(),
                field: path.into(),
                known: "at most as many items as its length".into(),
            });
        }
        write(field_path.kind(), &mut copy[field_path.offset()..], &mut new_items, path, value)?;
    }
    bytes.copy_from_slice(&copy);
    Ok(new_items)
}

/// Value to be assigned to a field, with the context of an error.
struct Assignment<'a> {
    kind: &'a Kind,
    field: &'a str,
    value: &'a Value,
}

impl Assignment<'_> {
    fn wrong(&self) -> AccessError {
        AccessError::WrongType {
            field: self.field.into(),
            expected: self.kind.describe(),
            found: format!("{} ({})", self.value.describe(), self.value),
        }
    }

    fn inexact(&self) -> AccessError {
        AccessError::NotExact {
            field: self.field.into(),
            expected: self.kind.describe(),
            found: self.value.to_string(),
        }
    }

    fn integer(&self) -> Result<i128, AccessError> {
        match self.value {
            Value::Integer(number) => Ok(*number),
            Value::Float(number) if *number == (*number as i128) as f64 => Ok(*number as i128),
            Value::Float(_) => Err(self.inexact()),
            _ => Err(self.wrong()),
        }
    }

    fn list(&self) -> Result<&[Value], AccessError> {
        match self.value {
            Value::List(list) => Ok(list),
            _ => Err(self.wrong()),
        }
    }

    fn write_primitive(&self, primitive: Primitive, bytes: &mut [u8]) -> Result<(), AccessError> {
        macro_rules! integer {
            ($type:ty) => {{
                let number = <$type>::try_from(self.integer()?).map_err(|_| self.inexact())?;
                bytes[..size_of::<$type>()].copy_from_slice(&number.to_ne_bytes());
            }};
        }
        match primitive {
            Primitive::Bool => bytes[0] = self.value.as_bool().ok_or_else(|| self.wrong())?.into(),
            Primitive::U8 => integer!(u8),
            Primitive::U16 => integer!(u16),
            Primitive::U32 => integer!(u32),
            Primitive::U64 => integer!(u64),
            Primitive::I8 => integer!(i8),
            Primitive::I16 => integer!(i16),
            Primitive::I32 => integer!(i32),
            Primitive::I64 => integer!(i64),
            Primitive::F32 => {
                // Decimal text such as 0.1 is nearest in either width, so rounding to f32 is what the user means.
                let number = self.value.as_f64().ok_or_else(|| self.wrong())?;
                let nearest = number as f32;
                let whole = matches!(self.value, Value::Integer(whole) if nearest as i128 != *whole);
                if whole || nearest.is_infinite() && number.is_finite() {
                    return Err(self.inexact());
                }
                bytes[..4].copy_from_slice(&nearest.to_ne_bytes());
            }
            Primitive::F64 => {
                let number = self.value.as_f64().ok_or_else(|| self.wrong())?;
                if matches!(self.value, Value::Integer(whole) if number as i128 != *whole) {
                    return Err(self.inexact());
                }
                bytes[..8].copy_from_slice(&number.to_ne_bytes());
            }
        }
        Ok(())
    }

    fn write_enumeration(&self, enumeration: &Enumeration, bytes: &mut [u8]) -> Result<(), AccessError> {
        let number = match self.value {
            Value::Text(name) => {
                let constant =
                    enumeration.constants.iter().find(|constant| constant.name.eq_ignore_ascii_case(name));
                &Value::Integer(constant.ok_or_else(|| self.wrong())?.value.into())
            }
            other => other,
        };
        write(&enumeration.carrier, bytes, &mut 0, self.field, number)
    }

    fn write_text(&self, capacity: usize, bytes: &mut [u8]) -> Result<(), AccessError> {
        let text = self.value.as_str().ok_or_else(|| self.wrong())?;
        if text.len() > capacity {
            return Err(self.inexact());
        }
        bytes[..4].copy_from_slice(&(text.len() as u32).to_ne_bytes());
        bytes[4..4 + capacity].fill(0);
        bytes[4..4 + text.len()].copy_from_slice(text.as_bytes());
        Ok(())
    }

    fn write_table(
        &self,
        descriptor: &Descriptor,
        bytes: &mut [u8],
        items: &mut usize,
    ) -> Result<(), AccessError> {
        let (field, Value::Table(entries)) = (self.field, self.value) else { return Err(self.wrong()) };
        for (name, entry) in entries {
            let field_path = find(descriptor, name)?;
            let path = if field.is_empty() { name.clone() } else { format!("{field}/{name}") };
            write(field_path.kind(), &mut bytes[field_path.offset()..], items, &path, entry)?;
        }
        Ok(())
    }

    fn write_items(&self, item: &Kind, bytes: &mut [u8], list: &[Value]) -> Result<(), AccessError> {
        for (i, value) in list.iter().enumerate() {
            write(item, &mut bytes[i * item.size()..], &mut 0, &format!("{}/{i}", self.field), value)?;
        }
        Ok(())
    }
}

fn write(
    kind: &Kind,
    bytes: &mut [u8],
    items: &mut usize,
    field: &str,
    value: &Value,
) -> Result<(), AccessError> {
    let assignment = Assignment { kind, field, value };
    match kind {
        Kind::Primitive(primitive) => assignment.write_primitive(*primitive, bytes)?,
        Kind::Enumeration(enumeration) => assignment.write_enumeration(enumeration, bytes)?,
        Kind::Text(capacity) => assignment.write_text(*capacity, bytes)?,
        Kind::Optional(item) => {
            let present = *value != Value::Null;
            bytes[..4].copy_from_slice(&u32::from(present).to_ne_bytes());
            if present {
                write(item, &mut bytes[8..], items, field, value)?;
            }
        }
        Kind::Array(item, count) => {
            let list = assignment.list()?;
            if list.len() != *count {
                return Err(assignment.wrong());
            }
            assignment.write_items(item, bytes, list)?;
        }
        Kind::Sequence(item, capacity) => {
            let list = assignment.list()?;
            if list.len() > *capacity {
                return Err(assignment.inexact());
            }
            bytes[..4].copy_from_slice(&(list.len() as u32).to_ne_bytes());
            assignment.write_items(item, &mut bytes[8..], list)?;
        }
        Kind::Nested(descriptor) => assignment.write_table(descriptor, bytes, items)?,
        Kind::Tail(item) => {
            let list = assignment.list()?;
            if list.len() * item.size() > bytes.len() {
                return Err(assignment.inexact());
            }
            assignment.write_items(item, bytes, list)?;
            *items = list.len();
        }
    }
    Ok(())
}
