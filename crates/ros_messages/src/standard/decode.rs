//! Values of interfaces from the messages that ROS has for them.

use slate_blackboard::interface::{Descriptor, Enumeration, Kind};

use super::source::Scalar;
use super::{
    EncodeStep, FieldLocation, Items, MessageStep, NumberSource, Primitive, RosPrimitive, Standard,
    TextSource,
};
use crate::{Error, Value};

impl Standard {
    /// Checks that a message carries all fields of a value.
    /// Only then can [`decode`](Standard::decode) read it.
    ///
    /// # Errors
    /// The field of the interface that no message carries, in words.
    pub fn check_decodable(&self) -> Result<(), String> {
        let mut carried = vec![false; self.descriptor.size];
        let mut has_tail = self.descriptor.tail().is_none();
        self.steps.iter().for_each(|step| note(&step.encode, &mut carried, &mut has_tail));
        let missing = missing_field(self.descriptor, 0, &carried)
            .or_else(|| self.descriptor.fields.last().filter(|_| !has_tail).map(|tail| tail.name.into()));
        match missing {
            Some(field) => {
                let Self { descriptor, definition, .. } = self;
                Err(format!(
                    "{} can't be read from {}, which does not tell `{field}`",
                    descriptor.name, definition.name
                ))
            }
            None => Ok(()),
        }
    }

    /// Decodes the value of a message; CDR may have either byte order.
    /// Fields that the interface lacks are left out; a rotation in space becomes the one around z.
    ///
    /// # Errors
    /// When it is no such message, or the interface has no room for its lists and texts.
    pub fn decode(&self, message: &[u8]) -> Result<Vec<u8>, Error> {
        let message = self.schema.decode_in(self.format, message)?;
        let mut value = DecodedValue { bytes: vec![0; self.descriptor.size], tail: Vec::new() };
        fill(&self.steps, "", &message, &mut value)?;
        value.bytes.extend(value.tail);
        Ok(value.bytes)
    }
}

/// A value, or an item of a list in it.
struct DecodedValue {
    bytes: Vec<u8>,
    tail: Vec<u8>,
}

/// Marks the bytes of a value that a message carries, by the first of each field.
fn note(step: &EncodeStep, carried: &mut [bool], has_tail: &mut bool) {
    let mut mark = |offset: usize| carried[offset] = true;
    match step {
        EncodeStep::Number(_, NumberSource::Field(location) | NumberSource::HalfSine(location)) => {
            mark(location.1)
        }
        EncodeStep::Stamp(Some((time, unless))) => {
            [time, unless].iter().for_each(|location| mark(location.1))
        }
        EncodeStep::Text(TextSource::Field(offset, _) | TextSource::Named(offset, _)) => mark(*offset),
        EncodeStep::Text(TextSource::Name(location, _)) => mark(location.1),
        EncodeStep::Listed(_, locations) => locations.iter().for_each(|location| mark(location.1)),
        EncodeStep::Covariance(start) => mark(*start),
        EncodeStep::List { count, start, .. } | EncodeStep::TextList { count, start, .. } => {
            note_items(*count, *start, mark, has_tail);
        }
        EncodeStep::Messages { count, start, item, steps, .. } => {
            let mut carried = vec![false; item.size];
            steps.iter().for_each(|step| note(&step.encode, &mut carried, &mut false));
            if missing_field(item, 0, &carried).is_none() {
                note_items(*count, *start, mark, has_tail);
            }
        }
        _ => {}
    }
}

fn note_items(count: Items, start: usize, mut mark: impl FnMut(usize), has_tail: &mut bool) {
    match count {
        Items::Fixed(_) => mark(start),
        Items::Counted(offset, _) => mark(offset),
        Items::Tail => *has_tail = true,
    }
}

/// Returns the path of the first field that the message does not carry.
fn missing_field(descriptor: &Descriptor, offset: usize, carried: &[bool]) -> Option<String> {
    descriptor.fields.iter().find_map(|field| match field.kind {
        Kind::Tail(_) => None,
        Kind::Nested(inner) => {
            let own = missing_field(inner, offset + field.offset, carried)?;
            Some(format!("{}/{own}", field.name))
        }
        _ => (!carried.get(offset + field.offset)?).then(|| field.name.to_owned()),
    })
}

