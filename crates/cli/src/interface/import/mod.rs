//! Interfaces with the fields of messages that `.msg` files define.

mod constants;
mod source;

use std::path::PathBuf;

use clap::Args;
use slate::blackboard::interface::{Descriptor, Kind, Primitive};
use slate::interfaces;
use slate::ros_messages::{
    DefinedConstant, DefinedCount, DefinedField, DefinedItem, DefinedMessage, DefinitionFiles, FileError,
    WireFormat,
};
use slate_sorted::{SortedMap, SortedSet};

use self::constants::{ImportedEnumeration, enumerations};
use super::parse;
use crate::failure::Failure;

#[derive(Debug, Args)]
pub struct ImportInterface {
    /// `.msg` file; nested messages are searched for beside it
    /// and in `PACKAGE/msg/NAME.msg` below the same root
    file: PathBuf,

    /// Type, such as `my_package/msg/Sample`
    /// [default: by the path, `PACKAGE/msg/NAME.msg`]
    #[arg(long = "type", value_name = "TYPE")]
    kind: Option<String>,

    /// Read ROS 1 definitions
    #[arg(long)]
    ros1: bool,

    /// Capacity of an unbounded sequence, in items
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..))]
    items: u32,

    /// Capacity of an unbounded string, in bytes
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    text: u32,

    /// New file [default: stdout]
    #[arg(long, short, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Largest interface without its tail, bytes: its values lie in place.
const MAX_SIZE: usize = 1 << 20;

/// Returns the source of the interface of a `.msg` file, and of nested ones.
pub fn import(options: &ImportInterface) -> Result<String, Failure> {
    let refuse = |FileError { location, reason }: FileError| {
        // An empty file has no lines.
        let location = if location.contains(".msg") { location } else { options.file.display().to_string() };
        Failure::Interface { place: location, problem: reason }
    };
    let files = read(options).map_err(refuse)?;
    let mut messages = files.messages().map_err(refuse)?;
    messages.extend(["Time", "Duration"].map(stamp));
    let mut importer = Importer::new(options, &files, &messages);
    importer.whole().map_err(refuse)?;
    let source = source::source(options, files.definition().name.as_str(), &importer.imported);
    check(&files, &source).map_err(refuse)?;
    Ok(source)
}

fn read(options: &ImportInterface) -> Result<DefinitionFiles, FileError> {
    let ImportInterface { file, kind, .. } = options;
    if file.extension().is_none_or(|extension| extension != "msg") {
        let reason = "expected the definition of a message, a file NAME.msg".into();
        return Err(FileError { location: file.display().to_string(), reason });
    }
    let format = if options.ros1 { WireFormat::Ros1 } else { WireFormat::Cdr };
    DefinitionFiles::read(format, file, kind.as_deref())
}

/// Checks the round trip of values: interface to message and back.
fn check(files: &DefinitionFiles, source: &str) -> Result<(), FileError> {
    let found = parse::interfaces(source).map_err(|wrong| files.error_at(1, wrong.message))?;
    let Some(whole) = found.last() else { return Err(files.error_at(1, "it has no message".into())) };
    files.standard(whole.descriptor)?.check_decodable().map_err(|reason| files.error_at(1, reason))
}

/// Returns a message that needs no definition.
fn stamp(name: &str) -> DefinedMessage<'static> {
    let field = |name, primitive, doc| DefinedField {
        line: 1,
        name,
        item: DefinedItem::Number(primitive),
        count: DefinedCount::One,
        doc: vec![doc],
    };
    DefinedMessage {
        key: format!("builtin_interfaces/{name}"),
        line: 1,
        doc: Vec::new(),
        fields: vec![
            field("sec", Primitive::I32, "Whole seconds [s]"),
            field("nanosec", Primitive::U32, "Rest [ns]"),
        ],
        constants: Vec::new(),
    }
}

/// Interface with the fields of a message.
struct ImportedInterface<'a> {
    name: String,
    message: &'a DefinedMessage<'a>,
    fields: Vec<ImportedField<'a>>,
    enumerations: Vec<ImportedEnumeration<'a>>,
    /// Constants that are of no enumeration.
    constants: Vec<&'a DefinedConstant<'a>>,
    has_tail: bool,
}

struct ImportedField<'a> {
    defined: &'a DefinedField<'a>,
    /// Type in Rust.
    kind: String,
}

/// Rust type and its layout in memory.
#[derive(Clone, Debug)]
struct PlainType {
    name: String,
    size: usize,
    align: usize,
}

