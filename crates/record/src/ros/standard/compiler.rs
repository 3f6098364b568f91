use slate_blackboard::interface::{Descriptor, Kind, find};

use super::messages::{Origin, RULES};
use super::{Cloud, Items, Number, Place, Primitive, RosPrimitive, Schema, Step, Text};
use crate::ros::schema::{Count, FieldType, Item};

/// What makes the message `name` of a value; nothing when it doesn't fit that.
pub(super) fn steps(descriptor: &'static Descriptor, name: &str, schema: &Schema) -> Option<Vec<Step>> {
    let mut compiler = Compiler { descriptor, message: name, schema, steps: Vec::new(), used: false };
    compiler.record(0, "", Some(""))?;
    compiler.used.then_some(compiler.steps)
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

    /// What the rules say of a field of the message.
    fn rules<'s>(&self, path: &'s str) -> impl Iterator<Item = &'static Origin> + use<'s, '_> {
        let rules =
            RULES.iter().filter(move |(message, field, _)| *message == self.message && *field == path);
        rules.map(|(_, _, origin)| origin)
    }

    fn field(&mut self, path: &str, of: FieldType, same: Option<String>) -> Option<()> {
        let same = same.filter(|same| self.find(same).is_some());
        let step = match (of.item, of.count) {
            (Item::Record(index), Count::One)
                if self.schema.records()[index].name == "builtin_interfaces/Time" =>
            {
                self.stamp(path)
            }
            (Item::Record(index), Count::One) => {
                let moved = self.rules(path).find_map(|origin| match origin {
                    Origin::Field(field) => {
                        matches!(self.find(field)?.0, Kind::Nested(_)).then(|| (*field).into())
                    }
                    _ => None,
                });
                return self.record(index, path, moved.or(same).as_deref());
            }
            (Item::Primitive(kind), Count::One) => self.one_number(path, kind, same.as_deref())?,
            (Item::Text, Count::One) => self.one_text(path, same.as_deref()),
            (Item::Primitive(kind), count) => self.numbers(path, kind, count, same.as_deref())?,
            (Item::Record(_), Count::Any)
                if self.rules(path).any(|origin| matches!(origin, Origin::Axes))
                    && Cloud::of(self.descriptor).is_some() =>
            {
                Step::Axes
            }
            (Item::Text, Count::Any) if same.is_none() => self.texts(path),
            (Item::Record(index), Count::Any) => self.records(index, path, same.as_deref())?,
            (_, Count::Any) if same.is_none() => Step::Zeros(Primitive::U8, None),
            _ => return None,
        };
        self.steps.push(step);
        Some(())
    }

    fn stamp(&self, path: &str) -> Step {
        Step::Stamp(self.rules(path).find_map(|origin| match origin {
            Origin::Time { time, unless } => Some((self.place(time)?, self.place(unless)?)),
            _ => None,
        }))
    }

    fn one_number(&mut self, path: &str, kind: Primitive, same: Option<&str>) -> Option<Step> {
        let number = self.rules(path).find_map(|origin| self.number(origin));
        let number = number.or_else(|| Some(Number::Field(self.place(same?)?)));
        self.used |= number.is_some();
        let constant = self.rules(path).find_map(|origin| match origin {
            Origin::Number(number) => Some(*number),
            _ => None,
        });
        if number.is_none() && same.is_some() {
            return None;
        }
        Some(Step::Number(kind, number.unwrap_or(Number::Constant(constant.unwrap_or(0.0)))))
    }

    fn one_text(&mut self, path: &str, same: Option<&str>) -> Step {
        let text = self.rules(path).find_map(|origin| self.text(origin));
        let text = text.or_else(|| self.text_field(same?));
        self.used |= text.is_some();
        let constant = self.rules(path).find_map(|origin| match origin {
            Origin::Text(text) => Some(Text::Constant(text)),
            Origin::Frame(name) => Some(Text::OfRobot(name)),
            _ => None,
        });
        let usual = if path.ends_with("header/frame_id") { Text::Frame } else { Text::Constant("") };
        Step::Text(text.or(constant).unwrap_or(usual))
    }

    fn numbers(&mut self, path: &str, kind: Primitive, count: Count, same: Option<&str>) -> Option<Step> {
        let fixed = match count {
            Count::Fixed(count) => Some(count),
            _ => None,
        };
        let own = self.rules(path).find_map(|origin| match origin {
            Origin::Covariance(field) => Some(Step::Covariance(self.covariance(field)?)),
            Origin::Listed(fields) if fixed.is_none() => Some(Step::Listed(kind, self.places(fields)?)),
            Origin::Points => Some(Step::Points(Cloud::of(self.descriptor)?)),
            _ => None,
        });
        let step = match (own, same) {
            (Some(step), _) => step,
            (None, Some(same)) => self.list(kind, fixed, same)?,
            (None, None) => Step::Zeros(kind, fixed),
        };
        self.used |= !matches!(step, Step::Zeros(..));
        Some(step)
    }

    fn texts(&self, path: &str) -> Step {
        let called = self.rules(path).find_map(|origin| match origin {
            Origin::Called(names) => self.places(names).map(|_| names),
            _ => None,
        });
        let names = called.into_iter().flat_map(|names| names.iter());
        Step::Texts(names.map(|(name, _)| *name).collect())
    }

    fn records(&mut self, index: usize, path: &str, same: Option<&str>) -> Option<Step> {
        let own = self.rules(path).find_map(|origin| match origin {
            Origin::Field(field) => self.find(field),
            _ => None,
        });
        let step = match own.or_else(|| self.find(same?)) {
            Some((kind, offset)) => self.messages(index, path, kind, offset)?,
            None => Step::Zeros(Primitive::U8, None),
        };
        self.used |= matches!(step, Step::Messages { .. });
        Some(step)
    }

    fn find(&self, path: &str) -> Option<(Kind, usize)> {
        let place = find(self.descriptor, path).ok()?;
        Some((*place.kind(), place.offset()))
    }

    fn place(&self, path: &str) -> Option<Place> {
        let (kind, offset) = self.find(path)?;
        Some(Place(Primitive::of(&kind)?, offset))
    }

    fn places(&self, fields: &[(&str, &str)]) -> Option<Vec<Place>> {
        fields.iter().map(|(_, field)| self.place(field)).collect()
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
            Origin::Among(field, numbers) => Number::Among(self.place(field)?, numbers),
            Origin::Along { range, bearing } => {
                Number::Along { range: self.place(range)?, bearing: self.place(bearing)? }
            }
            Origin::Across { range, bearing } => {
                Number::Across { range: self.place(range)?, bearing: self.place(bearing)? }
            }
            Origin::Heard(times) => Number::Heard(Cloud::of(self.descriptor)?, *times),
            _ => return None,
        })
    }

    fn text(&self, origin: &Origin) -> Option<Text> {
        match origin {
            Origin::Field(field) => self.text_field(field),
            Origin::NamedFrame(field) => match self.text_field(field)? {
                Text::Field(offset, capacity) => Some(Text::Named(offset, capacity)),
                other => Some(other),
            },
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

    /// Where the covariance of a pose in the plane is.
    fn covariance(&self, path: &str) -> Option<usize> {
        let (kind, offset) = self.find(path)?;
        matches!(kind, Kind::Array(Kind::Primitive(Primitive::F64), 9)).then_some(offset)
    }

    /// How many items a list of numbers has, what they are, and where they begin.
    fn items(&self, path: &str) -> Option<(Items, Primitive, usize)> {
        let (kind, offset) = self.find(path)?;
        let (items, item, start) = list(&kind, offset)?;
        Some((items, Primitive::of(item)?, start))
    }

    /// What makes a list of messages of a list of interfaces.
    fn messages(&self, index: usize, path: &str, of: Kind, offset: usize) -> Option<Step> {
        let (count, item, start) = list(&of, offset)?;
        let Kind::Nested(descriptor) = *item else { return None };
        let (message, schema) = (self.message, self.schema);
        // Rules for what is in the list name the fields of its items.
        let mut inner = Compiler { descriptor, message, schema, steps: Vec::new(), used: false };
        inner.record(index, path, Some(""))?;
        let Compiler { steps, used, .. } = inner;
        used.then_some(Step::Messages { count, start, size: item.size(), steps })
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

/// How many items a list has, what they are, and where they begin.
fn list(kind: &Kind, offset: usize) -> Option<(Items, &'static Kind, usize)> {
    Some(match kind {
        Kind::Array(item, count) => (Items::Fixed(*count), item, offset),
        Kind::Sequence(item, capacity) => (Items::Counted(offset, *capacity), item, offset + 8),
        Kind::Tail(item) => (Items::Tail, item, offset),
        _ => return None,
    })
}

fn joined(path: &str, name: &str) -> String {
    if path.is_empty() { name.into() } else { format!("{path}/{name}") }
}
