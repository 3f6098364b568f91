//! Interfaces of messages of which nothing is known but their definition.

use std::sync::{Mutex, PoisonError};

use slate_blackboard::interface::{Descriptor, Field, Kind, schema_hash};
use slate_sorted::SortedMap;

use super::schema::{Count, Item};
use super::{Error, Primitive, Schema, Value};

/// Conversion of a definition's messages to values of the blackboard.
/// Lists and texts have room for the longest that was [noted](Described::note); the longest list of numbers of the
/// whole is the tail.
#[derive(Debug)]
pub struct Described {
    name: String,
    schema: Schema,
    extent: Extent,
    made: Option<BuiltInterface>,
}

/// Space that a type needs.
#[derive(Clone, Debug)]
enum Extent {
    Number(Primitive),
    Text(usize),
    Array(Box<Extent>, usize),
    Sequence(Box<Extent>, usize),
    Message(String, Vec<(String, Extent)>),
}

#[derive(Clone, Copy, Debug)]
struct BuiltInterface {
    descriptor: &'static Descriptor,
    /// Items in the longest tail.
    capacity: usize,
}

/// Interfaces made so far, so that the same one is made once.
static KNOWN_INTERFACES: Mutex<SortedMap<String, BuiltInterface>> = Mutex::new(SortedMap::new());

/// Maximum size of a value, bytes.
const MAX_VALUE_SIZE: usize = 64 << 20;

/// Maximum number of fields of a message, including its nested messages.
const MAX_FIELDS: usize = 10_000;

/// Shorter lists are no tail, bytes.
const MAX_INLINE_LIST: usize = 1024;

impl Described {
    /// Returns the messages of a schema with that name, such as `sensor_msgs/msg/Imu`.
    ///
    /// # Errors
    /// When they have too many fields.
    pub fn new(name: &str, schema: Schema) -> Result<Self, String> {
        let name = name.rsplit('/').next().unwrap_or(name).to_owned();
        let mut room = MAX_FIELDS;
        let extent = Extent::of(&schema, 0, &mut room);
        let extent = extent
            .ok_or_else(|| format!("{name} has more than {MAX_FIELDS} fields with those of all in it"))?;
        Ok(Self { name, schema, extent, made: None })
    }

    /// Notes the size of a message's lists and texts.
    ///
    /// # Errors
    /// When it is no such message.
    pub fn note(&mut self, message: &[u8]) -> Result<(), Error> {
        let value = self.schema.decode(message)?;
        self.extent.note(&value);
        Ok(())
    }

    /// Returns the interface for all noted messages, and its longest tail's length.
    /// The length is in items. The interface is kept for ever, because all that is on a blackboard refers to it.
    ///
    /// # Errors
    /// When values would be too large.
    pub fn interface(&mut self) -> Result<(&'static Descriptor, usize), String> {
        let made = match self.made {
            Some(made) => made,
            None => {
                if self.extent.size() > MAX_VALUE_SIZE {
                    return Err(format!("a value of {} takes more than {MAX_VALUE_SIZE} bytes", self.name));
                }
                let key = format!("{} {:?}", self.name, self.extent);
                let mut known = KNOWN_INTERFACES.lock().unwrap_or_else(PoisonError::into_inner);
                let made = *known.entry(key).or_insert_with(|| self.extent.make(&self.name));
                *self.made.insert(made)
            }
        };
        Ok((made.descriptor, made.capacity))
    }

    /// Returns the value of a noted message in its memory layout.
    ///
    /// # Errors
    /// When it is no such message.
    pub fn decode(&self, message: &[u8]) -> Result<Vec<u8>, Error> {
        let value = self.schema.decode(message)?;
        let descriptor = self.made.map_or(&EMPTY_INTERFACE, |made| made.descriptor);
        let mut bytes = vec![0; descriptor.size];
        put_message(descriptor, &value, &mut bytes);
        if let Some(field) = descriptor.fields.last()
            && let (Kind::Tail(_), Some(Value::Numbers(numbers))) = (field.kind, value.get(field.name))
        {
            bytes.extend(numbers.bytes());
        }
        Ok(bytes)
    }
}

