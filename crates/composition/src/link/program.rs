use slate_blackboard::interface::{Kind, Primitive};

use super::Place;
use super::number::Number;
use super::unit::{Factor, factor};

/// How a place of one value becomes a place of another; made when links are checked, and run without allocating.
#[derive(Clone, Debug)]
pub struct Program {
    from: Place,
    steps: Vec<Step>,
    /// The interval that a number must be in.
    range: Option<(f64, f64)>,
}

#[derive(Clone, Debug)]
enum Step {
    /// The same bytes.
    Copy { from: usize, to: usize, size: usize },
    /// A number of another width or unit.
    Number { from: (usize, Number), to: (usize, Number), factor: u64 },
    /// Text or a sequence with room for more: a length that may be damaged, and what it covers.
    List { from: usize, to: usize, head: usize, capacity: usize, item: (usize, usize), steps: Vec<Step> },
}

impl Program {
    /// Finds the way, or says why there is none that is exact.
    pub fn new(from: &Place, to: &Place) -> Result<Self, String> {
        let mut steps = Vec::new();
        convert(Part::of(from), Part::of(to), &mut steps)?;
        Ok(Self { from: from.clone(), steps, range: None })
    }

    /// Lets only numbers of a closed interval through.
    pub fn within(mut self, range: Option<(f64, f64)>) -> Self {
        self.range = range;
        self
    }

    /// Writes into `value`; false, and nothing is written, when the value has no such item or is out of range.
    #[inline]
    pub fn run(&self, bytes: &[u8], items: usize, value: &mut [u8]) -> bool {
        if !self.from.is_in(bytes, items) {
            return false;
        }
        if let (Some((low, high)), Some(number)) = (self.range, Number::of(&self.from.kind)) {
            let number = match self.steps.first() {
                Some(Step::Number { factor, .. }) => number.read(&bytes[self.from.offset..]).times(*factor),
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

impl Step {
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
struct Part {
    kind: Kind,
    unit: &'static str,
    offset: usize,
}

impl Part {
    fn of(place: &Place) -> Self {
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

fn convert(from: Part, to: Part, steps: &mut Vec<Step>) -> Result<(), String> {
    let copy = |size| Step::Copy { from: from.offset, to: to.offset, size };
    let other = || Err(format!("{} is not {}", from.describe(), to.describe()));
    if let (Some(source), Some(target)) = (Number::of(&from.kind), Number::of(&to.kind)) {
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
        steps.push(if source == target && factor == 1 {
            copy(from.kind.size())
        } else {
            Step::Number { from: (from.offset, source), to: (to.offset, target), factor }
        });
        return Ok(());
    }
    match (from.kind, to.kind) {
        (Kind::Nested(source), Kind::Nested(target)) if source.hash == target.hash => {
            // A tail is not a part of it.
            steps.push(copy(source.size));
        }
        (Kind::Nested(source), Kind::Nested(target)) => {
            for field in target.fields {
                let Some(known) = source.field(field.name) else {
                    return Err(format!(
                        "{} has no field `{}`, which {} has",
                        source.name, field.name, target.name
                    ));
                };
                let part = |whole: Part, field: &'static slate_blackboard::interface::Field| Part {
                    kind: field.kind,
                    unit: field.unit,
                    offset: whole.offset + field.offset,
                };
                convert(part(from, known), part(to, field), steps)
                    .map_err(|reason| format!("`{}`: {reason}", field.name))?;
            }
        }
        (Kind::Primitive(Primitive::Bool), Kind::Primitive(Primitive::Bool)) => steps.push(copy(1)),
        (Kind::Enumeration(source), Kind::Enumeration(target)) => {
            let named = |one: &slate_blackboard::interface::Enumeration| -> Vec<_> {
                one.constants.iter().map(|constant| (constant.name, constant.value)).collect()
            };
            let same = source.name == target.name && source.carrier.size() == target.carrier.size();
            if !same || named(source) != named(target) {
                return other();
            }
            steps.push(copy(from.kind.size()));
        }
        (Kind::Text(source), Kind::Text(target)) if source <= target => {
            let byte = vec![Step::Copy { from: 0, to: 0, size: 1 }];
            steps.push(list(from, to, 4, source, (1, 1), byte));
        }
        (Kind::Array(source, count), Kind::Array(target, room)) if count == room => {
            for i in 0..count {
                let at = |whole: Part, item: &Kind| Part {
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
        _ => return other(),
    }
    Ok(())
}

fn list(from: Part, to: Part, head: usize, capacity: usize, item: (usize, usize), steps: Vec<Step>) -> Step {
    Step::List { from: from.offset, to: to.offset, head, capacity, item, steps }
}