fn fill(steps: &[MessageStep], prefix: &str, message: &Value, value: &mut DecodedValue) -> Result<(), Error> {
    // The names of items in a list, as they are here and there.
    let mut names: (&[&str], Vec<&str>) = (&[], Vec::new());
    for step in steps {
        let path = step.field.strip_prefix(prefix).unwrap_or(&step.field).trim_start_matches('/');
        let Some(field) = field_at(message, path) else { continue };
        let wrong = |reason: String| Error::Field { field: step.field.clone(), reason };
        match &step.encode {
            EncodeStep::Number(_, NumberSource::Field(location)) => {
                value.store(location, number(field).ok_or_else(|| wrong("is not a number".into()))?);
            }
            EncodeStep::Number(_, NumberSource::HalfSine(location)) => {
                let cosine = path.strip_suffix('z').and_then(|turn| field_at(message, &format!("{turn}w")));
                value.store(location, Scalar::Float(angle(field, cosine)));
            }
            EncodeStep::Stamp(Some((time, unless))) => {
                value.store(time, Scalar::Whole(nanoseconds(field)));
                value.store(unless, Scalar::Whole(0));
            }
            EncodeStep::Text(TextSource::Field(offset, capacity) | TextSource::Named(offset, capacity)) => {
                value.text(*offset, *capacity, field.as_str().unwrap_or_default()).map_err(wrong)?;
            }
            EncodeStep::Text(TextSource::Name(location, enumeration)) => {
                let number = constant(enumeration, field.as_str().unwrap_or_default()).map_err(wrong)?;
                value.store(location, Scalar::Whole(number));
            }
            EncodeStep::Texts(expected) => {
                let Value::List(items) = field else { continue };
                names = (expected, items.iter().filter_map(Value::as_str).collect());
            }
            EncodeStep::Listed(_, locations) => value.named(locations, &names, field).map_err(wrong)?,
            EncodeStep::Covariance(start) => value.covariance(*start, field),
            EncodeStep::List { count, start, from, .. } => {
                let Value::Numbers(numbers) = field else { continue };
                let start = value.room(*count, *start, numbers.len(), from.size()).map_err(wrong)?;
                for (item, own) in numbers.iter().enumerate() {
                    let scalar = number(&own).unwrap_or(Scalar::Whole(0));
                    store(*from, scalar, &mut value.memory(*count)[start + item * from.size()..]);
                }
            }
            EncodeStep::TextList { count, start, capacity, .. } => {
                let size = Kind::Text(*capacity).size();
                let Value::List(items) = field else { continue };
                let start = value.room(*count, *start, items.len(), size).map_err(wrong)?;
                for (item, own) in items.iter().enumerate() {
                    let text = own.as_str().unwrap_or_default();
                    store_text(*capacity, text, &mut value.memory(*count)[start + item * size..])
                        .map_err(wrong)?;
                }
            }
            EncodeStep::Messages { count, start, item: descriptor, steps, .. } => {
                let size = descriptor.size;
                let Value::List(items) = field else { continue };
                let start = value.room(*count, *start, items.len(), size).map_err(wrong)?;
                for (item, own) in items.iter().enumerate() {
                    let mut inner = DecodedValue { bytes: vec![0; size], tail: Vec::new() };
                    fill(steps, &step.field, own, &mut inner)?;
                    value.memory(*count)[start + item * size..][..size].copy_from_slice(&inner.bytes);
                }
            }
            _ => {}
        }
    }
    Ok(())
}

impl DecodedValue {
    fn store(&mut self, location: &FieldLocation, number: Scalar) {
        store(location.0, number, &mut self.bytes[location.1..]);
    }

    /// Returns the buffer of the items of a list.
    fn memory(&mut self, count: Items) -> &mut Vec<u8> {
        match count {
            Items::Tail => &mut self.tail,
            Items::Fixed(_) | Items::Counted(..) => &mut self.bytes,
        }
    }

    /// Reserves space for the items of a list; returns its offset.
    fn room(&mut self, count: Items, start: usize, items: usize, size: usize) -> Result<usize, String> {
        match count {
            Items::Fixed(expected) if expected != items => {
                Err(format!("has {items} items, expected {expected}"))
            }
            Items::Fixed(_) => Ok(start),
            Items::Counted(_, capacity) if items > capacity => {
                Err(format!("has {items} items, and there is room for {capacity}"))
            }
            Items::Counted(offset, _) => {
                store(Primitive::U32, Scalar::Whole(items as i128), &mut self.bytes[offset..]);
                Ok(start)
            }
            Items::Tail => {
                self.tail = vec![0; items * size];
                Ok(0)
            }
        }
    }

    fn text(&mut self, offset: usize, capacity: usize, text: &str) -> Result<(), String> {
        store_text(capacity, text, &mut self.bytes[offset..])
    }

