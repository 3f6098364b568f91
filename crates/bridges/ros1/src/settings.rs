//! The table `[ros1]` of a configuration, and links with `ros1:`.

use std::collections::BTreeMap;
use std::net::IpAddr;

use slate_record::ros::WireFormat;
use slate_runtime::Message;
use slate_runtime::configuration::{
    Configuration, Diagnostic, ExternalDirection, ExternalLink, Report, Span, Spanned, Table, Value,
};
use slate_topics::{
    KeyedValue, NodeOptions, OPTION_KEYS, ServiceCall, ServiceOffer, ServiceType, ServicesReader, TableReader,
};

use crate::name::{check_name, node_of_agent, whole_name};

/// Scheme of links, and name of the table.
pub const SCHEME: &str = "ros1";

/// The variable that programs of ROS have the master's address from.
const MASTER: &str = "ROS_MASTER_URI";

/// Largest depth.
const MAX_DEPTH: i64 = 10_000;

/// Messages that wait unless said.
const DEPTH: u16 = 10;

/// Frame in headers unless said.
const FRAME: &str = "base_link";

/// Which topics of ROS 1 an agent reads and writes.
///
/// ```
/// use slate_ros1::Ros1Settings;
/// use slate_runtime::configuration::{Configuration, Options};
///
/// let options = Options { extra_tables: vec!["ros1".into()], ..Options::default() };
/// let read = |text: &str| Configuration::from_text("r2.toml", text, &options);
/// let text = "[ros1]\nmaster = \"http://robot:11311\"\ntrusted = true\n[links]\n\"driver/scan\" = \"ros1:/scan\"";
/// let settings = Ros1Settings::of(&read(text)?)?.ok_or("no links")?;
/// assert_eq!((settings.master.as_str(), settings.read[0].topic.as_str()), ("http://robot:11311", "/scan"));
/// let wrong = read("[ros1]\nwrite.\"/cmd-vel\" = \"r2/wheels/command\"")?;
/// assert!(Ros1Settings::of(&wrong).is_err_and(|report| report.to_string().contains("cmd-vel")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Ros1Settings {
    /// Address of the master, such as `http://localhost:11311`.
    pub master: String,
    /// As what the agent appears, such as `/r2`.
    pub node: String,
    /// Whether it speaks to other machines, in clear text.
    pub trusted: bool,
    /// Inputs that topics fill.
    pub read: Vec<ReadTopic>,
    /// Topics that have the values of properties.
    pub write: Vec<WrittenTopic>,
    /// Inboxes that are services.
    pub serve: Vec<ServiceOffer>,
    /// Services that outboxes call.
    pub call: Vec<ServiceCall>,
    /// Its other features.
    pub options: NodeOptions,
}

/// An input that a topic fills.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadTopic {
    /// Path of the input.
    pub input: String,
    /// The topic, from the root.
    pub topic: String,
    /// Messages that may wait.
    pub depth: u16,
    /// Where it is written in the configuration.
    pub place: Span,
}

/// A topic that has the values of a property.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenTopic {
    /// The topic, from the root.
    pub topic: String,
    /// Path of the property.
    pub property: String,
    /// Frame in the header of messages that have one.
    pub frame: String,
    /// Whether later subscribers get the last message.
    pub latched: bool,
    /// Messages that may wait for a slow subscriber.
    pub depth: u16,
    /// Where it is written in the configuration.
    pub place: Span,
}

const KNOWN: [&str; 7] = ["master", "node", "trusted", "read", "write", "serve", "call"];
const READING: [&str; 1] = ["depth"];
const WRITING: [&str; 3] = ["depth", "latched", "frame"];

const LINK: &str =
    "write \"driver/scan\" = \"ros1:/scan\" or \"ros1:/cmd_vel\" = \"/r2/wheels/command\" in [links]";
const READ: &str = "write read.\"driver/scan\" = \"/scan\", or = { topic = \"/scan\", depth = 1 }";
const WRITE: &str =
    "write write.\"/cmd_vel\" = \"r2/wheels/command\", or = { from = \"r2/wheels/command\", latched = true }";

