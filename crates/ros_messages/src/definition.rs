use std::fmt::Write;

use slate_blackboard::interface::{Descriptor, Enumeration, Kind};
use slate_sorted::{SortedMap, SortedSet};

use super::cdr::WireFormat;
use super::codec::{hides, is_wrapped};
use super::names::{constant_name, field_name, message_name, unique};
use super::{Primitive, RosPrimitive};

/// Definition of a message, in MCAP's schema encoding `ros2msg`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Definition {
    /// Name, such as `slate_msgs/msg/LaserScan`.
    pub name: String,
    /// Fields, followed by the messages in it.
    pub text: String,
}

/// Line between two messages of a definition.
pub const SEPARATOR: &str =
    "================================================================================";

/// Returns the definition of the message of [`encode`](super::encode).
/// It is for a value of that interface.
///
/// Each field of the interface is a field of the message, with its documentation and unit as a comment:
///
/// | interface | message |
/// |---|---|
/// | numbers, `Bool` | the same |
/// | enumeration | the integer that carries it, with constants `FIELD_NAME` |
/// | `Text` | bounded string |
/// | `Optional` | `has_NAME` and `NAME` |
/// | array, `Sequence`, tail | array, bounded sequence, sequence |
/// | another interface | another message |
/// | list of lists or of `Optional` | list of messages with one field `value` |
///
/// Names are changed where ROS would not have them. An interface with fields that can hide bits, such as those behind the
/// end of a text, has one more field `memory`: the whole value, when it does.
pub fn definition(descriptor: &Descriptor) -> Definition {
    definition_named(descriptor, descriptor.name)
}

/// Returns the definition of an interface under a name of the caller's.
/// Files in which two interfaces have one name need it: many readers take all messages of a name for the same.
pub fn definition_named(descriptor: &Descriptor, name: &str) -> Definition {
    build(WireFormat::Cdr, descriptor, name)
}

/// Returns the definition of an interface for the ROS of a format.
/// ROS 1 has no bounds of lists and texts, and calls it `slate_msgs/LaserScan`.
pub fn definition_in(format: WireFormat, descriptor: &Descriptor) -> Definition {
    let mut definition = build(format, descriptor, descriptor.name);
    if format == WireFormat::Ros1 {
        definition.name = definition.name.replacen("/msg/", "/", 1);
    }
    definition
}

fn build(format: WireFormat, descriptor: &Descriptor, name: &str) -> Definition {
    let name = message_name(name);
    let mut builder = Builder {
        names: SortedSet::from([name.clone()]),
        top: name.clone(),
        format,
        known: SortedMap::new(),
        sections: Vec::new(),
    };
    let mut body = MessageText::default();
    comment(&mut body.text, descriptor.doc, "");
    builder.fields(&mut body, &name, descriptor);
    if hides(descriptor) {
        let memory = field_name("memory", &mut body.fields);
        comment(&mut body.text, MEMORY, "");
        line(&mut body.text, "uint8[]", &memory);
    }
    body.close(format);
    let mut text = body.text;
    for section in builder.sections {
        text.push_str(SEPARATOR);
        text.push('\n');
        text.push_str(&section);
    }
    Definition { name: format!("{PACKAGE}/msg/{name}"), text }
}

pub(super) const PACKAGE: &str = "slate_msgs";

/// Doc of the field `memory`.
const MEMORY: &str = "The whole value, when it holds bits that the fields above don't show.";

/// Returns the name of the field with the whole value as memory, if any.
pub(super) fn memory(definition: &str) -> Option<&str> {
    let comment = |line: &&str| line.strip_prefix("# ") == Some(MEMORY);
    let mut lines = definition.lines().skip_while(|line| !comment(line));
    lines.nth(1)?.strip_prefix("uint8[] ")
}

struct Builder {
    /// ROS 1 has no bounds of lists and texts, and messages without fields.
    format: WireFormat,
    /// Name of the message as a whole.
    /// Names of messages in it begin with it, so those of two files' interfaces don't collide.
    top: String,
    names: SortedSet<String>,
    /// Names of nested interfaces, by name and schema.
    known: SortedMap<(&'static str, u64), String>,
    sections: Vec<String>,
}

/// Message text under construction.
#[derive(Default)]
struct MessageText {
    text: String,
    fields: SortedSet<String>,
    constants: SortedSet<String>,
}

impl MessageText {
    /// Ends the message.
    /// A message without fields has one, because ROS 2 requires it.
    fn close(&mut self, format: WireFormat) {
        if self.fields.is_empty() && format == WireFormat::Cdr {
            line(&mut self.text, "uint8", "structure_needs_at_least_one_member");
        }
    }
}

impl Builder {
    fn fields(&mut self, body: &mut MessageText, owner: &str, descriptor: &Descriptor) {
        for field in descriptor.fields {
            // It takes no byte of the message.
            if matches!(field.kind, Kind::Array(_, 0)) {
                continue;
            }
            comment(&mut body.text, field.doc, field.unit);
            self.field(body, owner, field.name, &field.kind);
        }
    }

