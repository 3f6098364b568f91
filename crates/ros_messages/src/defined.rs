//! Messages of a definition with their comments and constants.

use super::files::BUILTIN;
use super::schema::{primitive, reference, sections, suffix};
use super::{Definition, DefinitionFiles, Error, FileError, Primitive, RosPrimitive};

/// A message of a definition.
#[derive(Clone, Debug)]
pub struct DefinedMessage<'a> {
    /// Package and name, such as `std_msgs/Header`.
    pub key: String,
    /// Line of its first field in the definition, from 1.
    pub line: usize,
    /// Comment before the first empty line, by line.
    pub doc: Vec<&'a str>,
    /// Fields, in order.
    pub fields: Vec<DefinedField<'a>>,
    /// Constants, in order.
    pub constants: Vec<DefinedConstant<'a>>,
}

/// A field of a message.
#[derive(Clone, Debug)]
pub struct DefinedField<'a> {
    /// Line in the definition, from 1.
    pub line: usize,
    /// Name.
    pub name: &'a str,
    /// Item.
    pub item: DefinedItem,
    /// Number of items.
    pub count: DefinedCount,
    /// Comments above and behind it, by line.
    pub doc: Vec<&'a str>,
}

/// Type of a field, or of its items.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DefinedItem {
    /// Number or truth value.
    Number(Primitive),
    /// Text, with its greatest length in bytes.
    Text(Option<usize>),
    /// Message, by package and name.
    Message(String),
}

/// Number of a field's items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefinedCount {
    /// The field is not a list.
    One,
    /// Always as many.
    Fixed(usize),
    /// At most that many items.
    Bounded(usize),
    /// Any number of items.
    Any,
}

/// A constant of a message.
#[derive(Clone, Debug)]
pub struct DefinedConstant<'a> {
    /// Line in the definition, from 1.
    pub line: usize,
    /// Name.
    pub name: &'a str,
    /// Type.
    pub item: DefinedItem,
    /// Value, as the definition has it.
    pub value: &'a str,
    /// Comments above and behind it, by line.
    pub doc: Vec<&'a str>,
}

impl DefinitionFiles {
    /// Returns the message and those in it, with their comments; the whole one first.
    ///
    /// # Errors
    /// The definition is invalid.
    pub fn messages(&self) -> Result<Vec<DefinedMessage<'_>>, FileError> {
        messages(self.definition()).map_err(|error| self.error(error))
    }

    /// Returns an error at a line of the definition, with its place in the files.
    pub fn error_at(&self, line: usize, reason: String) -> FileError {
        self.error(Error::Definition { name: self.definition().name.clone(), line, reason })
    }
}

fn messages(definition: &Definition) -> Result<Vec<DefinedMessage<'_>>, Error> {
    let wrong = |line, reason| Error::Definition { name: definition.name.clone(), line, reason };
    let sections = sections(&definition.name, &definition.text)?;
    let keys: Vec<_> = sections.iter().map(|(key, _)| key.clone()).collect();
    let mut lines = definition.text.lines().enumerate();
    let mut messages = Vec::new();
    for (key, fields) in sections {
        let line = fields.first().map_or(1, |field| field.number);
        let mut fields = fields.into_iter().peekable();
        let mut message =
            DefinedMessage { key, line, doc: Vec::new(), fields: Vec::new(), constants: Vec::new() };
        let mut comments = Comments::default();
        for (at, line) in lines.by_ref() {
            let (text, number) = (line.trim(), at + 1);
            if text.len() >= 3 && text.bytes().all(|byte| byte == b'=') {
                // The line with the name of the next one.
                let _ = lines.next();
                break;
            }
            if let Some(field) = fields.next_if(|field| field.number == number) {
                let (item, count) =
                    field_type(&message.key, field.of, &keys).map_err(|reason| wrong(number, reason))?;
                let doc = comments.above(comment(text));
                message.fields.push(DefinedField { line: number, name: field.name, item, count, doc });
            } else if let Some((of, name, value)) = constant(text) {
                let (item, _) =
                    field_type(&message.key, of, &keys).map_err(|reason| wrong(number, reason))?;
                let doc = comments.above(comment(text).filter(|_| !is_text(of)));
                message.constants.push(DefinedConstant { line: number, name, item, value, doc });
            } else if text.is_empty() {
                let paragraph = comments.end();
                if message.fields.is_empty() && message.constants.is_empty() && message.doc.is_empty() {
                    message.doc = paragraph;
                }
            } else if comments.goes_on(line)
                && let Some(doc) = message.last_doc()
            {
                doc.extend(comment(text));
            } else {
                comments.add(comment(text));
            }
        }
        messages.push(message);
    }
    Ok(messages)
}

