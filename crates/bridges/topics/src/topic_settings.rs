//! Topics that the table of a bridge and its links name.

use std::sync::Arc;

use slate_ros_messages::DefinitionFiles;
use slate_runtime::configuration::{ExternalDirection, ExternalLink, Span, Spanned, Table, Value};
use slate_sorted::SortedMap;

use crate::options::NodeOptions;
use crate::table_reader::TableReader;
use crate::topic_wait::{TopicWait, WAIT_KEYS};

/// Frame in headers by default.
const DEFAULT_FRAME: &str = "base_link";

const READ_HELP: &str = "write read.\"driver/scan\" = \"/scan\", or = { topic = \"/scan\", depth = 1 }";
const WRITE_HELP: &str =
    "write write.\"/cmd_vel\" = \"r2/wheels/command\", or = { from = \"r2/wheels/command\", depth = 1 }";

/// Options of a topic in a bridge's middleware, such as its quality of service.
pub trait TopicOptions: Clone + Default {
    /// Keys of entries that read a topic.
    const READ_KEYS: &'static [&'static str];

    /// Keys of entries that write a topic.
    const WRITE_KEYS: &'static [&'static str];

    /// Support of ROS message definitions, by the keys `definition` and `type`.
    const HAS_DEFINITION: bool = true;

    /// Support of cycles that wait, by the keys `wait_per`, `timeout` and `late`.
    const CAN_WAIT: bool = false;

    /// Reads them.
    fn read(reader: &mut TableReader<'_>, table: &Table) -> Self;
}

/// Input that reads a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicInput<O> {
    /// Path of the input.
    pub input: String,
    /// Name of the topic, from the root.
    pub topic: String,
    /// Definition of its messages, unless those of the interface.
    pub definition: Option<Arc<DefinitionFiles>>,
    /// Quality of service that it requests.
    pub quality: O,
    /// Messages for which cycles wait, if any.
    pub wait: Option<TopicWait>,
    /// Place in the configuration.
    pub place: Span,
}

/// Topic that has the values of a property.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicOutput<O> {
    /// Name of the topic, from the root.
    pub topic: String,
    /// Path of the property.
    pub property: String,
    /// Frame in the header of messages that have one.
    pub frame: String,
    /// Definition of its messages, unless those of the interface.
    pub definition: Option<Arc<DefinitionFiles>>,
    /// Quality of service that it offers.
    pub quality: O,
    /// Place in the configuration.
    pub place: Span,
}

/// Topics that an agent reads and writes.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicSettings<O> {
    /// Inputs that read topics.
    pub read: Vec<TopicInput<O>>,
    /// Topics that have the values of properties.
    pub write: Vec<TopicOutput<O>>,
}

/// Returns help for a link of a scheme.
pub fn link_help(scheme: &str) -> String {
    format!(
        "write \"driver/scan\" = \"{scheme}:/scan\" or \"{scheme}:/cmd_vel\" = \"/r2/wheels/command\" in [links]"
    )
}

impl<O> TopicSettings<O> {
    /// Returns whether it has no topic.
    pub fn is_empty(&self) -> bool {
        self.read.is_empty() && self.write.is_empty()
    }
}

impl<O: TopicOptions> TopicSettings<O> {
    /// Reads the entries `read` and `write` of a table, and the links of its scheme.
    pub fn read(reader: &mut TableReader<'_>, table: &Table, node: &NodeOptions) -> Self {
        let mut settings = Self { read: Vec::new(), write: Vec::new() };
        settings.inputs(reader, table);
        settings.outputs(reader, table);
        let configuration = reader.configuration();
        for link in configuration.links_of_scheme(reader.scheme()) {
            settings.link(reader, link);
        }
        settings.check(reader, node);
        settings
    }

    fn inputs(&mut self, reader: &mut TableReader<'_>, table: &Table) {
        let empty = Table::default();
        for (input, span, entry) in reader.entries(table, "read", READ_HELP) {
            let input = reader.path(&input, span, READ_HELP);
            let topic = given(reader, &entry, "topic", &read_keys::<O>(), READ_HELP);
            let topic = topic.and_then(|topic| reader.topic(&topic, entry.span, READ_HELP));
            let own = entry.as_table().unwrap_or(&empty);
            let (definition, quality) = (definition::<O>(reader, own), O::read(reader, own));
            let wait = wait::<O>(reader, own);
            let (Some(input), Some(topic)) = (input, topic) else { continue };
            let input = TopicInput { input, topic, definition, quality, wait, place: entry.span };
            self.add_input(reader, input, span);
        }
    }

    fn outputs(&mut self, reader: &mut TableReader<'_>, table: &Table) {
        let empty = Table::default();
        for (topic, span, entry) in reader.entries(table, "write", WRITE_HELP) {
            let topic = reader.topic(&topic, span, WRITE_HELP);
            let property = given(reader, &entry, "from", &write_keys::<O>(), WRITE_HELP);
            let property = property.and_then(|path| reader.path(&path, entry.span, WRITE_HELP));
            let own = entry.as_table().unwrap_or(&empty);
            let definition = definition::<O>(reader, own);
            let (frame, quality) = (frame(reader, own), O::read(reader, own));
            let (Some(topic), Some(property)) = (topic, property) else { continue };
            self.write.push(TopicOutput { topic, property, frame, definition, quality, place: span });
        }
    }

