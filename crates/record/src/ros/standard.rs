use slate_blackboard::interface::{Descriptor, Enumeration, Kind, find};

use super::cdr::{Writer, wire_length};
use super::codec::items;
use super::messages::{Origin, RULES, text};
use super::schema::{Count, FieldType, Item};
use super::{Definition, Error, Primitive, Schema, Value};

/// How a value becomes the message that ROS has for it.
///
/// The message has what the value has: fields of the same name, and those that [are the same](standard) by another name. What
/// the value does not tell is 0, or what the message's definition wants for "unknown".
#[derive(Debug)]
pub struct Standard {
    descriptor: &'static Descriptor,
    definition: Definition,
    steps: Vec<Step>,
}

/// What is appended to a message, one after the other.
#[derive(Debug)]
enum Step {
    Number(Primitive, Number),
    Text(Text),
    Stamp(Option<(Place, Place)>),
    /// A list, with its length before it or without.
    List {
        kind: Primitive,
        counted: bool,
        count: Items,
        start: usize,
        from: Primitive,
    },
    /// A list of that many zeros; without a length unless it is empty.
    Zeros(Primitive, Option<usize>),
    /// A message without fields.
    Empty,
}

/// A number in a value: its type and offset.
#[derive(Clone, Copy, Debug)]
struct Place(Primitive, usize);

#[derive(Debug)]
enum Number {
    Constant(f64),
    Field(Place),
    HalfSine(Place),
    HalfCosine(Place),
    When { number: Place, holds: Place },
    Last { first: Place, step: Place, items: Items },
}

#[derive(Debug)]
enum Text {
    Constant(&'static str),
    Frame,
    /// Offset and capacity.
    Field(usize, usize),
    Name(Place, &'static Enumeration),
}

/// How many items a list of a value has.
#[derive(Clone, Copy, Debug)]
enum Items {
    Fixed(usize),
    /// The offset of its length, and its capacity.
    Counted(usize, usize),
    Tail,
}

/// The message that the interface says it is (`ros = "sensor_msgs/msg/LaserScan"`).
///
/// Returns nothing when it says none, or one that is not known here, or its fields don't fit that.
///
/// | message | what is not a field of the same name |
/// |---|---|
/// | all | `header` has the time and the frame that are given; covariances are 0, which means unknown |
/// | `sensor_msgs/LaserScan` | `angle_max` is the direction of the last beam |
/// | `sensor_msgs/Image` | `encoding` is the name of `format` in lower case |
/// | `sensor_msgs/Range` | `range` is infinite when nothing was heard |
/// | `sensor_msgs/BatteryState` | what is not measured is NaN |
/// | `nav_msgs/Odometry` | a turn in the plane is one around z; the child is `base_link` |
/// | `geometry_msgs/Twist` | forward is x, turning is around z |
/// | `geometry_msgs/TransformStamped` | `header` has the value's own parent, and its own time unless it is fixed |
pub fn standard(descriptor: &'static Descriptor) -> Option<Standard> {
    let (package, name) = descriptor.ros.split_once("/msg/")?;
    let short = format!("{package}/{name}");
    let text = text(&short)?;
    let schema = Schema::parse(descriptor.ros, &text).ok()?;
    let mut compiler =
        Compiler { descriptor, message: &short, schema: &schema, steps: Vec::new(), used: false };
    compiler.record(0, "", Some(""))?;
    let Compiler { steps, used, .. } = compiler;
    let definition = Definition { name: descriptor.ros.into(), text };
    used.then_some(Standard { descriptor, definition, steps })
}

struct Compiler<'a> {
    descriptor: &'static Descriptor,
    message: &'a str,
    schema: &'a Schema,
    steps: Vec<Step>,
    /// Whether anything of the value is in the message.
    used: bool,
}

impl Compiler<'_> {
    /// `scope` is where in the value the fields of the same name are.
    fn record(&mut self, index: usize, path: &str, scope: Option<&str>) -> Option<()> {
        let schema = self.schema;
        let record = &schema.records()[index];
        if record.types.is_empty() {
            self.steps.push(Step::Empty);
        }
        for (name, of) in record.names.iter().zip(&record.types) {
            self.field(&joined(path, name), *of, scope.map(|scope| joined(scope, name)))?;
        }
        Some(())
    }