struct Importer<'a> {
    options: &'a ImportInterface,
    files: &'a DefinitionFiles,
    messages: &'a [DefinedMessage<'a>],
    /// Names of interfaces and enumerations.
    names: SortedSet<String>,
    /// Types of messages, by package and name.
    types: SortedMap<&'a str, PlainType>,
    /// Interfaces; nested ones come first.
    imported: Vec<ImportedInterface<'a>>,
}

impl<'a> Importer<'a> {
    fn new(
        options: &'a ImportInterface,
        files: &'a DefinitionFiles,
        messages: &'a [DefinedMessage<'a>],
    ) -> Self {
        let names = interfaces::ALL.iter().map(|known| known.name);
        // Names that the prelude or the macro needs.
        let names = names.chain(["Bool", "Head", "Optional", "Self", "Sequence", "Text"]);
        Self {
            options,
            files,
            messages,
            names: names.map(ToOwned::to_owned).collect(),
            types: SortedMap::new(),
            imported: Vec::new(),
        }
    }

    fn whole(&mut self) -> Result<(), FileError> {
        let Some(whole) = self.messages.first() else { return Ok(()) };
        let name = self.interface_name(&whole.key);
        self.interface(whole, name, true).map(drop)
    }

    /// Returns the interface's name for a message.
    /// It includes the package when the name is taken.
    fn interface_name(&mut self, key: &str) -> String {
        let (package, name) = key.split_once('/').unwrap_or(("", key));
        let (package, name) = (camel_case(package), camel_case(name));
        let is_taken = self.names.contains(&name) || name.starts_with(|first: char| first.is_ascii_digit());
        let name = if is_taken { format!("{package}{name}") } else { name };
        unique(name, &mut self.names)
    }

    /// Adds the interface of a message, after those in it.
    fn interface(
        &mut self,
        message: &'a DefinedMessage<'a>,
        name: String,
        is_whole: bool,
    ) -> Result<PlainType, FileError> {
        let files = self.files;
        // Topics set the header from the time of the value and the frame of the topic.
        let is_header =
            |field: &DefinedField<'_>| is_whole && field.name == "header" && is_one(field, "std_msgs/Header");
        let is_left_out = |field: &DefinedField<'a>| is_header(field) || self.is_empty(field);
        let fields: Vec<_> = message.fields.iter().filter(|field| !is_left_out(field)).collect();
        if fields.is_empty() {
            let reason = "a message without fields beside its header has no values for an interface";
            return Err(files.error_at(message.line, reason.into()));
        }
        let (enumerations, constants) = enumerations(&name, message, &mut self.names)
            .map_err(|(line, reason)| files.error_at(line, reason))?;
        let unbounded = fields.iter().filter(|field| field.count == DefinedCount::Any).count();
        let (mut imported, mut size, mut align, mut has_tail) = (Vec::new(), 0_usize, 1, false);
        for (at, field) in fields.iter().enumerate() {
            let wrong = |reason| files.error_at(field.line, reason);
            check_name(field.name).map_err(wrong)?;
            let enumeration = enumerations.iter().find(|own| own.field == field.name);
            let item = self.item(field, enumeration)?;
            let is_last = at + 1 == fields.len() && unbounded == 1;
            let own = if is_whole && is_last && field.count == DefinedCount::Any {
                has_tail = true;
                PlainType { name: format!("[{}]", item.name), size: 0, align: item.align }
            } else {
                list(item, field.count, self.options.items as usize)
            };
            size = size.next_multiple_of(own.align) + own.size;
            align = align.max(own.align);
            if size > MAX_SIZE {
                let reason = format!(
                    "up to here a value takes {size} bytes, and an interface at most {MAX_SIZE}: give lists and texts without a bound less room with --items and --text"
                );
                return Err(wrong(reason));
            }
            imported.push(ImportedField { defined: field, kind: own.name });
        }
        let whole = PlainType { name: name.clone(), size: size.next_multiple_of(align), align };
        self.imported.push(ImportedInterface {
            name,
            message,
            fields: imported,
            enumerations,
            constants,
            has_tail,
        });
        Ok(whole)
    }

    /// Returns whether a field is a message without fields.
    fn is_empty(&self, field: &DefinedField<'_>) -> bool {
        let DefinedItem::Message(key) = &field.item else { return false };
        let mut inner = self.messages.iter().filter(|message| message.key == *key);
        field.count == DefinedCount::One && inner.any(|message| message.fields.is_empty())
    }

    /// Returns the type of a field, or of its items.
    fn item(
        &mut self,
        field: &DefinedField<'a>,
        enumeration: Option<&ImportedEnumeration<'_>>,
    ) -> Result<PlainType, FileError> {
        match &field.item {
            DefinedItem::Number(primitive) => {
                let name = match (enumeration, primitive) {
                    (Some(enumeration), _) => enumeration.name.clone(),
                    (None, Primitive::Bool) => "Bool".into(),
                    (None, number) => number.name().into(),
                };
                Ok(PlainType { name, size: primitive.size(), align: primitive.size() })
            }
            DefinedItem::Text(bound) => {
                let capacity = bound.unwrap_or(self.options.text as usize).max(1).next_multiple_of(4);
                Ok(PlainType { name: format!("Text<{capacity}>"), size: 4 + capacity, align: 4 })
            }
            DefinedItem::Message(key) => self.message(key, field.line),
        }
    }

    /// Returns the type of a message in another.
    fn message(&mut self, key: &str, line: usize) -> Result<PlainType, FileError> {
        if let Some(known) = self.types.get(key) {
            return Ok(known.clone());
        }
        let Some(message) = self.messages.iter().find(|message| message.key == key) else {
            return Err(self.files.error_at(line, format!("`{key}` is not defined in the files")));
        };
        if message.fields.is_empty() {
            let reason = format!("`{key}` has no fields, so no interface can have a list of it");
            return Err(self.files.error_at(line, reason));
        }
        let own = match interfaces::ALL.iter().find(|known| is_same(known, message)) {
            Some(known) => PlainType { name: known.name.into(), size: known.size, align: known.align },
            None => {
                let name = self.interface_name(key);
                self.interface(message, name, false)?
            }
        };
        self.types.insert(&message.key, own.clone());
        Ok(own)
    }
}

