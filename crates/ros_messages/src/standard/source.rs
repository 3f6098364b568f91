use slate_blackboard::interface::Enumeration;

use super::{Error, FieldLocation, Items, NumberSource, Primitive, RosPrimitive};
use crate::Value;
use crate::cdr::CdrWriter;

/// Number during the conversion of its type.
#[derive(Clone, Copy)]
pub(super) enum Scalar {
    Whole(i128),
    Float(f64),
}

impl Scalar {
    pub fn float(self) -> f64 {
        match self {
            Self::Whole(number) => number as f64,
            Self::Float(number) => number,
        }
    }
}

pub(super) fn scalar(kind: Primitive, memory: &[u8]) -> Scalar {
    match kind.value(memory) {
        Value::Bool(value) => Scalar::Whole(value.into()),
        Value::Signed(number) => Scalar::Whole(number.into()),
        Value::Unsigned(number) => Scalar::Whole(number.into()),
        Value::Single(number) => Scalar::Float(number.into()),
        Value::Double(number) => Scalar::Float(number),
        _ => Scalar::Whole(0),
    }
}

/// Writes the nearest that the type can hold.
pub(super) fn write(writer: &mut CdrWriter<'_>, kind: Primitive, number: Scalar) {
    match kind {
        Primitive::F32 => writer.numbers(&(number.float() as f32).to_ne_bytes(), 4),
        Primitive::F64 => writer.numbers(&number.float().to_ne_bytes(), 8),
        Primitive::Bool => writer.byte(u8::from(number.float() != 0.0)),
        whole => {
            let number = match number {
                Scalar::Whole(number) => number,
                Scalar::Float(number) => number as i128,
            };
            let number = number.clamp(*whole.range().start(), *whole.range().end());
            match whole.size() {
                1 => writer.byte(number as u8),
                2 => writer.numbers(&(number as u16).to_ne_bytes(), 2),
                4 => writer.numbers(&(number as u32).to_ne_bytes(), 4),
                _ => writer.numbers(&(number as u64).to_ne_bytes(), 8),
            }
        }
    }
}

pub(super) fn write_name(
    writer: &mut CdrWriter<'_>,
    number: Scalar,
    enumeration: &Enumeration,
) -> Result<(), Error> {
    let constant = enumeration.constants.iter().find(|constant| match number {
        Scalar::Whole(number) => i128::from(constant.value) == number,
        Scalar::Float(_) => false,
    });
    let name = constant.map_or("", |constant| constant.name);
    writer.begin_text(name.len())?;
    name.bytes().for_each(|letter| writer.byte(letter.to_ascii_lowercase()));
    writer.end_text();
    Ok(())
}

/// A value that steps read.
pub(super) struct ValueBytes<'a> {
    pub bytes: &'a [u8],
    pub tail: usize,
}

impl ValueBytes<'_> {
    pub fn read(&self, location: &FieldLocation) -> Scalar {
        scalar(location.0, &self.bytes[location.1..])
    }

    pub fn holds(&self, location: &FieldLocation) -> bool {
        self.read(location).float() != 0.0
    }

    pub fn count(&self, items: Items) -> usize {
        match items {
            Items::Fixed(count) => count,
            Items::Counted(offset, capacity) => self.length(offset).min(capacity),
            Items::Tail => self.tail,
        }
    }

    fn length(&self, offset: usize) -> usize {
        scalar(Primitive::U32, &self.bytes[offset..]).float() as usize
    }

    pub fn text(&self, offset: usize, capacity: usize) -> &str {
        let bytes = &self.bytes[offset + 4..][..self.length(offset).min(capacity)];
        match std::str::from_utf8(bytes) {
            Ok(text) => text,
            // The part before the first bad byte is valid by the error's contract.
            Err(error) => std::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or_default(),
        }
    }

    pub fn number(&self, number: &NumberSource) -> Scalar {
        let float = |location: &FieldLocation| self.read(location).float();
        match number {
            NumberSource::Constant(number) => Scalar::Float(*number),
            NumberSource::Field(location) => self.read(location),
            NumberSource::HalfSine(location) => Scalar::Float(libm::sin(float(location) / 2.0)),
            NumberSource::HalfCosine(location) => Scalar::Float(libm::cos(float(location) / 2.0)),
            NumberSource::When { number, holds } if self.holds(holds) => self.read(number),
            NumberSource::When { .. } => Scalar::Float(f64::INFINITY),
            NumberSource::Among(location, numbers) => {
                let own = numbers.get(float(location) as usize);
                Scalar::Float(own.or(numbers.last()).copied().unwrap_or(0.0))
            }
            NumberSource::Along { range, bearing } => Scalar::Float(float(range) * libm::cos(float(bearing))),
            NumberSource::Across { range, bearing } => {
                Scalar::Float(float(range) * libm::sin(float(bearing)))
            }
            NumberSource::Heard(cloud, times) => {
                Scalar::Float(cloud.echo_points(self).count() as f64 * times)
            }
            NumberSource::Last { first, step, items } => {
                let steps = self.count(*items).saturating_sub(1);
                Scalar::Float(float(first) + float(step) * steps as f64)
            }
        }
    }
}