    fn field(&mut self, path: &str, of: FieldType, same: Option<String>) -> Option<()> {
        let rules = || RULES.iter().filter(|(message, field, _)| *message == self.message && *field == path);
        let same = same.filter(|same| self.find(same).is_some());
        match (of.item, of.count) {
            (Item::Record(index), Count::One)
                if self.schema.records()[index].name == "builtin_interfaces/Time" =>
            {
                let own = rules().find_map(|(_, _, origin)| match origin {
                    Origin::Time { time, unless } => Some((self.place(time)?, self.place(unless)?)),
                    _ => None,
                });
                self.steps.push(Step::Stamp(own));
            }
            (Item::Record(index), Count::One) => {
                let moved = rules().find_map(|(_, _, origin)| match origin {
                    Origin::Field(field) => {
                        matches!(self.find(field)?.0, Kind::Nested(_)).then(|| (*field).into())
                    }
                    _ => None,
                });
                self.record(index, path, moved.or(same).as_deref())?;
            }
            (Item::Primitive(kind), Count::One) => {
                let number = rules().find_map(|(_, _, origin)| self.number(origin));
                let number = number.or_else(|| Some(Number::Field(self.place(same.as_deref()?)?)));
                self.used |= number.is_some();
                let constant = rules().find_map(|(_, _, origin)| match origin {
                    Origin::Number(number) => Some(*number),
                    _ => None,
                });
                if number.is_none() && same.is_some() {
                    return None;
                }
                self.steps
                    .push(Step::Number(kind, number.unwrap_or(Number::Constant(constant.unwrap_or(0.0)))));
            }
            (Item::Text, Count::One) => {
                let text = rules().find_map(|(_, _, origin)| self.text(origin));
                let text = text.or_else(|| self.text_field(same.as_deref()?));
                self.used |= text.is_some();
                let constant = rules().find_map(|(_, _, origin)| match origin {
                    Origin::Text(text) => Some(Text::Constant(text)),
                    _ => None,
                });
                let usual = if path == "header/frame_id" { Text::Frame } else { Text::Constant("") };
                self.steps.push(Step::Text(text.or(constant).unwrap_or(usual)));
            }
            (Item::Primitive(kind), count) => {
                let fixed = match count {
                    Count::Fixed(count) => Some(count),
                    _ => None,
                };
                let step = match same {
                    Some(same) => self.list(kind, fixed, &same)?,
                    None => Step::Zeros(kind, fixed),
                };
                self.used |= matches!(step, Step::List { .. });
                self.steps.push(step);
            }
            (_, Count::Any) if same.is_none() => self.steps.push(Step::Zeros(Primitive::U8, None)),
            _ => return None,
        }
        Some(())
    }

    fn find(&self, path: &str) -> Option<(Kind, usize)> {
        let place = find(self.descriptor, path).ok()?;
        Some((*place.kind(), place.offset()))
    }

    fn place(&self, path: &str) -> Option<Place> {
        let (kind, offset) = self.find(path)?;
        Some(Place(Primitive::of(&kind)?, offset))
    }

    fn number(&self, origin: &Origin) -> Option<Number> {
        Some(match origin {
            Origin::Field(field) => Number::Field(self.place(field)?),
            Origin::HalfSine(field) => Number::HalfSine(self.place(field)?),
            Origin::HalfCosine(field) => Number::HalfCosine(self.place(field)?),
            Origin::When { number, holds } => {
                Number::When { number: self.place(number)?, holds: self.place(holds)? }
            }
            Origin::Last { first, step, items } => Number::Last {
                first: self.place(first)?,
                step: self.place(step)?,
                items: self.items(items)?.0,
            },
            _ => return None,
        })
    }

    fn text(&self, origin: &Origin) -> Option<Text> {
        match origin {
            Origin::Field(field) => self.text_field(field),
            Origin::Name(field) => match self.find(field)? {
                (Kind::Enumeration(enumeration), _) => Some(Text::Name(self.place(field)?, enumeration)),
                _ => None,
            },
            _ => None,
        }
    }

    fn text_field(&self, path: &str) -> Option<Text> {
        match self.find(path)? {
            (Kind::Text(capacity), offset) => Some(Text::Field(offset, capacity)),
            _ => None,
        }
    }

    /// How many items a list has, what they are, and where they begin.
    fn items(&self, path: &str) -> Option<(Items, Primitive, usize)> {
        let (kind, offset) = self.find(path)?;
        let (items, item, start) = match kind {
            Kind::Array(item, count) => (Items::Fixed(count), item, offset),
            Kind::Sequence(item, capacity) => (Items::Counted(offset, capacity), item, offset + 8),
            Kind::Tail(item) => (Items::Tail, item, offset),
            _ => return None,
        };
        Some((items, Primitive::of(item)?, start))
    }

    fn list(&self, kind: Primitive, fixed: Option<usize>, path: &str) -> Option<Step> {
        let (count, from, start) = self.items(path)?;
        match (fixed, count) {
            (Some(wanted), Items::Fixed(count)) if wanted == count => {}
            (None, _) => {}
            _ => return None,
        }
        Some(Step::List { kind, counted: fixed.is_none(), count, start, from })
    }
}

fn joined(path: &str, name: &str) -> String {
    if path.is_empty() { name.into() } else { format!("{path}/{name}") }
}

impl Standard {
    /// The message, as ROS defines it, without the comments.
    pub fn definition(&self) -> &Definition {
        &self.definition
    }

