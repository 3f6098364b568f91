//! Numbers of several properties, read at once.

use std::sync::Arc;

use pyo3::prelude::*;
use slate_blackboard::interface::{Descriptor, Kind, Primitive};
use slate_blackboard::{Board, Property};

use crate::columns::dtype;

/// Numbers of several properties, read at once.
#[pyclass(frozen, module = "slate._slate")]
pub struct Probe {
    parts: Vec<ProbedProperty>,
    /// Number of numbers.
    #[pyo3(get)]
    length: usize,
}

/// Property with the numbers that are read from it.
struct ProbedProperty {
    property: Arc<Property>,
    fields: Vec<ProbedField>,
}

/// Place of numbers in a property and in the result.
struct ProbedField {
    span: NumberSpan,
    at: usize,
    width: usize,
}

impl Probe {
    pub fn new(board: &Board, fields: Vec<(String, Option<usize>)>) -> Result<Self, String> {
        let mut probe = Self { parts: Vec::new(), length: 0 };
        for (url, sectors) in fields {
            let (property, span) = find(board, &url)?;
            let width = match (sectors, &span.count) {
                (Some(sectors), _) => sectors,
                (None, SpanCount::Fixed(count)) => *count,
                (None, _) => {
                    let newest = property.newest().map_err(|error| error.to_string())?;
                    let (bytes, items, _) = newest.ok_or_else(|| {
                        format!("{url} has no value yet, so its length is unknown: make a cycle first, or name the number of sectors")
                    })?;
                    span.count(&bytes, items)
                }
            };
            let own = ProbedField { span, at: probe.length, width };
            probe.length += width;
            match probe.parts.iter_mut().find(|part| Arc::ptr_eq(&part.property, &property)) {
                Some(part) => part.fields.push(own),
                None => probe.parts.push(ProbedProperty { property, fields: vec![own] }),
            }
        }
        Ok(probe)
    }

    pub fn scratch(&self) -> Vec<f64> {
        vec![f64::NAN; self.length]
    }

    /// Reads the newest numbers; NaN where no value was written yet.
    pub fn read(&self, numbers: &mut [f64]) {
        for part in &self.parts {
            let Ok(Some((bytes, items, _))) = part.property.newest() else { continue };
            for field in &part.fields {
                field.read(&bytes, items, &mut numbers[field.at..field.at + field.width]);
            }
        }
    }
}

/// Finds a field or list of numbers, such as `/r2/sonar/value/echoes/*/range`.
fn find(board: &Board, url: &str) -> Result<(Arc<Property>, NumberSpan), String> {
    // `*` is not part of a path on the board.
    let path = url.trim_start_matches('/');
    let (place, _) = path.split_once("/*").unwrap_or((path, ""));
    let (property, field) = board.find(place).map_err(|error| error.to_string())?;
    let field = format!("{field}{}", &path[place.len()..]);
    let span = NumberSpan::find(property.descriptor(), field.trim_matches('/'));
    span.map(|span| (property, span)).map_err(|reason| format!("{url}: {reason}"))
}

/// Returns the newest numbers of a field or list: their type and their bytes.
/// The type has the name of numpy. `None` before the first write.
pub fn numbers(board: &Board, url: &str) -> Result<Option<(&'static str, Vec<u8>)>, String> {
    let (property, span) = find(board, url)?;
    let newest = property.newest().map_err(|error| error.to_string())?;
    let Some((bytes, items, _)) = newest else { return Ok(None) };
    let (size, count) = (span.kind.size(), span.count(&bytes, items));
    let starts = (0..count).map(|index| span.start + index * span.stride);
    let numbers = starts.filter_map(|start| bytes.get(start..start + size)).flatten().copied();
    Ok(Some((dtype(span.kind), numbers.collect())))
}

impl ProbedField {
    /// Reads numbers.
    /// Of a list with more of them than places, it reads the least of each sector.
    fn read(&self, bytes: &[u8], items: usize, numbers: &mut [f64]) {
        let count = self.span.count(bytes, items);
        if count <= self.width {
            for (index, number) in numbers.iter_mut().take(count).enumerate() {
                *number = self.span.number(bytes, index);
            }
            return;
        }
        for (sector, number) in numbers.iter_mut().enumerate() {
            let beams = sector * count / self.width..(sector + 1) * count / self.width;
            let least = beams.map(|index| self.span.number(bytes, index)).fold(f64::INFINITY, least);
            *number = least;
        }
    }
}

