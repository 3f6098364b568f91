use std::sync::Arc;

use slate_sorted::SortedMap;

use super::cdr::{CdrReader, WireFormat};
use super::names::Constants;
use super::value::Map;
use super::{Error, Numbers, Primitive, RosPrimitive, Value};

/// Maximum nesting depth of messages.
pub(super) const MAX_NESTING: usize = 32;

/// Message definition in the language of ROS's `.msg` files.
/// It has those of its nested messages: the schema encoding `ros2msg` of MCAP.
#[derive(Clone, Debug)]
pub struct Schema {
    records: Vec<SchemaRecord>,
}

/// Definition of one message; the first of a schema is the schema's own.
#[derive(Clone, Debug)]
pub(super) struct SchemaRecord {
    /// Package and name, such as `std_msgs/Header`.
    pub name: String,
    pub names: Arc<Vec<String>>,
    pub types: Vec<FieldType>,
    /// Lines of the fields in the definition, from 1; none for those that readers know.
    pub lines: Vec<usize>,
    /// The names of those fields that are shown.
    pub shown: Arc<Vec<String>>,
    /// The names of constants, by field; only of Slate's own messages.
    pub constants: SortedMap<String, Constants>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct FieldType {
    pub item: Item,
    pub count: Count,
    /// Set if decoded values have the field.
    pub is_shown: bool,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Item {
    Primitive(Primitive),
    Text,
    /// Index of a record.
    Record(usize),
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Count {
    One,
    Fixed(usize),
    Any,
}

/// Field before the types are known.
pub(super) struct SchemaField<'a> {
    /// Line from 1.
    pub number: usize,
    pub of: &'a str,
    pub name: &'a str,
}

impl Schema {
    /// Reads the definition of the message `name`, such as `sensor_msgs/msg/LaserScan`.
    ///
    /// Constants, default values and bounds are not needed for reading messages, and left out.
    ///
    /// # Errors
    /// When a line is no field, a type is not defined or contains itself, or for a `wstring`, of which implementations of
    /// ROS disagree how it lies in a message.
    pub fn parse(name: &str, text: &str) -> Result<Self, Error> {
        let sections = sections(name, text)?;
        let mut indices: SortedMap<&str, usize> = SortedMap::new();
        for (i, (section, _)) in sections.iter().enumerate() {
            indices.entry(section).or_insert(i);
        }
        let mut builtin = Vec::new();
        let mut records = Vec::new();
        for (section, lines) in &sections {
            let package = section.split('/').next().unwrap_or_default();
            let mut types = Vec::new();
            for line in lines {
                let wrong = |reason| Error::Definition { name: name.into(), line: line.number, reason };
                let (item, count) = suffix(line.of).map_err(wrong)?;
                let item = match primitive(item).map_err(wrong)? {
                    Some(known) => known,
                    None => {
                        let key = match item {
                            // Of ROS 1, where they are not messages.
                            "time" => TIME.into(),
                            "duration" => DURATION.into(),
                            _ => reference(package, item),
                        };
                        let short = item == "Header";
                        let found = indices.get(key.as_str());
                        match found.or_else(|| indices.get("std_msgs/Header").filter(|_| short)) {
                            Some(index) => Item::Record(*index),
                            // Many writers leave these two out, as every reader knows them.
                            None if key == TIME || key == DURATION => {
                                let at = builtin.iter().position(|known| *known == key);
                                let at = at.unwrap_or_else(|| {
                                    builtin.push(key);
                                    builtin.len() - 1
                                });
                                Item::Record(sections.len() + at)
                            }
                            None => return Err(wrong(format!("`{item}` is not defined in the text"))),
                        }
                    }
                };
                types.push(FieldType { item, count, is_shown: true });
            }
            let names: Arc<Vec<_>> = Arc::new(lines.iter().map(|line| line.name.to_owned()).collect());
            records.push(SchemaRecord {
                name: section.clone(),
                shown: names.clone(),
                names,
                types,
                lines: lines.iter().map(|line| line.number).collect(),
                constants: SortedMap::new(),
            });
        }
        for key in builtin {
            let field = |kind| FieldType { item: Item::Primitive(kind), count: Count::One, is_shown: true };
            let names = Arc::new(vec!["sec".into(), "nanosec".into()]);
            records.push(SchemaRecord {
                name: key,
                shown: Arc::clone(&names),
                names,
                types: vec![field(Primitive::I32), field(Primitive::U32)],
                lines: Vec::new(),
                constants: SortedMap::new(),
            });
        }
        let mut heights = vec![None; records.len()];
        match height(&records, 0, 0, &mut heights) {
            Some(_) => Ok(Self { records }),
            None => Err(Error::Definition {
                name: name.into(),
                line: 1,
                reason: format!("messages stand in themselves, or more than {MAX_NESTING} deep"),
            }),
        }
    }

    /// Decodes a message: CDR of either byte order, with its header.
    ///
    /// Allocates memory in proportion to the message, whatever lengths it states.
    ///
    /// # Errors
    /// When it is not a message of that definition.
    pub fn decode(&self, message: &[u8]) -> Result<Value, Error> {
        self.decode_in(WireFormat::Cdr, message)
    }

    /// Decodes a message of that format.
    ///
    /// # Errors
    /// When it is not a message of that definition.
    pub fn decode_in(&self, format: WireFormat, message: &[u8]) -> Result<Value, Error> {
        let mut reader = CdrReader::of(format, message)?;
        // Each value of a real message takes bytes of it, so there are never more values than bytes; but in ROS 1, where nothing
        // fills up, one byte may stand within several messages.
        let mut room = match format {
            WireFormat::Cdr => message.len(),
            WireFormat::Ros1 => MAX_NESTING + 4 * message.len(),
        };
        let value = self.record(&mut reader, 0, &mut room)?;
        reader.end()?;
        Ok(value)
    }

    /// Returns the line of the field at a path such as `pose/position`, from 1.
    pub(super) fn line(&self, path: &str) -> Option<usize> {
        let (mut index, mut line) = (0, None);
        for name in path.split('/') {
            let record = &self.records[index];
            let at = record.names.iter().position(|own| own == name)?;
            line = record.lines.get(at).copied();
            if let Item::Record(inner) = record.types[at].item {
                index = inner;
            }
        }
        line
    }

    /// Names of the message's own fields, in their order.
    pub fn field_names(&self) -> impl Iterator<Item = &str> {
        self.records.iter().take(1).flat_map(|record| record.names.iter().map(String::as_str))
    }

    /// Checks that [`decode`](Schema::decode) can read a message; allocates nothing.
    ///
    /// # Errors
    /// When it is not a message of that definition.
    pub fn check(&self, message: &[u8]) -> Result<(), Error> {
        let mut reader = CdrReader::new(message)?;
        let mut room = message.len();
        self.check_record(&mut reader, 0, &mut room)?;
        reader.end()
    }

    fn check_record(&self, reader: &mut CdrReader<'_>, index: usize, room: &mut usize) -> Result<(), Error> {
        take(reader, room)?;
        let record = &self.records[index];
        if record.types.is_empty() {
            reader.empty()?;
        }
        record.types.iter().try_for_each(|field| self.check_field(reader, *field, room))
    }

    pub(super) fn check_field(
        &self,
        reader: &mut CdrReader<'_>,
        field: FieldType,
        room: &mut usize,
    ) -> Result<(), Error> {
        let count = match field.count {
            Count::One => return self.check_item(reader, field.item, room),
            Count::Fixed(count) => count,
            Count::Any => reader.length()?,
        };
        take(reader, room)?;
        if let Item::Primitive(kind) = field.item {
            return reader.skip_numbers(count, kind.size());
        }
        (0..count).try_for_each(|_| self.check_item(reader, field.item, room))
    }

    fn check_item(&self, reader: &mut CdrReader<'_>, item: Item, room: &mut usize) -> Result<(), Error> {
        match item {
            Item::Record(index) => return self.check_record(reader, index, room),
            Item::Text => {
                take(reader, room)?;
                reader.text()?;
            }
            Item::Primitive(Primitive::Bool) => {
                take(reader, room)?;
                reader.bool()?;
            }
            Item::Primitive(kind) => {
                take(reader, room)?;
                reader.skip_numbers(1, kind.size())?;
            }
        }
        Ok(())
    }

    pub(super) fn records(&self) -> &[SchemaRecord] {
        &self.records
    }

    pub(super) fn records_mut(&mut self) -> &mut [SchemaRecord] {
        &mut self.records
    }

    fn record(&self, reader: &mut CdrReader<'_>, index: usize, room: &mut usize) -> Result<Value, Error> {
        take(reader, room)?;
        let record = &self.records[index];
        if record.types.is_empty() {
            reader.empty()?;
        }
        let mut values = Vec::with_capacity(record.types.len().min(*room));
        for field in &record.types {
            match field.is_shown {
                true => values.push(self.field(reader, *field, room)?),
                false => self.check_field(reader, *field, room)?,
            }
        }
        Ok(Value::Map(Map::new(record.shown.clone(), values)))
    }

    fn field(&self, reader: &mut CdrReader<'_>, field: FieldType, room: &mut usize) -> Result<Value, Error> {
        let count = match field.count {
            Count::One => return self.item(reader, field.item, room),
            Count::Fixed(count) => count,
            Count::Any => reader.length()?,
        };
        take(reader, room)?;
        if let Item::Primitive(kind) = field.item {
            return Ok(Value::Numbers(Numbers::new(kind, reader.new_numbers(count, kind.size())?)));
        }
        let mut items = Vec::new();
        for _ in 0..count {
            items.push(self.item(reader, field.item, room)?);
        }
        Ok(Value::List(items))
    }

    fn item(&self, reader: &mut CdrReader<'_>, item: Item, room: &mut usize) -> Result<Value, Error> {
        match item {
            Item::Record(index) => self.record(reader, index, room),
            Item::Text => {
                take(reader, room)?;
                Ok(Value::Text(reader.text()?.into()))
            }
            Item::Primitive(Primitive::Bool) => {
                take(reader, room)?;
                Ok(Value::Bool(reader.bool()?))
            }
            Item::Primitive(kind) => {
                take(reader, room)?;
                let mut memory = [0; 8];
                reader.numbers(&mut memory[..kind.size()], kind.size())?;
                Ok(kind.value(&memory))
            }
        }
    }
}

pub(super) fn take(reader: &CdrReader<'_>, room: &mut usize) -> Result<(), Error> {
    match room.checked_sub(1) {
        Some(left) => {
            *room = left;
            Ok(())
        }
        None => reader.error("it has more values than bytes"),
    }
}

const TIME: &str = "builtin_interfaces/Time";
const DURATION: &str = "builtin_interfaces/Duration";

/// Returns the messages of a text, each with its fields.
/// The first is called `name`.
pub(super) fn sections<'a>(name: &str, text: &'a str) -> Result<Vec<(String, Vec<SchemaField<'a>>)>, Error> {
    let mut sections = vec![(reference("", name), Vec::new())];
    // Whether a separator was the last that stood there.
    let mut opened = false;
    for (i, line) in text.lines().enumerate() {
        let wrong = |reason: String| Error::Definition { name: name.into(), line: i + 1, reason };
        let line = line.trim();
        if line.len() >= 3 && line.bytes().all(|byte| byte == b'=') {
            opened = true;
            continue;
        }
        let code = line.split('#').next().unwrap_or_default().trim();
        if code.is_empty() {
            continue;
        }
        if let Some(section) = code.strip_prefix("MSG:").map(str::trim) {
            let first = sections.len() == 1 && sections[0].1.is_empty();
            match (opened, first) {
                (true, _) => sections.push((reference("", section), Vec::new())),
                // Some begin with a line for the message itself.
                (false, true) => {}
                (false, false) => return Err(wrong("`MSG:` stands without a line of `=` before it".into())),
            }
            opened = false;
            continue;
        }
        if opened {
            return Err(wrong(format!("expected `MSG: package/Name`, not `{}`", shortened(code))));
        }
        let missing = || wrong(format!("expected a type and a name, not `{}`", shortened(code)));
        let (of, rest) = code.split_once(char::is_whitespace).ok_or_else(missing)?;
        let rest = rest.trim_start();
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let (field, rest) = rest.split_at(end);
        let rest_of_line = rest.trim_start();
        if field.is_empty()
            || !(rest.is_empty() || rest.starts_with(char::is_whitespace) || rest.starts_with('='))
        {
            return Err(missing());
        }
        if !rest_of_line.starts_with('=')
            && let Some((_, fields)) = sections.last_mut()
        {
            fields.push(SchemaField { number: i + 1, of, name: field });
        }
    }
    Ok(sections)
}

/// Shortens a hostile line for a message.
fn shortened(line: &str) -> &str {
    line.char_indices().nth(60).map_or(line, |(end, _)| &line[..end])
}

/// Returns package and name of a message.
/// The reference is `pkg/msg/Name`, `pkg/Name`, or `Name` of the same package.
pub(super) fn reference(package: &str, name: &str) -> String {
    match (name.split_once('/'), name.rsplit_once('/')) {
        (Some((package, _)), Some((_, name))) => format!("{package}/{name}"),
        _ => format!("{package}/{name}"),
    }
}

/// Splits a type from its brackets, and parses these.
pub(super) fn suffix(of: &str) -> Result<(&str, Count), String> {
    let Some((item, inside)) = of.strip_suffix(']').and_then(|of| of.rsplit_once('[')) else {
        return Ok((of, Count::One));
    };
    let number = |text: &str| match text.parse::<u32>() {
        Ok(number) if number > 0 => Ok(number as usize),
        _ => Err(format!("`{}` is not a number of items", shortened(text))),
    };
    match inside.strip_prefix("<=") {
        _ if inside.is_empty() => Ok((item, Count::Any)),
        Some(bound) => number(bound).map(|_| (item, Count::Any)),
        None => number(inside).map(|count| (item, Count::Fixed(count))),
    }
}

/// Returns the primitive type of a name; `None` for a message.
pub(super) fn primitive(name: &str) -> Result<Option<Item>, String> {
    if let Some(kind) = Primitive::named(name) {
        return Ok(Some(Item::Primitive(kind)));
    }
    let (base, bound) = name.split_once("<=").map_or((name, None), |(base, bound)| (base, Some(bound)));
    match (base, bound) {
        ("string", None) => Ok(Some(Item::Text)),
        ("string", Some(bound)) if bound.parse::<u32>().is_ok() => Ok(Some(Item::Text)),
        ("wstring", _) => {
            Err("a `wstring` can't be read: implementations of ROS disagree how it lies in a message".into())
        }
        (_, None) => Ok(None),
        _ => Err(format!("unknown type `{}`", shortened(name))),
    }
}

/// Returns the nesting depth of a record; `None` if it is too deep or endless.
fn height(
    records: &[SchemaRecord],
    index: usize,
    depth: usize,
    known: &mut Vec<Option<usize>>,
) -> Option<usize> {
    if depth > MAX_NESTING {
        return None;
    }
    if let Some(height) = known[index] {
        return (depth + height <= MAX_NESTING).then_some(height);
    }
    let mut own = 0;
    for field in &records[index].types {
        if let Item::Record(inner) = field.item {
            own = own.max(1 + height(records, inner, depth + 1, known)?);
        }
    }
    known[index] = Some(own);
    Some(own)
}