static EMPTY_INTERFACE: Descriptor =
    Descriptor { name: "Nothing", doc: "", ros: "", fields: &[], size: 0, align: 1, hash: 0 };

impl Extent {
    /// Returns the space of an empty message; `None` if it has too many fields.
    fn of(schema: &Schema, index: usize, room: &mut usize) -> Option<Self> {
        let record = &schema.records()[index];
        let mut fields = Vec::new();
        for (name, field) in record.names.iter().zip(&record.types) {
            *room = room.checked_sub(1)?;
            let item = match field.item {
                Item::Primitive(kind) => Self::Number(kind),
                Item::Text => Self::Text(0),
                Item::Record(index) => Self::of(schema, index, room)?,
            };
            let extent = match field.count {
                Count::One => item,
                Count::Fixed(count) => Self::Array(Box::new(item), count),
                Count::Any => Self::Sequence(Box::new(item), 0),
            };
            fields.push((name.clone(), extent));
        }
        let name = record.name.rsplit('/').next().unwrap_or_default().to_owned();
        Some(Self::Message(name, fields))
    }

    fn note(&mut self, value: &Value) {
        match (self, value) {
            (Self::Text(room), Value::Text(text)) => *room = (*room).max(text.len()),
            (Self::Sequence(_, room), Value::Numbers(numbers)) => *room = (*room).max(numbers.len()),
            (Self::Sequence(item, room), Value::List(items)) => {
                *room = (*room).max(items.len());
                items.iter().for_each(|value| item.note(value));
            }
            (Self::Array(item, _), Value::List(items)) => items.iter().for_each(|value| item.note(value)),
            (Self::Message(_, fields), Value::Map(map)) => {
                for ((_, extent), (_, value)) in fields.iter_mut().zip(map.iter()) {
                    extent.note(value);
                }
            }
            _ => {}
        }
    }

    /// Returns the approximate size of a value, bytes.
    fn size(&self) -> usize {
        match self {
            Self::Number(kind) => kind.size(),
            Self::Text(room) => room.saturating_add(8),
            Self::Array(item, count) => item.size().saturating_mul(*count),
            Self::Sequence(item, room) => item.size().saturating_mul(*room).saturating_add(8),
            Self::Message(_, fields) => fields
                .iter()
                .map(|(_, extent)| extent.size().saturating_add(8))
                .fold(0, usize::saturating_add),
        }
    }

    fn kind(&self) -> Kind {
        match self {
            Self::Number(kind) => Kind::Primitive(*kind),
            // So that what follows needs no padding.
            Self::Text(room) => Kind::Text(room.next_multiple_of(4)),
            Self::Array(item, count) => Kind::Array(kept(item.kind()), *count),
            Self::Sequence(item, room) => {
                let item = item.kind();
                let whole = room.next_multiple_of((8 / item.size().max(1)).max(1));
                Kind::Sequence(kept(item), whole)
            }
            Self::Message(name, fields) => Kind::Nested(descriptor(name, fields, None)),
        }
    }

    fn make(&self, name: &str) -> BuiltInterface {
        let Self::Message(_, fields) = self else {
            return BuiltInterface { descriptor: &EMPTY_INTERFACE, capacity: 0 };
        };
        let lists = fields.iter().enumerate().filter_map(|(index, (_, extent))| match extent {
            Self::Sequence(item, room) if matches!(**item, Self::Number(_)) => {
                Some((item.size() * room, index, *room))
            }
            _ => None,
        });
        let tail = lists.max().filter(|(bytes, ..)| *bytes > MAX_INLINE_LIST);
        let descriptor = descriptor(name, fields, tail.map(|(_, index, _)| index));
        BuiltInterface { descriptor, capacity: tail.map_or(0, |(.., room)| room) }
    }
}