fn least(one: f64, other: f64) -> f64 {
    if other < one { other } else { one }
}

/// Numbers at one place of an interface.
/// The place is a field, or a field of each item of a list.
struct NumberSpan {
    kind: Primitive,
    /// Offset of the first one, bytes.
    start: usize,
    /// Distance from one to the next, bytes.
    stride: usize,
    count: SpanCount,
}

enum SpanCount {
    Fixed(usize),
    /// List with its length at an offset.
    Sequence {
        length: usize,
        capacity: usize,
    },
    Tail,
}

impl NumberSpan {
    /// Finds a path such as `x`, `ranges` or `echoes/*/range`.
    fn find(descriptor: &'static Descriptor, path: &str) -> Result<Self, String> {
        let mut place = Kind::Nested(descriptor);
        let (mut start, mut list) = (0, None);
        let mut names = path.split('/').filter(|name| !name.is_empty());
        loop {
            let item = match place {
                Kind::Primitive(kind) => return Ok(Self::new(kind, start, list)),
                Kind::Enumeration(enumeration) => {
                    place = enumeration.carrier;
                    continue;
                }
                Kind::Nested(inner) => {
                    let known: Vec<_> = inner.fields.iter().map(|field| field.name).collect();
                    let known = known.join(", ");
                    let name =
                        names.next().ok_or_else(|| format!("name a field of {}: {known}", inner.name))?;
                    let field = inner.field(name);
                    let field = field
                        .ok_or_else(|| format!("{} has no field `{name}`; it has {known}", inner.name))?;
                    (start, place) = (start + field.offset, field.kind);
                    continue;
                }
                Kind::Array(item, count) => (item, SpanCount::Fixed(count)),
                Kind::Sequence(item, capacity) => {
                    let length = start;
                    start += 8;
                    (item, SpanCount::Sequence { length, capacity })
                }
                Kind::Tail(item) => (item, SpanCount::Tail),
                Kind::Text(_) | Kind::Optional(_) => {
                    return Err(format!(
                        "expected a number or a list of numbers, found {}",
                        place.describe()
                    ));
                }
            };
            match names.next() {
                None | Some("*") if list.is_none() => list = Some((item.0.size(), item.1)),
                Some(index) => {
                    let index = index
                        .parse::<usize>()
                        .map_err(|_| format!("expected `*` or an index, found `{index}`"))?;
                    let SpanCount::Fixed(count) = item.1 else {
                        return Err(
                            "one item of a list of any length can't be named: name all of them by `*`".into(),
                        );
                    };
                    if index >= count {
                        return Err(format!(
                            "the index {index} is beyond the last one, {}",
                            count.saturating_sub(1)
                        ));
                    }
                    start += index * item.0.size();
                }
                None => return Err("lists in lists are no row of numbers".into()),
            }
            place = *item.0;
        }
    }

    fn new(kind: Primitive, start: usize, list: Option<(usize, SpanCount)>) -> Self {
        let (stride, count) = list.unwrap_or((0, SpanCount::Fixed(1)));
        Self { kind, start, stride, count }
    }

    fn count(&self, bytes: &[u8], items: usize) -> usize {
        match self.count {
            SpanCount::Fixed(count) => count,
            SpanCount::Tail => items,
            SpanCount::Sequence { length, capacity } => {
                let bytes = bytes.get(length..length + 4).and_then(|bytes| bytes.try_into().ok());
                bytes.map_or(0, |bytes| u32::from_ne_bytes(bytes) as usize).min(capacity)
            }
        }
    }

    /// Returns one number; NaN beyond the memory.
    fn number(&self, bytes: &[u8], index: usize) -> f64 {
        let start = self.start + index * self.stride;
        let Some(bytes) = bytes.get(start..start + self.kind.size()) else { return f64::NAN };
        macro_rules! number {
            ($type:ty) => {
                bytes.try_into().map_or(f64::NAN, |bytes| <$type>::from_ne_bytes(bytes) as f64)
            };
        }
        match self.kind {
            Primitive::Bool | Primitive::U8 => f64::from(bytes[0]),
            Primitive::I8 => number!(i8),
            Primitive::U16 => number!(u16),
            Primitive::I16 => number!(i16),
            Primitive::U32 => number!(u32),
            Primitive::I32 => number!(i32),
            Primitive::U64 => number!(u64),
            Primitive::I64 => number!(i64),
            Primitive::F32 => number!(f32),
            Primitive::F64 => number!(f64),
        }
    }
}