/// Returns the type of a message's field; those of `keys` are defined.
fn field_type(owner: &str, of: &str, keys: &[String]) -> Result<(DefinedItem, DefinedCount), String> {
    let (item, _) = suffix(of)?;
    let number = |text: &str| text.parse().map_err(|_| format!("`{of}` has no number of items"));
    let count = match of.strip_prefix(item).and_then(|rest| rest.strip_prefix('[')?.strip_suffix(']')) {
        None => DefinedCount::One,
        Some("") => DefinedCount::Any,
        Some(inside) => match inside.strip_prefix("<=") {
            Some(bound) => DefinedCount::Bounded(number(bound)?),
            None => DefinedCount::Fixed(number(inside)?),
        },
    };
    if let Some(primitive) = Primitive::named(item) {
        return Ok((DefinedItem::Number(primitive), count));
    }
    if primitive(item)?.is_some() {
        let bound = item.split_once("<=").map(|(_, bound)| number(bound)).transpose()?;
        return Ok((DefinedItem::Text(bound), count));
    }
    let package = owner.split('/').next().unwrap_or_default();
    let own = match item {
        // Of ROS 1, where they are not messages.
        "time" => BUILTIN[0].to_owned(),
        "duration" => BUILTIN[1].to_owned(),
        item => reference(package, item),
    };
    let key = if item == "Header" && !keys.contains(&own) { "std_msgs/Header".to_owned() } else { own };
    if !keys.contains(&key) && !BUILTIN.contains(&key.as_str()) {
        return Err(format!("`{item}` is not defined in the text"));
    }
    Ok((DefinedItem::Message(key), count))
}

impl<'a> DefinedMessage<'a> {
    /// Returns the documentation of the last field or constant.
    fn last_doc(&mut self) -> Option<&mut Vec<&'a str>> {
        let (field, constant) = (self.fields.last_mut(), self.constants.last_mut());
        match (field, constant) {
            (Some(field), Some(constant)) if constant.line > field.line => Some(&mut constant.doc),
            (Some(field), _) => Some(&mut field.doc),
            (None, constant) => constant.map(|constant| &mut constant.doc),
        }
    }
}

/// Comments above a field, and behind it.
#[derive(Default)]
struct Comments<'a> {
    /// Lines since the last field, constant or empty line.
    lines: Vec<&'a str>,
    /// Set if that line had a comment, which may continue in the next one.
    is_open: bool,
}

impl<'a> Comments<'a> {
    /// Returns the documentation of a field or constant.
    /// It is made of the lines above, and the comment behind it.
    fn above(&mut self, behind: Option<&'a str>) -> Vec<&'a str> {
        let mut doc = std::mem::take(&mut self.lines);
        self.is_open = behind.is_some();
        doc.extend(behind);
        doc
    }

    /// Returns true if a line continues the comment behind the field above.
    /// Such a line is indented.
    fn goes_on(&self, line: &str) -> bool {
        self.is_open && self.lines.is_empty() && line.starts_with([' ', '\t'])
    }

    fn add(&mut self, comment: Option<&'a str>) {
        self.lines.extend(comment);
        self.is_open = false;
    }

    /// Returns the lines before an empty one.
    fn end(&mut self) -> Vec<&'a str> {
        self.is_open = false;
        std::mem::take(&mut self.lines)
    }
}

/// Returns the comment of a line; `None` without text.
fn comment(line: &str) -> Option<&str> {
    let (_, comment) = line.split_once('#')?;
    Some(comment.trim_start_matches('#').trim()).filter(|comment| !comment.is_empty())
}

/// Returns true if a type is a text.
/// Constants of a text extend to the end of their line.
fn is_text(of: &str) -> bool {
    of.starts_with("string") || of.starts_with("wstring")
}

/// Returns type, name and value of a constant.
fn constant(line: &str) -> Option<(&str, &str, &str)> {
    let (of, rest) = line.split_once(char::is_whitespace)?;
    let (name, value) = rest.split_once('=')?;
    let value = if is_text(of) { value } else { value.split('#').next()? };
    let name = name.trim();
    let is_name = !of.contains('#') && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    (is_name && !name.is_empty()).then_some((of, name, value.trim()))
}