/// Checks that a field can have that name in Rust.
/// Keywords become raw identifiers, with a few exceptions.
fn check_name(name: &str) -> Result<(), String> {
    let is_name = name.starts_with(|first: char| first.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    match is_name && !matches!(name, "self" | "Self" | "super" | "crate") {
        true => Ok(()),
        false => Err(format!(
            "`{name}` can't be the name of a field: expected letters, digits and `_`, such as `x`, and none of self, super and crate"
        )),
    }
}

/// Returns whether a field is one message of that package and name.
fn is_one(field: &DefinedField<'_>, key: &str) -> bool {
    field.count == DefinedCount::One && matches!(&field.item, DefinedItem::Message(own) if own == key)
}

/// Returns whether an interface of Slate equals a message, field by field.
fn is_same(known: &Descriptor, message: &DefinedMessage<'_>) -> bool {
    let is_equal = |(own, field): (&slate::blackboard::interface::Field, &DefinedField<'_>)| {
        let is_number = matches!((own.kind, &field.item), (Kind::Primitive(own), DefinedItem::Number(theirs)) if own == *theirs);
        own.name == field.name && field.count == DefinedCount::One && is_number
    };
    known.ros == ros_name(&message.key)
        && known.fields.len() == message.fields.len()
        && known.fields.iter().zip(&message.fields).all(is_equal)
}

/// Returns a list of items; `items` bounds it if the definition does not.
fn list(item: PlainType, count: DefinedCount, items: usize) -> PlainType {
    let PlainType { name, size, align } = item;
    // Nothing may pad a sequence, whose length has 32 bits.
    let step = (1..=4).find(|step| (step * size).is_multiple_of(4)).unwrap_or(1);
    match count {
        DefinedCount::One => PlainType { name, size, align },
        DefinedCount::Fixed(count) => {
            PlainType { name: format!("[{name}; {count}]"), size: size * count, align }
        }
        DefinedCount::Bounded(_) | DefinedCount::Any => {
            let count = if let DefinedCount::Bounded(bound) = count { bound } else { items };
            let count = count.next_multiple_of(step);
            PlainType {
                name: format!("Sequence<{name}, {count}>"),
                size: 8 + size * count,
                align: align.max(4),
            }
        }
    }
}

/// Converts `std_msgs/Header` to `std_msgs/msg/Header`.
fn ros_name(key: &str) -> String {
    key.replacen('/', "/msg/", 1)
}

/// Converts `arm_msgs` to `ArmMsgs`; capital letters stay.
fn camel_case(name: &str) -> String {
    let mut result = String::new();
    for word in name.split(|c: char| !c.is_ascii_alphanumeric()) {
        let mut letters = word.chars();
        result.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        result.extend(letters);
    }
    result
}

/// Returns the name, with a number if it is taken.
fn unique(name: String, taken: &mut SortedSet<String>) -> String {
    let mut result = name.clone();
    let mut number = 2_usize;
    while !taken.insert(result.clone()) {
        result = format!("{name}{number}");
        number += 1;
    }
    result
}
