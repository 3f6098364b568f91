use slate_blackboard::interface::{Descriptor, Enumeration, Field, Kind, Primitive};

use super::FieldPlace;
use super::number::Number;
use super::unit::{Factor, factor};

/// Conversion of a field of one value to a field of another.
/// Compiled when links are checked; runs without allocation.
#[derive(Clone, Debug)]
pub struct Program {
    from: FieldPlace,
    steps: Vec<ConversionStep>,
    /// The interval that a number must be in.
    range: Option<(f64, f64)>,
}

#[derive(Clone, Debug)]
enum ConversionStep {
    /// The same bytes.
    Copy { from: usize, to: usize, size: usize },
    /// A number of another width or unit.
    Number { from: (usize, Number), to: (usize, Number), factor: u64 },
    /// Text or a sequence with larger capacity: a possibly invalid length, and items.
    List {
        from: usize,
        to: usize,
        head: usize,
        capacity: usize,
        item: (usize, usize),
        steps: Vec<ConversionStep>,
    },
}

impl Program {
    /// Finds an exact conversion; the error is the reason against it.
    pub fn new(from: &FieldPlace, to: &FieldPlace) -> Result<Self, String> {
        let mut steps = Vec::new();
        convert(ValuePart::of(from), ValuePart::of(to), &mut steps)?;
        Ok(Self { from: from.clone(), steps, range: None })
    }

    /// Restricts the conversion to numbers of a closed interval.
    pub fn within(mut self, range: Option<(f64, f64)>) -> Self {
        self.range = range;
        self
    }

    /// Writes the converted value into `value`.
    /// Returns false and writes nothing if the source value lacks the item or is out of range.
    #[inline]
    pub fn run(&self, bytes: &[u8], items: usize, value: &mut [u8]) -> bool {
        if !self.from.is_in(bytes, items) {
            return false;
        }
        if let (Some((low, high)), Some(number)) = (self.range, Number::of(&self.from.kind)) {
            let number = match self.steps.first() {
                Some(ConversionStep::Number { factor, .. }) => {
                    number.read(&bytes[self.from.offset..]).times(*factor)
                }
                _ => number.read(&bytes[self.from.offset..]),
            };
            if !(low..=high).contains(&number.as_f64()) {
                return false;
            }
        }
        self.steps.iter().for_each(|step| step.run(bytes, value));
        true
    }
}

impl ConversionStep {
    fn run(&self, bytes: &[u8], value: &mut [u8]) {
        match self {
            Self::Copy { from, to, size } => {
                value[*to..to + size].copy_from_slice(&bytes[*from..from + size])
            }
            Self::Number { from, to, factor } => {
                to.1.write(from.1.read(&bytes[from.0..]).times(*factor), &mut value[to.0..]);
            }
            Self::List { from, to, head, capacity, item, steps } => {
                let mut length = [0; 4];
                length.copy_from_slice(&bytes[*from..from + 4]);
                let count = (u32::from_ne_bytes(length) as usize).min(*capacity);
                value[*to..to + 4].copy_from_slice(&(count as u32).to_ne_bytes());
                for i in 0..count {
                    let (bytes, value) =
                        (&bytes[from + head + i * item.0..], &mut value[to + head + i * item.1..]);
                    steps.iter().for_each(|step| step.run(bytes, value));
                }
            }
        }
    }
}

/// A part of a value, at an offset.
#[derive(Clone, Copy)]
struct ValuePart {
    kind: Kind,
    unit: &'static str,
    offset: usize,
}

impl ValuePart {
    fn of(place: &FieldPlace) -> Self {
        Self { kind: place.kind, unit: place.unit, offset: place.offset }
    }

    fn item(self, kind: &Kind) -> Self {
        Self { kind: *kind, offset: 0, ..self }
    }

    fn describe(self) -> String {
        if self.unit.is_empty() {
            self.kind.describe()
        } else {
            format!("{} in {}", self.kind.describe(), self.unit)
        }
    }
}