    /// Appends the message of a value: little-endian CDR with its header. Nothing is allocated when `out` has room.
    ///
    /// `bytes` is the value as it lies in memory, with its tail; `stamp` is its time in nanoseconds, and `frame` what it is told
    /// in, such as `base_link`: they are the `header` of messages that have one.
    ///
    /// # Errors
    /// When `bytes` is no value of the interface; `out` is unchanged then.
    pub fn encode(&self, bytes: &[u8], stamp: u64, frame: &str, out: &mut Vec<u8>) -> Result<(), Error> {
        let tail = items(self.descriptor, bytes)?;
        wire_length(bytes.len())?;
        wire_length(frame.len() + 1)?;
        let value = Source { bytes, tail };
        let mut writer = Writer::new(out);
        for step in &self.steps {
            match step {
                Step::Number(kind, number) => write(&mut writer, *kind, value.number(number)),
                Step::Stamp(own) => {
                    let own = own.as_ref().filter(|(_, unless)| !value.holds(unless));
                    let stamp = own.map_or(i128::from(stamp), |(time, _)| match value.read(time) {
                        Scalar::Whole(time) => time,
                        Scalar::Float(time) => time as i128,
                    });
                    let second = 1_000_000_000;
                    write(&mut writer, Primitive::I32, Scalar::Whole(stamp.div_euclid(second)));
                    write(&mut writer, Primitive::U32, Scalar::Whole(stamp.rem_euclid(second)));
                }
                Step::Text(Text::Frame) => writer.text(frame)?,
                Step::Text(Text::Constant(text)) => writer.text(text)?,
                Step::Text(Text::Field(offset, capacity)) => writer.text(value.text(*offset, *capacity))?,
                Step::Text(Text::Name(place, enumeration)) => {
                    write_name(&mut writer, value.read(place), enumeration)?
                }
                Step::List { kind, counted, count, start, from } => {
                    let count = value.count(*count);
                    if *counted {
                        writer.length(wire_length(count)?);
                    }
                    let memory = &bytes[*start..*start + count * from.size()];
                    // The bytes of a truth value may be others than 0 and 1.
                    if kind == from && *kind != Primitive::Bool {
                        writer.numbers(memory, kind.size());
                    } else {
                        for number in memory.chunks_exact(from.size()) {
                            write(&mut writer, *kind, scalar(*from, number));
                        }
                    }
                }
                Step::Zeros(_, None) => writer.length(0),
                Step::Zeros(kind, Some(count)) => writer.zeros(*count, kind.size()),
                Step::Empty => writer.byte(0),
            }
        }
        Ok(())
    }
}

/// A number on its way from one type to another.
#[derive(Clone, Copy)]
enum Scalar {
    Whole(i128),
    Float(f64),
}

impl Scalar {
    fn float(self) -> f64 {
        match self {
            Self::Whole(number) => number as f64,
            Self::Float(number) => number,
        }
    }
}

fn scalar(kind: Primitive, memory: &[u8]) -> Scalar {
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
fn write(writer: &mut Writer<'_>, kind: Primitive, number: Scalar) {
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

fn write_name(writer: &mut Writer<'_>, number: Scalar, enumeration: &Enumeration) -> Result<(), Error> {
    let constant = enumeration.constants.iter().find(|constant| match number {
        Scalar::Whole(number) => i128::from(constant.value) == number,
        Scalar::Float(_) => false,
    });
    let name = constant.map_or("", |constant| constant.name);
    writer.length(wire_length(name.len() + 1)?);
    for letter in name.bytes() {
        writer.byte(letter.to_ascii_lowercase());
    }
    writer.byte(0);
    Ok(())
}

/// A value that steps read.
struct Source<'a> {
    bytes: &'a [u8],
    tail: usize,
}

impl Source<'_> {
    fn read(&self, place: &Place) -> Scalar {
        scalar(place.0, &self.bytes[place.1..])
    }

    fn holds(&self, place: &Place) -> bool {
        self.read(place).float() != 0.0
    }

    fn count(&self, items: Items) -> usize {
        match items {
            Items::Fixed(count) => count,
            Items::Counted(offset, capacity) => self.length(offset).min(capacity),
            Items::Tail => self.tail,
        }
    }

    fn length(&self, offset: usize) -> usize {
        scalar(Primitive::U32, &self.bytes[offset..]).float() as usize
    }

    fn text(&self, offset: usize, capacity: usize) -> &str {
        let bytes = &self.bytes[offset + 4..][..self.length(offset).min(capacity)];
        match std::str::from_utf8(bytes) {
            Ok(text) => text,
            // The part before the first bad byte is valid by the error's contract.
            Err(error) => std::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or_default(),
        }
    }

    fn number(&self, number: &Number) -> Scalar {
        let float = |place: &Place| self.read(place).float();
        match number {
            Number::Constant(number) => Scalar::Float(*number),
            Number::Field(place) => self.read(place),
            Number::HalfSine(place) => Scalar::Float(libm::sin(float(place) / 2.0)),
            Number::HalfCosine(place) => Scalar::Float(libm::cos(float(place) / 2.0)),
            Number::When { number, holds } if self.holds(holds) => self.read(number),
            Number::When { .. } => Scalar::Float(f64::INFINITY),
            Number::Last { first, step, items } => {
                let steps = self.count(*items).saturating_sub(1);
                Scalar::Float(float(first) + float(step) * steps as f64)
            }
        }
    }
}