impl Ros1Settings {
    /// Reads the table `[ros1]`, which it has to be read with as one of
    /// [`extra_tables`](slate_runtime::configuration::Options::extra_tables), and in links with `ros1:`; nothing without both.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn of(configuration: &Configuration) -> Result<Option<Self>, Report> {
        let root = configuration.value(SCHEME);
        if root.is_none() && configuration.links_of_scheme(SCHEME).next().is_none() {
            return Ok(None);
        }
        let node = format!("/{}", node_of_agent(configuration.agent_name()));
        let mut reader = Ros1SettingsReader { configuration, node, wrong: Vec::new() };
        let settings = reader.settings(root);
        if reader.wrong.is_empty() { Ok(Some(settings)) } else { Err(Report::from(reader.wrong)) }
    }

    /// Whether the agent has nothing to do with any other node.
    fn is_empty(&self) -> bool {
        self.read.is_empty() && self.write.is_empty() && self.serve.is_empty() && self.call.is_empty()
    }
}

struct Ros1SettingsReader<'c> {
    configuration: &'c Configuration,
    /// The whole name of the node.
    node: String,
    wrong: Vec<Diagnostic>,
}

impl Ros1SettingsReader<'_> {
    fn note(&mut self, span: Option<Span>, message: impl Into<Message>, help: &str) {
        self.wrong.push(match span {
            Some(span) => self.configuration.diagnostic(span, message, Some(help.into())),
            None => Diagnostic::without_place(message, Some(help.into())),
        });
    }

    fn settings(&mut self, root: Option<&Spanned<Value>>) -> Ros1Settings {
        let empty = Table::default();
        let place = root.map(|root| root.span);
        let table = root.map_or(Some(&empty), |root| root.as_table());
        if let (None, Some(root)) = (table, root) {
            let message = format!("`{SCHEME}` is a table, found {}", root.describe());
            self.note(place, message, "write [ros1]");
        }
        let table = table.unwrap_or(&empty);
        let known = [&KNOWN, &OPTION_KEYS[..]].concat();
        self.wrong.extend(self.configuration.unknown_keys(table, "in [ros1]", &known));
        self.node = self.node(table);
        let trusted = self.truth(table, "trusted");
        let mut settings = Ros1Settings {
            master: self.master(table, trusted, place),
            node: self.node.clone(),
            trusted,
            read: Vec::new(),
            write: Vec::new(),
            serve: Vec::new(),
            call: Vec::new(),
            options: NodeOptions::default(),
        };
        self.inputs(table, &mut settings);
        self.outputs(table, &mut settings);
        let mut services = ServicesReader::new(self, "std_srvs/SetBool");
        (settings.serve, settings.call) = (services.offers(table), services.calls(table));
        settings.options = NodeOptions::of(self, table);
        for link in self.configuration.links_of_scheme(SCHEME) {
            self.link(link, &mut settings);
        }
        self.check_twice(&settings);
        if settings.is_empty() && !NodeOptions::is_said(table) && self.wrong.is_empty() {
            let help = format!("{LINK}; or take [ros1] away");
            self.note(place, "[ros1] names no topic, and no link does", &help);
        }
        settings
    }

    /// The address of the file, of the environment, or of this machine.
    fn master(&mut self, table: &Table, trusted: bool, place: Option<Span>) -> String {
        const HELP: &str = "write master = \"http://localhost:11311\", as ROS_MASTER_URI has it";
        let from_environment = || std::env::var(MASTER).ok().filter(|address| !address.is_empty());
        let given = self.text(table, "master", HELP);
        let span = given.as_ref().map(|(_, span)| *span).or(place);
        let master = given.map(|(text, _)| text).or_else(from_environment);
        let master = master.unwrap_or_else(|| "http://localhost:11311".into());
        match host(&master) {
            None => {
                let message = format!("a master is http://HOST:PORT, found `{master}`");
                self.note(span, message, HELP);
            }
            Some(host) if !trusted && !is_local(host) => {
                let message = format!(
                    "the master at {master} is not named by localhost or a loopback address, and ROS 1 is neither encrypted nor authenticated"
                );
                let help =
                    "write trusted = true in [ros1] if all who reach this machine may read and command";
                self.note(span, message, help);
            }
            Some(_) => {}
        }
        master
    }

    fn node(&mut self, table: &Table) -> String {
        let Some((name, span)) = self.text(table, "node", "node = \"r2\"") else { return self.node.clone() };
        let node = if name.starts_with('/') { name } else { format!("/{name}") };
        if let Err(reason) = check_name(&node) {
            let message = format!("`{node}` can't be the name of a node: {reason}");
            self.note(Some(span), message, "write node = \"r2\"");
        }
        node
    }

    fn inputs(&mut self, table: &Table, settings: &mut Ros1Settings) {
        for (input, span, entry) in self.entries(table, "read", READ) {
            let input = self.path(&input, span, READ);
            let topic = self.given(&entry, "topic", &READING, READ);
            let topic = topic.and_then(|topic| self.topic(&topic, entry.span, READ));
            let depth = entry.as_table().map_or(DEPTH, |own| self.depth(own));
            let (Some(input), Some(topic)) = (input, topic) else { continue };
            self.check_free(&input, span, settings);
            settings.read.push(ReadTopic { input, topic, depth, place: entry.span });
        }
    }

    fn outputs(&mut self, table: &Table, settings: &mut Ros1Settings) {
        let empty = Table::default();
        for (topic, span, entry) in self.entries(table, "write", WRITE) {
            let topic = self.topic(&topic, span, WRITE);
            let property = self.given(&entry, "from", &WRITING, WRITE);
            let property = property.and_then(|path| self.path(&path, entry.span, WRITE));
            let own = entry.as_table().unwrap_or(&empty);
            let (frame, latched, depth) = (self.frame(own), self.truth(own, "latched"), self.depth(own));
            let (Some(topic), Some(property)) = (topic, property) else { continue };
            settings.write.push(WrittenTopic { topic, property, frame, latched, depth, place: span });
        }
    }

    /// A topic that a link names.
    fn link(&mut self, link: &ExternalLink, settings: &mut Ros1Settings) {
        let (path, place, own) = (link.path.value.clone(), link.other.span, &link.options);
        let topic = self.topic(&link.other.value.address, place, LINK);
        let is_in = link.direction == ExternalDirection::In;
        let known = if is_in { &READING[..] } else { &WRITING };
        self.wrong.extend(self.configuration.unknown_keys(own, "of a topic", known));
        let (frame, latched, depth) = (self.frame(own), self.truth(own, "latched"), self.depth(own));
        let Some(topic) = topic else { return };
        if is_in {
            self.check_free(&path, link.path.span, settings);
            settings.read.push(ReadTopic { input: path, topic, depth, place });
        } else {
            settings.write.push(WrittenTopic { topic, property: path, frame, latched, depth, place });
        }
    }

    /// An input reads one topic.
    fn check_free(&mut self, input: &str, span: Span, settings: &Ros1Settings) {
        if settings.read.iter().any(|other| other.input == input) {
            let message = format!("/{input} reads two topics");
            self.note(Some(span), message, "an input reads one: take one away");
        }
    }

    /// A topic has one entry that writes it, and then none that reads it.
    fn check_twice(&mut self, settings: &Ros1Settings) {
        let mut written: BTreeMap<&str, &WrittenTopic> = BTreeMap::new();
        for output in &settings.write {
            if let Some(other) = written.insert(&output.topic, output) {
                let (first, second) = (&other.property, &output.property);
                let message =
                    format!("{} is written by two entries, of /{first} and /{second}", output.topic);
                let help = "a topic has the values of one property: take one away";
                self.note(Some(output.place), message, help);
            }
        }
        let options = &settings.options;
        let own = [
            (options.log, "/rosout", "rosout = false"),
            (options.clock, "/clock", "clock = false"),
            (options.transforms, "/tf", "tf = false"),
            (options.transforms, "/tf_static", "tf = false"),
        ];
        for (_, topic, setting) in own.into_iter().filter(|(is_on, ..)| *is_on) {
            if let Some(output) = written.get(topic) {
                let message = format!("{topic} is written by /{} and by the node itself", output.property);
                self.note(
                    Some(output.place),
                    message,
                    &format!("write {setting} in [ros1], or take the entry away"),
                );
            }
        }
        for input in &settings.read {
            if let Some(output) = written.get(input.topic.as_str()) {
                let (reader, writer) = (&input.input, &output.property);
                let message = format!("{} is read by /{reader} and written by /{writer} here", input.topic);
                let help = "link the two: \"driver/scan\" = \"laser/scan\" in [links]";
                self.note(Some(input.place), message, help);
            }
        }
    }

    /// Text of an entry, or of one of its keys.
    fn given(&mut self, entry: &Spanned<Value>, key: &str, own: &[&str], help: &str) -> Option<String> {
        if let Some(table) = entry.as_table() {
            let known = [&[key], own].concat();
            self.wrong.extend(self.configuration.unknown_keys(table, "of a topic", &known));
            if table.get(key).is_none() {
                self.note(Some(entry.span), format!("an entry lacks `{key}`"), help);
            }
            return self.text(table, key, help).map(|(text, _)| text);
        }
        if entry.as_str().is_none() {
            let message = format!("an entry is a text or a table, found {}", entry.describe());
            self.note(Some(entry.span), message, help);
        }
        entry.as_str().map(ToOwned::to_owned)
    }

    fn frame(&mut self, table: &Table) -> String {
        let given = self.text(table, "frame", "write frame = \"laser\"");
        given.map_or_else(|| FRAME.to_owned(), |(frame, _)| frame)
    }

    fn depth(&mut self, table: &Table) -> u16 {
        let Some(value) = table.get("depth") else { return DEPTH };
        match value.as_integer().filter(|depth| (1..=MAX_DEPTH).contains(depth)) {
            Some(depth) => depth as u16,
            None => {
                let message = format!("`depth` is a number from 1 to {MAX_DEPTH}, found {}", value.value);
                self.note(Some(value.span), message, "write depth = 10");
                DEPTH
            }
        }
    }
}

