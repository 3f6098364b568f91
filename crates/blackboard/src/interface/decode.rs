//! Decoding of bytes to values.

use super::{Descriptor, Kind, Primitive, Value};

/// Decodes the bytes of an interface as a table of its fields.
pub(super) fn table(descriptor: &Descriptor, bytes: &[u8], items: usize) -> Value {
    let entries = descriptor
        .fields
        .iter()
        .map(|field| (field.name.into(), read(&field.kind, &bytes[field.offset..], items)));
    Value::Table(entries.collect())
}

fn fixed<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut result = [0; N];
    result.copy_from_slice(&bytes[..N]);
    result
}

/// Returns the length prefix of a text or a sequence.
/// It is clamped, because a damaged value may hold anything.
pub(super) fn length(bytes: &[u8], capacity: usize) -> usize {
    (u32::from_ne_bytes(fixed(bytes)) as usize).min(capacity)
}

fn list(item: &Kind, bytes: &[u8], count: usize) -> Value {
    Value::List((0..count).map(|i| read(item, &bytes[i * item.size()..], 0)).collect())
}

/// Decodes bytes of a kind.
/// `tail_items` is the number of items in the tail of the whole value.
pub(super) fn read(kind: &Kind, bytes: &[u8], tail_items: usize) -> Value {
    match kind {
        Kind::Primitive(primitive) => read_primitive(*primitive, bytes),
        Kind::Enumeration(enumeration) => match read(&enumeration.carrier, bytes, 0) {
            Value::Integer(number) => enumeration
                .constants
                .iter()
                .find(|constant| i128::from(constant.value) == number)
                .map_or(Value::Integer(number), |constant| Value::Text(constant.name.into())),
            other => other,
        },
        Kind::Text(capacity) => {
            let text = &bytes[4..4 + length(bytes, *capacity)];
            Value::Text(String::from_utf8_lossy(text).into_owned())
        }
        Kind::Optional(item) if length(bytes, 1) == 0 => {
            let _ = item;
            Value::Null
        }
        Kind::Optional(item) => read(item, &bytes[8..], 0),
        Kind::Array(item, count) => list(item, bytes, *count),
        Kind::Sequence(item, capacity) => list(item, &bytes[8..], length(bytes, *capacity)),
        Kind::Nested(descriptor) => table(descriptor, bytes, 0),
        Kind::Tail(item) => list(item, bytes, tail_items),
    }
}

fn read_primitive(primitive: Primitive, bytes: &[u8]) -> Value {
    match primitive {
        Primitive::Bool => Value::Bool(bytes[0] != 0),
        Primitive::U8 => Value::Integer(bytes[0].into()),
        Primitive::U16 => Value::Integer(u16::from_ne_bytes(fixed(bytes)).into()),
        Primitive::U32 => Value::Integer(u32::from_ne_bytes(fixed(bytes)).into()),
        Primitive::U64 => Value::Integer(u64::from_ne_bytes(fixed(bytes)).into()),
        Primitive::I8 => Value::Integer((bytes[0] as i8).into()),
        Primitive::I16 => Value::Integer(i16::from_ne_bytes(fixed(bytes)).into()),
        Primitive::I32 => Value::Integer(i32::from_ne_bytes(fixed(bytes)).into()),
        Primitive::I64 => Value::Integer(i64::from_ne_bytes(fixed(bytes)).into()),
        Primitive::F32 => Value::Float(f32::from_ne_bytes(fixed(bytes)).into()),
        Primitive::F64 => Value::Float(f64::from_ne_bytes(fixed(bytes))),
    }
}
