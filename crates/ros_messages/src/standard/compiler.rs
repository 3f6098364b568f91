use slate_blackboard::interface::{Descriptor, Kind, find};

use super::messages::{FieldOrigin, RULES};
use super::{
    Cloud, EncodeStep, FieldLocation, Items, MessageStep, NumberSource, Primitive, RosPrimitive, Schema,
    TextSource,
};
use crate::schema::{Count, FieldType, Item};

/// Returns the steps that encode a value as message `name`.
/// `None` if it does not fit.
pub(super) fn steps(
    descriptor: &'static Descriptor,
    name: &str,
    schema: &Schema,
) -> Option<Vec<MessageStep>> {
    let mut compiler = Compiler::new(descriptor, name, schema);
    compiler.record(0, "", Some(""))?;
    compiler.used.then_some(compiler.steps)
}

/// Compiles the steps that encode a value as a message that was defined for it.
/// Fields of the same name must fit, or the only ones of both.
///
/// # Errors
/// The path of a field of the message that does not fit, and the reason in words.
pub(super) fn checked_steps(
    descriptor: &'static Descriptor,
    name: &str,
    schema: &Schema,
) -> Result<Vec<MessageStep>, (String, String)> {
    let mut compiler = Compiler { is_checked: true, ..Compiler::new(descriptor, name, schema) };
    let compiled = match only_fields(descriptor, schema) {
        Some((theirs, own)) => compiler.only_record(theirs, own),
        None => compiler.record(0, "", Some("")),
    };
    let Compiler { steps, used, mismatch, .. } = compiler;
    let of = descriptor.name;
    match (compiled, mismatch) {
        (_, Some((path, None))) => {
            let reason = format!(
                "{of} lacks this field, and a fixed number of texts or messages can't be left out: add it, or take a list"
            );
            Err((path, reason))
        }
        (_, Some((path, Some(same)))) => {
            let own = find(descriptor, &same).map_or_else(|_| "another".into(), |own| own.kind().describe());
            Err((path, format!("the type of this field does not fit `{same}` of {of}, {own}")))
        }
        (Some(()), None) if used => Ok(steps),
        _ => {
            let own: Vec<_> = descriptor.fields.iter().map(|field| field.name).collect();
            Err((String::new(), format!("no field of {name} is one of {of}, which has {}", own.join(", "))))
        }
    }
}

/// Returns the only field of a message and of an interface, if their names differ.
/// The header of the message does not count.
fn only_fields(descriptor: &'static Descriptor, schema: &Schema) -> Option<(usize, &'static str)> {
    let record = &schema.records()[0];
    let is_header = |of: &FieldType| match of.item {
        Item::Record(index) => schema.records()[index].name == "std_msgs/Header",
        _ => false,
    };
    let mut theirs = record.types.iter().enumerate().filter(|(_, of)| !is_header(of)).map(|(at, _)| at);
    let ([own], Some(at), None) = (descriptor.fields, theirs.next(), theirs.next()) else { return None };
    (record.names[at] != own.name).then_some((at, own.name))
}

struct Compiler<'a> {
    descriptor: &'static Descriptor,
    message: &'a str,
    schema: &'a Schema,
    steps: Vec<MessageStep>,
    /// Set if the message has any part of the value.
    used: bool,
    /// Set if a field of the same name must fit.
    is_checked: bool,
    /// Path of the first field that does not fit, and of its field of the interface.
    mismatch: Option<(String, Option<String>)>,
}

impl<'a> Compiler<'a> {
    fn new(descriptor: &'static Descriptor, message: &'a str, schema: &'a Schema) -> Self {
        Self {
            descriptor,
            message,
            schema,
            steps: Vec::new(),
            used: false,
            is_checked: false,
            mismatch: None,
        }
    }

    /// Compiles the message whose field at an index has the interface's only field.
    fn only_record(&mut self, at: usize, own: &str) -> Option<()> {
        let schema = self.schema;
        let record = &schema.records()[0];
        for (index, (name, of)) in record.names.iter().zip(&record.types).enumerate() {
            self.field(name, *of, (index == at).then(|| own.to_owned()))?;
        }
        Some(())
    }