    /// Reads the numbers of items by their names.
    fn named(
        &mut self,
        locations: &[FieldLocation],
        (expected, names): &(&[&str], Vec<&str>),
        field: &Value,
    ) -> Result<(), String> {
        let Value::Numbers(numbers) = field else { return Ok(()) };
        for (location, name) in locations.iter().zip(*expected) {
            let index = names.iter().position(|own| own == name);
            let own = index.and_then(|index| numbers.get(index));
            let own = own.as_ref().and_then(number);
            self.store(location, own.ok_or_else(|| format!("has no number of `{name}`"))?);
        }
        Ok(())
    }

    /// Reads the covariance of x, y and the rotation around z from that in space.
    fn covariance(&mut self, start: usize, field: &Value) {
        const IN_SPACE: [usize; 3] = [0, 1, 5];
        let Value::Numbers(numbers) = field else { return };
        let pairs = IN_SPACE.iter().flat_map(|row| IN_SPACE.iter().map(move |column| 6 * row + column));
        for (index, location) in pairs.enumerate() {
            let own = numbers.get(location).as_ref().and_then(number).unwrap_or(Scalar::Whole(0));
            store(Primitive::F64, own, &mut self.bytes[start + 8 * index..]);
        }
    }
}

/// Returns the field at a path.
fn field_at<'a>(value: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('/').filter(|name| !name.is_empty()).try_fold(value, |value, name| value.get(name))
}

fn number(value: &Value) -> Option<Scalar> {
    match value {
        Value::Bool(own) => Some(Scalar::Whole((*own).into())),
        Value::Signed(own) => Some(Scalar::Whole((*own).into())),
        Value::Unsigned(own) => Some(Scalar::Whole((*own).into())),
        Value::Single(own) => Some(Scalar::Float((*own).into())),
        Value::Double(own) => Some(Scalar::Float(*own)),
        _ => None,
    }
}

/// Returns the rotation around z of a quaternion, in (-pi, pi].
fn angle(sine: &Value, cosine: Option<&Value>) -> f64 {
    let float = |value: Option<&Value>| value.and_then(Value::as_f64).unwrap_or(0.0);
    let angle = 2.0 * libm::atan2(float(Some(sine)), float(cosine));
    let turn = std::f64::consts::TAU;
    match () {
        () if angle > std::f64::consts::PI => angle - turn,
        () if angle <= -std::f64::consts::PI => angle + turn,
        () => angle,
    }
}

fn nanoseconds(stamp: &Value) -> i128 {
    let part = |name: &str| stamp.get(name).and_then(Value::as_integer).unwrap_or(0);
    part("sec") * 1_000_000_000 + part("nanosec")
}

fn constant(enumeration: &Enumeration, name: &str) -> Result<i128, String> {
    let constants = enumeration.constants.iter();
    let mut found = constants.clone().filter(|constant| constant.name.eq_ignore_ascii_case(name));
    let names =
        || constants.map(|constant| constant.name.to_ascii_lowercase()).collect::<Vec<_>>().join(", ");
    let known = found.next().map(|constant| constant.value.into());
    known.ok_or_else(|| {
        let name: String = name.chars().take(40).collect();
        format!("is {name:?}, expected one of {}", names())
    })
}

/// Writes a text into memory.
fn store_text(capacity: usize, text: &str, memory: &mut [u8]) -> Result<(), String> {
    if text.len() > capacity {
        return Err(format!("has {} bytes of text, and there is room for {capacity}", text.len()));
    }
    store(Primitive::U32, Scalar::Whole(text.len() as i128), memory);
    memory[4..][..text.len()].copy_from_slice(text.as_bytes());
    Ok(())
}

/// Writes the nearest that a type can hold into memory.
fn store(kind: Primitive, number: Scalar, memory: &mut [u8]) {
    let mut put = |bytes: &[u8]| memory[..bytes.len()].copy_from_slice(bytes);
    match kind {
        Primitive::F32 => put(&(number.float() as f32).to_ne_bytes()),
        Primitive::F64 => put(&number.float().to_ne_bytes()),
        Primitive::Bool => put(&[u8::from(number.float() != 0.0)]),
        whole => {
            let number = match number {
                Scalar::Whole(number) => number,
                Scalar::Float(number) => number as i128,
            };
            let number = number.clamp(*whole.range().start(), *whole.range().end());
            match whole.size() {
                1 => put(&(number as u8).to_ne_bytes()),
                2 => put(&(number as u16).to_ne_bytes()),
                4 => put(&(number as u32).to_ne_bytes()),
                _ => put(&(number as u64).to_ne_bytes()),
            }
        }
    }
}