/// The host of a master's address; nothing if the address is invalid.
fn host(master: &str) -> Option<&str> {
    let authority = master.strip_prefix("http://")?.trim_end_matches('/');
    let (host, port) = authority.rsplit_once(':')?;
    port.parse::<u16>().is_ok().then_some(host).filter(|host| !host.is_empty())
}

/// Whether a host is this machine whatever its name is.
fn is_local(host: &str) -> bool {
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    host == "localhost" || bare.parse().is_ok_and(|own: IpAddr| own.is_loopback())
}

impl TableReader for Ros1SettingsReader<'_> {
    fn add(&mut self, span: Span, message: String, help: &str) {
        self.note(Some(span), message, help);
    }

    fn check_keys(&mut self, table: &Table, place: &str, known: &[&str]) {
        self.wrong.extend(self.configuration.unknown_keys(table, place, known));
    }

    fn entries(&mut self, table: &Table, name: &str, help: &str) -> Vec<KeyedValue> {
        let Some(value) = table.get(name) else { return Vec::new() };
        let Some(entries) = value.as_table() else {
            self.note(Some(value.span), format!("`{name}` is a table, found {}", value.describe()), help);
            return Vec::new();
        };
        entries.iter().map(|(key, entry)| (key.to_owned(), entry.key, entry.value.clone())).collect()
    }

    fn text(&mut self, table: &Table, name: &str, help: &str) -> Option<(String, Span)> {
        let value = table.get(name)?;
        if value.as_str().is_none() {
            self.note(Some(value.span), format!("`{name}` takes a text, found {}", value.describe()), help);
        }
        Some((value.as_str()?.to_owned(), value.span))
    }

    fn truth(&mut self, table: &Table, name: &str) -> bool {
        let Some(value) = table.get(name) else { return false };
        if value.as_bool().is_none() {
            let message = format!("`{name}` takes true or false, found {}", value.describe());
            self.note(Some(value.span), message, &format!("write {name} = true"));
        }
        value.as_bool().unwrap_or(false)
    }

    fn path(&mut self, text: &str, span: Span, help: &str) -> Option<String> {
        match self.configuration.own_path(text) {
            Ok(path) => Some(path),
            Err(report) => {
                let first = report.diagnostics().first();
                let message = first.map_or_else(String::new, |first| first.message().into());
                self.note(Some(span), message, help);
                None
            }
        }
    }

    fn topic(&mut self, name: &str, span: Span, help: &str) -> Option<String> {
        match whole_name(&self.node, name) {
            Ok(topic) => Some(topic),
            Err(reason) => {
                self.note(Some(span), format!("`{name}` can't be the name of a topic: {reason}"), help);
                None
            }
        }
    }

    fn service_type(&self, name: &str, definition: Option<&str>) -> Result<ServiceType, String> {
        match definition {
            Some(text) => ServiceType::parse(WireFormat::Ros1, name, text),
            None => ServiceType::known(WireFormat::Ros1, name),
        }
    }
}