    /// Compiles a record; `scope` is the path of the value's fields of the same name.
    fn record(&mut self, index: usize, path: &str, scope: Option<&str>) -> Option<()> {
        let schema = self.schema;
        let record = &schema.records()[index];
        if record.types.is_empty() {
            self.push(path, EncodeStep::Empty);
        }
        for (name, of) in record.names.iter().zip(&record.types) {
            self.field(&joined(path, name), *of, scope.map(|scope| joined(scope, name)))?;
        }
        Some(())
    }

    /// Returns the rules of a field of the message.
    fn rules<'s>(&self, path: &'s str) -> impl Iterator<Item = &'static FieldOrigin> + use<'s, '_> {
        let rules =
            RULES.iter().filter(move |(message, field, _)| *message == self.message && *field == path);
        rules.map(|(_, _, origin)| origin)
    }

    fn field(&mut self, path: &str, of: FieldType, same: Option<String>) -> Option<()> {
        let same = same.filter(|same| self.find(same).is_some());
        let is_record = matches!((of.item, of.count), (Item::Record(_), Count::One));
        let used = std::mem::take(&mut self.used);
        let is_expected = self.is_checked && same.is_some() && !is_record;
        let own = same.clone();
        let done = self.field_step(path, of, same);
        if self.mismatch.is_none() && (done.is_none() || (is_expected && !self.used)) {
            self.mismatch = Some((path.to_owned(), own));
        }
        self.used |= used;
        done
    }

    fn field_step(&mut self, path: &str, of: FieldType, same: Option<String>) -> Option<()> {
        let step = match (of.item, of.count) {
            (Item::Record(index), Count::One)
                if self.schema.records()[index].name == "builtin_interfaces/Time"
                    && !self.is_nested(same.as_deref()) =>
            {
                self.stamp(path)
            }
            (Item::Record(index), Count::One) => {
                let moved = self.rules(path).find_map(|origin| match origin {
                    FieldOrigin::Field(field) => {
                        matches!(self.find(field)?.0, Kind::Nested(_)).then(|| (*field).into())
                    }
                    _ => None,
                });
                let scope = self.first(moved, same);
                return self.record(index, path, scope.as_deref());
            }
            (Item::Primitive(kind), Count::One) => self.one_number(path, kind, same.as_deref())?,
            (Item::Text, Count::One) => self.one_text(path, same.as_deref()),
            (Item::Primitive(kind), count) => self.numbers(path, kind, count, same.as_deref())?,
            (Item::Record(_), Count::Any)
                if self.rules(path).any(|origin| matches!(origin, FieldOrigin::Axes))
                    && Cloud::of(self.descriptor).is_some() =>
            {
                EncodeStep::Axes
            }
            (Item::Text, count) => match same {
                Some(same) => self.text_list(count, &same)?,
                None => matches!(count, Count::Any).then(|| self.texts(path))?,
            },
            (Item::Record(index), count) => self.records(index, path, count, same.as_deref())?,
        };
        self.push(path, step);
        Some(())
    }

    fn push(&mut self, path: &str, encode: EncodeStep) {
        self.steps.push(MessageStep { field: path.to_owned(), encode });
    }

    /// Selects the source of a field.
    /// If the message was defined for the interface, the source of the same name precedes the one by a rule.
    fn first<T>(&self, ruled: Option<T>, same: Option<T>) -> Option<T> {
        if self.is_checked { same.or(ruled) } else { ruled.or(same) }
    }

    /// Returns true if the interface has a nested interface there.
    /// An example is a time of its own.
    fn is_nested(&self, same: Option<&str>) -> bool {
        same.and_then(|same| self.find(same)).is_some_and(|(kind, _)| matches!(kind, Kind::Nested(_)))
    }

    fn stamp(&self, path: &str) -> EncodeStep {
        EncodeStep::Stamp(self.rules(path).find_map(|origin| match origin {
            FieldOrigin::Time { time, unless } => Some((self.location(time)?, self.location(unless)?)),
            _ => None,
        }))
    }

    fn one_number(&mut self, path: &str, kind: Primitive, same: Option<&str>) -> Option<EncodeStep> {
        let ruled = self.rules(path).find_map(|origin| self.number(origin));
        let own = same.and_then(|same| Some(NumberSource::Field(self.location(same)?)));
        let number = self.first(ruled, own);
        self.used |= number.is_some();
        let constant = self.rules(path).find_map(|origin| match origin {
            FieldOrigin::Number(number) => Some(*number),
            _ => None,
        });
        if number.is_none() && same.is_some() {
            return None;
        }
        Some(EncodeStep::Number(kind, number.unwrap_or(NumberSource::Constant(constant.unwrap_or(0.0)))))
    }

    fn one_text(&mut self, path: &str, same: Option<&str>) -> EncodeStep {
        let ruled = self.rules(path).find_map(|origin| self.text(origin));
        let text = self.first(ruled, same.and_then(|same| self.text_field(same)));
        self.used |= text.is_some();
        let constant = self.rules(path).find_map(|origin| match origin {
            FieldOrigin::Text(text) => Some(TextSource::Constant(text)),
            FieldOrigin::Frame(name) => Some(TextSource::OfRobot(name)),
            _ => None,
        });
        let usual =
            if path.ends_with("header/frame_id") { TextSource::Frame } else { TextSource::Constant("") };
        EncodeStep::Text(text.or(constant).unwrap_or(usual))
    }

    fn numbers(
        &mut self,
        path: &str,
        kind: Primitive,
        count: Count,
        same: Option<&str>,
    ) -> Option<EncodeStep> {
        let fixed = match count {
            Count::Fixed(count) => Some(count),
            _ => None,
        };
        let own = self.rules(path).find_map(|origin| match origin {
            FieldOrigin::Covariance(field) => Some(EncodeStep::Covariance(self.covariance(field)?)),
            FieldOrigin::Listed(fields) if fixed.is_none() => {
                Some(EncodeStep::Listed(kind, self.locations(fields)?))
            }
            FieldOrigin::Points => Some(EncodeStep::Points(Cloud::of(self.descriptor)?)),
            _ => None,
        });
        let step = match (own, same) {
            (Some(step), None) => step,
            (Some(step), Some(_)) if !self.is_checked => step,
            (_, Some(same)) => self.list(kind, fixed, same)?,
            (None, None) => EncodeStep::Zeros(kind, fixed),
        };
        self.used |= !matches!(step, EncodeStep::Zeros(..));
        Some(step)
    }

    fn texts(&self, path: &str) -> EncodeStep {
        let called = self.rules(path).find_map(|origin| match origin {
            FieldOrigin::Called(names) => self.locations(names).map(|_| names),
            _ => None,
        });
        let names = called.into_iter().flat_map(|names| names.iter());
        EncodeStep::Texts(names.map(|(name, _)| *name).collect())
    }

    fn text_list(&mut self, count: Count, same: &str) -> Option<EncodeStep> {
        let (kind, offset) = self.find(same)?;
        let (own, item, start) = list(&kind, offset)?;
        let Kind::Text(capacity) = *item else { return None };
        self.used = true;
        Some(EncodeStep::TextList { counted: is_counted(count, own)?, count: own, start, capacity })
    }

    fn records(&mut self, index: usize, path: &str, count: Count, same: Option<&str>) -> Option<EncodeStep> {
        let own = self.rules(path).find_map(|origin| match origin {
            FieldOrigin::Field(field) => self.find(field),
            _ => None,
        });
        let step = match self.first(own, same.and_then(|same| self.find(same))) {
            Some((kind, offset)) => self.messages(index, path, count, kind, offset)?,
            None => matches!(count, Count::Any).then_some(EncodeStep::Zeros(Primitive::U8, None))?,
        };
        self.used |= matches!(step, EncodeStep::Messages { .. });
        Some(step)
    }

    fn find(&self, path: &str) -> Option<(Kind, usize)> {
        let location = find(self.descriptor, path).ok()?;
        Some((*location.kind(), location.offset()))
    }

    fn location(&self, path: &str) -> Option<FieldLocation> {
        let (kind, offset) = self.find(path)?;
        Some(FieldLocation(Primitive::of(&kind)?, offset))
    }

    fn locations(&self, fields: &[(&str, &str)]) -> Option<Vec<FieldLocation>> {
        fields.iter().map(|(_, field)| self.location(field)).collect()
    }

    fn number(&self, origin: &FieldOrigin) -> Option<NumberSource> {
        Some(match origin {
            FieldOrigin::Field(field) => NumberSource::Field(self.location(field)?),
            FieldOrigin::HalfSine(field) => NumberSource::HalfSine(self.location(field)?),
            FieldOrigin::HalfCosine(field) => NumberSource::HalfCosine(self.location(field)?),
            FieldOrigin::When { number, holds } => {
                NumberSource::When { number: self.location(number)?, holds: self.location(holds)? }
            }
            FieldOrigin::Last { first, step, items } => NumberSource::Last {
                first: self.location(first)?,
                step: self.location(step)?,
                items: self.items(items)?.0,
            },
            FieldOrigin::Among(field, numbers) => NumberSource::Among(self.location(field)?, numbers),
            FieldOrigin::Along { range, bearing } => {
                NumberSource::Along { range: self.location(range)?, bearing: self.location(bearing)? }
            }
            FieldOrigin::Across { range, bearing } => {
                NumberSource::Across { range: self.location(range)?, bearing: self.location(bearing)? }
            }
            FieldOrigin::Heard(times) => NumberSource::Heard(Cloud::of(self.descriptor)?, *times),
            _ => return None,
        })
    }

    fn text(&self, origin: &FieldOrigin) -> Option<TextSource> {
        match origin {
            FieldOrigin::Field(field) => self.text_field(field),
            FieldOrigin::NamedFrame(field) => match self.text_field(field)? {
                TextSource::Field(offset, capacity) => Some(TextSource::Named(offset, capacity)),
                other => Some(other),
            },
            FieldOrigin::Name(field) => match self.find(field)? {
                (Kind::Enumeration(enumeration), _) => {
                    Some(TextSource::Name(self.location(field)?, enumeration))
                }
                _ => None,
            },
            _ => None,
        }
    }

    fn text_field(&self, path: &str) -> Option<TextSource> {
        match self.find(path)? {
            (Kind::Text(capacity), offset) => Some(TextSource::Field(offset, capacity)),
            _ => None,
        }
    }

    /// Returns the offset of the covariance of a pose in the plane.
    fn covariance(&self, path: &str) -> Option<usize> {
        let (kind, offset) = self.find(path)?;
        matches!(kind, Kind::Array(Kind::Primitive(Primitive::F64), 9)).then_some(offset)
    }

    /// Returns count, type and offset of the items of a list of numbers.
    fn items(&self, path: &str) -> Option<(Items, Primitive, usize)> {
        let (kind, offset) = self.find(path)?;
        let (items, item, start) = list(&kind, offset)?;
        Some((items, Primitive::of(item)?, start))
    }

    /// Returns the step that encodes a list of interfaces as a list of messages.
    fn messages(
        &self,
        index: usize,
        path: &str,
        theirs: Count,
        of: Kind,
        offset: usize,
    ) -> Option<EncodeStep> {
        let (count, item, start) = list(&of, offset)?;
        let counted = is_counted(theirs, count)?;
        let Kind::Nested(descriptor) = *item else { return None };
        let (message, schema) = (self.message, self.schema);
        // Rules for what is in the list name the fields of its items.
        let mut inner =
            Compiler { is_checked: self.is_checked, ..Compiler::new(descriptor, message, schema) };
        inner.record(index, path, Some(""))?;
        let Compiler { steps, used, mismatch, .. } = inner;
        (used && mismatch.is_none()).then_some(EncodeStep::Messages {
            counted,
            count,
            start,
            item: descriptor,
            steps,
        })
    }

    fn list(&self, kind: Primitive, fixed: Option<usize>, path: &str) -> Option<EncodeStep> {
        let (count, from, start) = self.items(path)?;
        let counted = is_counted(fixed.map_or(Count::Any, Count::Fixed), count)?;
        Some(EncodeStep::List { kind, counted, count, start, from })
    }
}

/// Returns whether a list in a message has its length before it.
/// `None` if a list of the interface does not fit it.
fn is_counted(theirs: Count, own: Items) -> Option<bool> {
    match (theirs, own) {
        (Count::Fixed(wanted), Items::Fixed(count)) if wanted == count => Some(false),
        (Count::Any, _) => Some(true),
        _ => None,
    }
}

/// Returns count, type and offset of the items of a list.
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