/// Adds the steps from one part to another; the error is the reason against it.
fn convert(from: ValuePart, to: ValuePart, steps: &mut Vec<ConversionStep>) -> Result<(), String> {
    if let (Some(source), Some(target)) = (Number::of(&from.kind), Number::of(&to.kind)) {
        steps.push(number((from, source), (to, target))?);
        return Ok(());
    }
    match (from.kind, to.kind) {
        (Kind::Nested(source), Kind::Nested(target)) if source.hash == target.hash => {
            // A tail is not a part of it.
            steps.push(copy(from, to, source.size));
        }
        (Kind::Nested(source), Kind::Nested(target)) => fields((from, source), (to, target), steps)?,
        (Kind::Primitive(Primitive::Bool), Kind::Primitive(Primitive::Bool)) => steps.push(copy(from, to, 1)),
        (Kind::Enumeration(source), Kind::Enumeration(target)) if is_same(source, target) => {
            steps.push(copy(from, to, from.kind.size()));
        }
        (Kind::Text(source), Kind::Text(target)) if source <= target => {
            let byte = vec![ConversionStep::Copy { from: 0, to: 0, size: 1 }];
            steps.push(list(from, to, 4, source, (1, 1), byte));
        }
        (Kind::Array(source, count), Kind::Array(target, room)) if count == room => {
            for i in 0..count {
                let at = |whole: ValuePart, item: &Kind| ValuePart {
                    offset: whole.offset + i * item.size(),
                    ..whole.item(item)
                };
                convert(at(from, source), at(to, target), steps)?;
            }
        }
        (Kind::Sequence(source, count), Kind::Sequence(target, room)) if count <= room => {
            let mut item = Vec::new();
            convert(from.item(source), to.item(target), &mut item)?;
            steps.push(list(from, to, 8, count, (source.size(), target.size()), item));
        }
        (Kind::Optional(source), Kind::Optional(target)) => {
            let mut item = Vec::new();
            convert(from.item(source), to.item(target), &mut item)?;
            steps.push(list(from, to, 8, 1, (source.size(), target.size()), item));
        }
        (Kind::Text(_), Kind::Text(_)) | (Kind::Sequence(..), Kind::Sequence(..)) => {
            return Err(format!("{} has no room for {}", to.describe(), from.describe()));
        }
        (Kind::Tail(_), _) | (_, Kind::Tail(_)) => {
            return Err("a list of open length is only linked as a part of its whole interface".into());
        }
        _ => return Err(format!("{} is not {}", from.describe(), to.describe())),
    }
    Ok(())
}

/// Converts a number to another width or unit, if every value is exact.
fn number(
    (from, source): (ValuePart, Number),
    (to, target): (ValuePart, Number),
) -> Result<ConversionStep, String> {
    let factor = match factor(from.unit, to.unit) {
        Factor::Whole(factor) => factor,
        Factor::Fraction => {
            return Err(format!("{} would be rounded to be {}", from.describe(), to.describe()));
        }
        Factor::None => {
            let unit = |unit: &'static str| if unit.is_empty() { "no unit" } else { unit };
            return Err(format!(
                "{} has {}, and {} has {}, without an exact factor between them",
                from.kind.describe(),
                unit(from.unit),
                to.kind.describe(),
                unit(to.unit)
            ));
        }
    };
    if !target.holds(source, factor) {
        return Err(format!("{} does not hold every {} exactly", to.describe(), from.describe()));
    }
    Ok(if source == target && factor == 1 {
        copy(from, to, from.kind.size())
    } else {
        ConversionStep::Number { from: (from.offset, source), to: (to.offset, target), factor }
    })
}

/// Converts each field of the target from the source's field of the same name.
fn fields(
    (from, source): (ValuePart, &Descriptor),
    (to, target): (ValuePart, &Descriptor),
    steps: &mut Vec<ConversionStep>,
) -> Result<(), String> {
    for field in target.fields {
        let Some(known) = source.field(field.name) else {
            return Err(format!("{} has no field `{}`, which {} has", source.name, field.name, target.name));
        };
        let part = |whole: ValuePart, field: &Field| ValuePart {
            kind: field.kind,
            unit: field.unit,
            offset: whole.offset + field.offset,
        };
        convert(part(from, known), part(to, field), steps)
            .map_err(|reason| format!("`{}`: {reason}", field.name))?;
    }
    Ok(())
}

/// Returns whether two enumerations have the same name, size and constants.
fn is_same(source: &Enumeration, target: &Enumeration) -> bool {
    let named = |one: &Enumeration| -> Vec<_> {
        one.constants.iter().map(|constant| (constant.name, constant.value)).collect()
    };
    source.name == target.name
        && source.carrier.size() == target.carrier.size()
        && named(source) == named(target)
}

fn copy(from: ValuePart, to: ValuePart, size: usize) -> ConversionStep {
    ConversionStep::Copy { from: from.offset, to: to.offset, size }
}

fn list(
    from: ValuePart,
    to: ValuePart,
    head: usize,
    capacity: usize,
    item: (usize, usize),
    steps: Vec<ConversionStep>,
) -> ConversionStep {
    ConversionStep::List { from: from.offset, to: to.offset, head, capacity, item, steps }
}