/// Lays fields out without padding between them.
/// Those of the largest alignment are first, the tail is last.
fn descriptor(name: &str, fields: &[(String, Extent)], tail: Option<usize>) -> &'static Descriptor {
    let mut kinds: Vec<_> = fields
        .iter()
        .enumerate()
        .filter(|(index, _)| tail != Some(*index))
        .map(|(_, (name, extent))| (name.as_str(), extent.kind()))
        .filter(|(_, kind)| kind.size() > 0)
        .collect();
    kinds.sort_by_key(|(_, kind)| std::cmp::Reverse(kind.align()));
    let tail = tail.map(|index| {
        let (name, extent) = &fields[index];
        let item =
            if let Extent::Sequence(item, _) = extent { item.kind() } else { Kind::Primitive(Primitive::U8) };
        (name.as_str(), Kind::Tail(kept(item)))
    });
    let align = kinds.iter().chain(&tail).map(|(_, kind)| kind.align()).max().unwrap_or(1);
    let (mut size, mut made) = (0_usize, Vec::new());
    let mut put = |name: &str, kind: Kind| {
        // Sizes are not multiples of alignments everywhere, as that of an array of three bytes.
        let offset = size.next_multiple_of(kind.align());
        if offset > size {
            made.push(field(&format!("padding_{size}"), size, Kind::Array(kept(Kind::U8), offset - size)));
        }
        made.push(field(name, offset, kind));
        size = offset + kind.size();
    };
    kinds.into_iter().for_each(|(name, kind)| put(name, kind));
    let end = size.next_multiple_of(align);
    if end > size {
        made.push(field(&format!("padding_{size}"), size, Kind::Array(kept(Kind::U8), end - size)));
    }
    made.extend(tail.map(|(name, kind)| field(name, end, kind)));
    let fields: &'static [Field] = made.leak();
    let name: &'static str = name.to_owned().leak();
    let hash = schema_hash(name, fields);
    kept(Descriptor { name, doc: "", ros: "", fields, size: end, align, hash })
}

fn field(name: &str, offset: usize, kind: Kind) -> Field {
    Field { name: name.to_owned().leak(), doc: "", unit: "", offset, kind }
}

fn kept<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

fn put_message(descriptor: &Descriptor, value: &Value, out: &mut [u8]) {
    for field in descriptor.fields {
        if let Some(value) = value.get(field.name) {
            put(&field.kind, value, &mut out[field.offset..]);
        }
    }
}

/// Writes a value at its offset; noted sizes fit.
fn put(kind: &Kind, value: &Value, out: &mut [u8]) {
    let copy = |bytes: &[u8], out: &mut [u8]| {
        let length = bytes.len().min(out.len());
        out[..length].copy_from_slice(&bytes[..length]);
    };
    let room = kind.size();
    match (kind, value) {
        (Kind::Nested(descriptor), value) => put_message(descriptor, value, out),
        (Kind::Text(room), Value::Text(text)) => {
            let length = text.len().min(*room);
            copy(&(length as u32).to_ne_bytes(), out);
            copy(&text.as_bytes()[..length], &mut out[4..]);
        }
        (Kind::Array(..), Value::Numbers(numbers)) => copy(numbers.bytes(), &mut out[..room]),
        (Kind::Array(item, count), Value::List(items)) => put_all(item, items, *count, out),
        (Kind::Sequence(_, most), Value::Numbers(numbers)) => {
            copy(&(numbers.len().min(*most) as u32).to_ne_bytes(), out);
            copy(numbers.bytes(), &mut out[8..room]);
        }
        (Kind::Sequence(item, most), Value::List(items)) => {
            copy(&(items.len().min(*most) as u32).to_ne_bytes(), out);
            put_all(item, items, *most, &mut out[8..]);
        }
        (_, Value::Bool(is)) => copy(&[u8::from(*is)], out),
        // The lowest bytes, in the order of the machine.
        (_, Value::Signed(number)) => low(&number.to_le_bytes()[..room.min(8)], out),
        (_, Value::Unsigned(number)) => low(&number.to_le_bytes()[..room.min(8)], out),
        (_, Value::Single(number)) => copy(&number.to_ne_bytes(), out),
        (_, Value::Double(number)) => copy(&number.to_ne_bytes(), out),
        _ => {}
    }
}

fn low(bytes: &[u8], out: &mut [u8]) {
    let own = &mut out[..bytes.len()];
    own.copy_from_slice(bytes);
    if cfg!(target_endian = "big") {
        own.reverse();
    }
}

fn put_all(item: &Kind, values: &[Value], most: usize, out: &mut [u8]) {
    for (index, value) in values.iter().take(most).enumerate() {
        put(item, value, &mut out[index * item.size()..]);
    }
}