    fn field(&mut self, body: &mut MessageText, owner: &str, name: &str, kind: &Kind) {
        let kind = match kind {
            Kind::Array(_, 0) => return,
            Kind::Optional(item) => {
                let flag = field_name(&format!("has_{name}"), &mut body.fields);
                line(&mut body.text, "bool", &flag);
                return self.field(body, owner, name, item);
            }
            other => other,
        };
        let name = field_name(name, &mut body.fields);
        let (item, suffix) = match kind {
            Kind::Array(item, count) => (*item, format!("[{count}]")),
            Kind::Sequence(item, capacity) if *capacity > 0 && self.format == WireFormat::Cdr => {
                (*item, format!("[<={capacity}]"))
            }
            Kind::Sequence(item, _) | Kind::Tail(item) => (*item, "[]".into()),
            single => (single, String::new()),
        };
        if let Kind::Enumeration(enumeration) = item {
            constants(body, &name, enumeration);
        }
        let of = self.item(owner, &name, item);
        line(&mut body.text, &format!("{of}{suffix}"), &name);
    }

    /// Returns the name of a type in the definition.
    fn item(&mut self, owner: &str, field: &str, item: &Kind) -> String {
        match item {
            Kind::Text(capacity) if *capacity > 0 && self.format == WireFormat::Cdr => {
                format!("string<={capacity}")
            }
            Kind::Text(_) => "string".into(),
            Kind::Enumeration(enumeration) => self.item(owner, field, &enumeration.carrier),
            Kind::Nested(descriptor) => self.nested(descriptor),
            wrapped if is_wrapped(wrapped) => {
                let name = unique(format!("{owner}{}", message_name(field)), &mut self.names);
                let mut body = MessageText::default();
                self.field(&mut body, &name, "value", wrapped);
                self.add(&name, body);
                format!("{PACKAGE}/{name}")
            }
            number => Primitive::of(number).map_or("uint8", RosPrimitive::ros_name).into(),
        }
    }

    fn nested(&mut self, descriptor: &'static Descriptor) -> String {
        let key = (descriptor.name, descriptor.hash);
        if let Some(known) = self.known.get(&key) {
            return format!("{PACKAGE}/{known}");
        }
        let name = unique(format!("{}{}", self.top, message_name(descriptor.name)), &mut self.names);
        self.known.insert(key, name.clone());
        let mut body = MessageText::default();
        comment(&mut body.text, descriptor.doc, "");
        self.fields(&mut body, &name, descriptor);
        self.add(&name, body);
        format!("{PACKAGE}/{name}")
    }

    fn add(&mut self, name: &str, mut body: MessageText) {
        body.close(self.format);
        self.sections.push(format!("MSG: {PACKAGE}/{name}\n{}", body.text));
    }
}

fn constants(body: &mut MessageText, field: &str, enumeration: &Enumeration) {
    let carrier = Primitive::of(&enumeration.carrier).filter(|carrier| carrier.integers().is_some());
    let Some(carrier) = carrier else { return };
    for constant in enumeration.constants {
        // No value of the enumeration can have a number that its carrier can't hold.
        if carrier.range().contains(&constant.value.into()) {
            let name = constant_name(field, constant.name, &mut body.constants);
            comment(&mut body.text, constant.doc, "");
            line(&mut body.text, carrier.ros_name(), &format!("{name}={}", constant.value));
        }
    }
}

fn line(text: &mut String, first: &str, second: &str) {
    // Writing into a string can't fail.
    let _ = writeln!(text, "{first} {second}");
}

/// Writes documentation with its unit in brackets, as ROS's messages have it.
fn comment(text: &mut String, doc: &str, unit: &str) {
    let doc: String = doc
        .chars()
        .map(|c| if c.is_control() || c == '\u{2028}' || c == '\u{2029}' { ' ' } else { c })
        .collect();
    let unit: String = unit.chars().filter(|c| !c.is_control()).collect();
    let _ = match (doc.trim(), unit.trim()) {
        ("", "") => Ok(()),
        (doc, "") => writeln!(text, "# {doc}"),
        ("", unit) => writeln!(text, "# [{unit}]"),
        (doc, unit) => writeln!(text, "# {doc} [{unit}]"),
    };
}
