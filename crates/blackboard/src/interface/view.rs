use serde::{Serialize, Serializer};

use super::{Descriptor, Interface, Kind, Primitive, Value, clear_padding};

/// A value of any interface, read through its descriptor.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    descriptor: &'static Descriptor,
    bytes: &'a [u8],
    items: usize,
}

impl<'a> View<'a> {
    /// A view of `bytes`, which hold a value of that interface with `items` tail items.
    ///
    /// Returns nothing when there are too few bytes.
    pub fn new(descriptor: &'static Descriptor, bytes: &'a [u8], items: usize) -> Option<Self> {
        let item = descriptor.tail().map_or(0, Kind::size);
        let needed = item.checked_mul(items).and_then(|tail| tail.checked_add(descriptor.size))?;
        (bytes.len() >= needed).then_some(Self { descriptor, bytes, items })
    }

    /// A view of a typed value without a tail, whose padding is zeroed.
    pub fn of<T: Interface>(value: &'a mut T) -> Self {
        let data = std::ptr::from_mut(value).cast::<u8>();
        // SAFETY: the value is borrowed exclusively. Its fields are initialised, and so is its padding once it is zeroed:
        // nothing writes the value as a whole while the view lasts.
        let bytes = unsafe {
            clear_padding(T::DESCRIPTOR, data, 0);
            std::slice::from_raw_parts(data, size_of::<T>())
        };
        Self { descriptor: T::DESCRIPTOR, bytes, items: 0 }
    }

    /// What the bytes hold.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// The memory of the value.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// The whole value as a table.
    pub fn value(&self) -> Value {
        table(self.descriptor, self.bytes, self.items)
    }

    /// The value at a path found by [`find`](super::find); indices beyond a sequence's length give nothing.
    pub fn at(&self, path: &super::FieldPath) -> Option<Value> {
        path.read(self.bytes, self.items)
    }
}

impl Serialize for View<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.value().serialize(serializer)
    }
}

fn table(descriptor: &Descriptor, bytes: &[u8], items: usize) -> Value {
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

/// The length that stands before a text or a sequence, clamped as a damaged value may hold anything.
pub(super) fn length(bytes: &[u8], capacity: usize) -> usize {
    (u32::from_ne_bytes(fixed(bytes)) as usize).min(capacity)
}

fn list(item: &Kind, bytes: &[u8], count: usize) -> Value {
    Value::List((0..count).map(|i| read(item, &bytes[i * item.size()..], 0)).collect())
}

pub(super) fn read(kind: &Kind, bytes: &[u8], tail_items: usize) -> Value {
    match kind {
        Kind::Primitive(Primitive::Bool) => Value::Bool(bytes[0] != 0),
        Kind::Primitive(Primitive::U8) => Value::Integer(bytes[0].into()),
        Kind::Primitive(Primitive::U16) => Value::Integer(u16::from_ne_bytes(fixed(bytes)).into()),
        Kind::Primitive(Primitive::U32) => Value::Integer(u32::from_ne_bytes(fixed(bytes)).into()),
        Kind::Primitive(Primitive::U64) => Value::Integer(u64::from_ne_bytes(fixed(bytes)).into()),
        Kind::Primitive(Primitive::I8) => Value::Integer((bytes[0] as i8).into()),
        Kind::Primitive(Primitive::I16) => Value::Integer(i16::from_ne_bytes(fixed(bytes)).into()),
        Kind::Primitive(Primitive::I32) => Value::Integer(i32::from_ne_bytes(fixed(bytes)).into()),
        Kind::Primitive(Primitive::I64) => Value::Integer(i64::from_ne_bytes(fixed(bytes)).into()),
        Kind::Primitive(Primitive::F32) => Value::Float(f32::from_ne_bytes(fixed(bytes)).into()),
        Kind::Primitive(Primitive::F64) => Value::Float(f64::from_ne_bytes(fixed(bytes))),
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