    fn link(&mut self, reader: &mut TableReader<'_>, link: &ExternalLink) {
        let (path, place, own) = (link.path.value.clone(), link.other.span, &link.options);
        let help = link_help(reader.scheme());
        let topic = reader.topic(&link.other.value.address, place, &help);
        let is_in = link.direction == ExternalDirection::In;
        reader.check_keys(own, "of a topic", &if is_in { read_keys::<O>() } else { write_keys::<O>() });
        let definition = definition::<O>(reader, own);
        let (frame, quality) = (frame(reader, own), O::read(reader, own));
        let wait = if is_in { wait::<O>(reader, own) } else { None };
        let Some(topic) = topic else { return };
        if is_in {
            let input = TopicInput { input: path, topic, definition, quality, wait, place };
            self.add_input(reader, input, link.path.span);
        } else {
            self.write.push(TopicOutput { topic, property: path, frame, definition, quality, place });
        }
    }

    /// Adds an input, which may read only one topic.
    fn add_input(&mut self, reader: &mut TableReader<'_>, own: TopicInput<O>, span: Span) {
        if self.read.iter().any(|other| other.input == own.input) {
            let message = format!("/{} reads two topics", own.input);
            reader.add(span, message, "an input reads one: take one away");
        }
        self.read.push(own);
    }

    /// Refuses a topic that two entries write, and one that the node itself publishes.
    fn check(&self, reader: &mut TableReader<'_>, node: &NodeOptions) {
        let mut written: SortedMap<&str, &TopicOutput<O>> = SortedMap::new();
        for output in &self.write {
            if let Some(other) = written.insert(&output.topic, output) {
                let (first, second) = (&other.property, &output.property);
                let message =
                    format!("{} is written by two entries, of /{first} and /{second}", output.topic);
                reader.add(output.place, message, "a topic has the values of one property: take one away");
            }
        }
        let own = [
            (node.log, "/rosout", "rosout = false"),
            (node.clock, "/clock", "clock = false"),
            (node.transforms, "/tf", "tf = false"),
            (node.transforms, "/tf_static", "tf = false"),
        ];
        for (_, topic, setting) in own.into_iter().filter(|(is_on, ..)| *is_on) {
            if let Some(output) = written.get(topic) {
                let message = format!("{topic} is written by /{} and by the node itself", output.property);
                let help = format!("write {setting} in [{}], or take the entry away", reader.scheme());
                reader.add(output.place, message, &help);
            }
        }
        for input in &self.read {
            if let Some(output) = written.get(input.topic.as_str()) {
                let (own, writer) = (&input.input, &output.property);
                let message = format!("{} is read by /{own} and written by /{writer} here", input.topic);
                let help = "link the two: \"driver/scan\" = \"laser/scan\" in [links]";
                reader.add(input.place, message, help);
            }
            if let Some(wait) = &input.wait {
                wait.check(reader, |topic| written.contains_key(topic), node.clock);
            }
        }
    }
}

fn read_keys<O: TopicOptions>() -> Vec<&'static str> {
    let definition: &[_] = if O::HAS_DEFINITION { &["definition", "type"] } else { &[] };
    let wait: &[_] = if O::CAN_WAIT { &WAIT_KEYS } else { &[] };
    [O::READ_KEYS, definition, wait].concat()
}

fn write_keys<O: TopicOptions>() -> Vec<&'static str> {
    let definition: &[_] = if O::HAS_DEFINITION { &["definition", "type"] } else { &[] };
    [O::WRITE_KEYS, &["frame"], definition].concat()
}

fn wait<O: TopicOptions>(reader: &mut TableReader<'_>, table: &Table) -> Option<TopicWait> {
    if O::CAN_WAIT { TopicWait::read(reader, table) } else { None }
}

fn definition<O: TopicOptions>(reader: &mut TableReader<'_>, table: &Table) -> Option<Arc<DefinitionFiles>> {
    if O::HAS_DEFINITION { reader.message_definition(table) } else { None }
}

/// Reads the text of an entry, or of one of its keys.
fn given(
    reader: &mut TableReader<'_>,
    entry: &Spanned<Value>,
    key: &str,
    keys: &[&str],
    help: &str,
) -> Option<String> {
    if let Some(table) = entry.as_table() {
        reader.check_keys(table, "of a topic", &[&[key], keys].concat());
        if table.get(key).is_none() {
            reader.add(entry.span, format!("an entry lacks `{key}`"), help);
        }
        return reader.text(table, key, help).map(|(text, _)| text);
    }
    if entry.as_str().is_none() {
        reader.add(entry.span, format!("an entry is a text or a table, found {}", entry.describe()), help);
    }
    entry.as_str().map(ToOwned::to_owned)
}

fn frame(reader: &mut TableReader<'_>, table: &Table) -> String {
    let given = reader.text(table, "frame", "write frame = \"laser\"");
    given.map_or_else(|| DEFAULT_FRAME.to_owned(), |(frame, _)| frame)
}
