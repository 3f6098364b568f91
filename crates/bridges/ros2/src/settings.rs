//! The table `[ros2]` of a configuration.

use std::collections::BTreeMap;

use slate_record::ros::WireFormat;
use slate_runtime::Message;
use slate_runtime::configuration::{
    Configuration, Diagnostic, ExternalDirection, ExternalLink, Report, Span, Spanned, Table, Value,
};
use slate_topics::{
    KeyedValue, NodeOptions, OPTION_KEYS, ServiceCall, ServiceOffer, ServiceType, ServicesReader, TableReader,
};

use crate::name::{NodeName, check_node, check_topic};
use crate::quality::TopicQuality;

/// Name of the table, and scheme of links.
pub const TABLE: &str = "ros2";

/// The variable that programs of ROS have their domain from.
const DOMAIN: &str = "ROS_DOMAIN_ID";

/// The highest domain whose ports exist.
const MAX_DOMAIN: i64 = 232;

/// Largest depth.
const MAX_DEPTH: i64 = 10_000;

/// Which topics of ROS an agent reads and writes.
///
/// ```
/// use slate_ros2::RosSettings;
/// use slate_runtime::configuration::{Configuration, Options};
///
/// let options = Options { extra_tables: vec!["ros2".into()], ..Options::default() };
/// let read = |text: &str| Configuration::from_text("r2.toml", text, &options);
/// let text = "[ros2]\ndomain = 7\nread.\"driver/scan\" = { topic = \"/scan\", reliable = false }";
/// let settings = RosSettings::of(&read(text)?)?.ok_or("no table")?;
/// assert_eq!((settings.domain, settings.read[0].topic.as_str()), (7, "/scan"));
/// let wrong = read("[ros2]\nwrite.\"/cmd-vel\" = \"r2/wheels/command\"")?;
/// assert!(RosSettings::of(&wrong).is_err_and(|report| report.to_string().contains("cmd-vel")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RosSettings {
    /// Programs see each other within a domain.
    pub domain: u16,
    /// As what the agent appears.
    pub node: NodeName,
    /// Whether it speaks to other machines, in clear text.
    pub trusted: bool,
    /// Inputs that read topics.
    pub read: Vec<TopicInput>,
    /// Topics that have the values of properties.
    pub write: Vec<TopicOutput>,
    /// Inboxes that are services.
    pub serve: Vec<ServiceOffer>,
    /// Services that outboxes call.
    pub call: Vec<ServiceCall>,
    /// Its other features.
    pub options: NodeOptions,
}

/// An input that reads a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicInput {
    /// Path of the input.
    pub input: String,
    /// The topic, from the root.
    pub topic: String,
    /// Quality of service that it requests.
    pub quality: TopicQuality,
    /// Where it is written in the configuration.
    pub place: Option<Span>,
}

/// A topic that has the values of a property.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicOutput {
    /// The topic, from the root.
    pub topic: String,
    /// Path of the property.
    pub property: String,
    /// Frame in the header of messages that have one.
    pub frame: String,
    /// Quality of service that it offers.
    pub quality: TopicQuality,
    /// Where it is written in the configuration.
    pub place: Option<Span>,
}

const KNOWN: [&str; 8] = ["domain", "node", "namespace", "trusted", "read", "write", "serve", "call"];
/// Keys of the quality of service.
const QUALITY: [&str; 3] = ["reliable", "transient_local", "depth"];
const QUALITY_AND_FRAME: [&str; 4] = ["reliable", "transient_local", "depth", "frame"];

/// Frame in headers unless said.
const FRAME: &str = "base_link";

const LINK: &str =
    "write \"driver/scan\" = \"ros2:/scan\" or \"ros2:/cmd_vel\" = \"/r2/wheels/command\" in [links]";
const READ: &str = "write read.\"driver/scan\" = \"/scan\", or = { topic = \"/scan\", reliable = false }";
const WRITE: &str =
    "write write.\"/cmd_vel\" = \"r2/wheels/command\", or = { from = \"r2/wheels/command\", depth = 1 }";

impl RosSettings {
    /// Reads the table `[ros2]`, which it has to be read with as one of
    /// [`extra_tables`](slate_runtime::configuration::Options::extra_tables), and in links with `ros2:`; nothing without both.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn of(configuration: &Configuration) -> Result<Option<Self>, Report> {
        let root = configuration.value(TABLE);
        if root.is_none() && configuration.links_of_scheme(TABLE).next().is_none() {
            return Ok(None);
        }
        let node = NodeName::of_agent(configuration.agent_name());
        let mut reader = RosSettingsReader { configuration, node, wrong: Vec::new() };
        let settings = reader.settings(root);
        if reader.wrong.is_empty() { Ok(Some(settings)) } else { Err(Report::from(reader.wrong)) }
    }

    /// Whether the agent has nothing to do with any other node.
    fn is_empty(&self) -> bool {
        self.read.is_empty() && self.write.is_empty() && self.serve.is_empty() && self.call.is_empty()
    }
}

struct RosSettingsReader<'c> {
    configuration: &'c Configuration,
    node: NodeName,
    wrong: Vec<Diagnostic>,
}

impl RosSettingsReader<'_> {
    fn add(&mut self, span: Span, message: impl Into<Message>, help: &str) {
        self.wrong.push(self.configuration.diagnostic(span, message, Some(help.into())));
    }

    fn settings(&mut self, root: Option<&Spanned<Value>>) -> RosSettings {
        let mut settings = RosSettings {
            domain: 0,
            node: self.node.clone(),
            trusted: false,
            read: Vec::new(),
            write: Vec::new(),
            serve: Vec::new(),
            call: Vec::new(),
            options: NodeOptions::default(),
        };
        let empty = Table::default();
        let table = root.map_or(Some(&empty), |root| root.as_table());
        let Some(table) = table else {
            if let Some(root) = root {
                let message = format!("`{TABLE}` is a table, found {}", root.describe());
                self.add(root.span, message, "write [ros2]");
            }
            return settings;
        };
        self.wrong.extend(self.configuration.unknown_keys(
            table,
            "in [ros2]",
            &[&KNOWN, &OPTION_KEYS[..]].concat(),
        ));
        settings.domain = self.domain(table, root.map(|root| root.span));
        settings.node = self.node(table, settings.node);
        self.node = settings.node.clone();
        settings.trusted = self.truth(table, "trusted");
        settings.read = self.inputs(table);
        settings.write = self.outputs(table);
        let mut services = ServicesReader::new(self, "std_srvs/srv/SetBool");
        (settings.serve, settings.call) = (services.offers(table), services.calls(table));
        settings.options = NodeOptions::of(self, table);
        for link in self.configuration.links_of_scheme(TABLE) {
            self.link(link, &mut settings);
        }
        self.check_twice(&settings);
        if let Some(root) = root
            && settings.is_empty()
            && !NodeOptions::is_said(table)
            && self.wrong.is_empty()
        {
            let help = format!("{LINK}; or take [ros2] away");
            self.add(root.span, "[ros2] names no topic, and no link does", &help);
        }
        settings
    }

    /// A topic that a link names.
    fn link(&mut self, link: &ExternalLink, settings: &mut RosSettings) {
        let (path, span) = (&link.path.value, link.other.span);
        let topic = self.topic(&link.other.value.address, span, LINK);
        let known = if link.direction == ExternalDirection::In { &QUALITY[..] } else { &QUALITY_AND_FRAME };
        self.wrong.extend(self.configuration.unknown_keys(&link.options, "of a topic", known));
        let quality = self.quality(&link.options);
        let frame = self.frame(&link.options);
        let Some(topic) = topic else { return };
        match link.direction {
            ExternalDirection::In => {
                self.check_free(path, link.path.span, settings);
                let input = path.clone();
                settings.read.push(TopicInput { input, topic, quality, place: Some(span) });
            }
            ExternalDirection::Out => {
                let property = path.clone();
                settings.write.push(TopicOutput { topic, property, frame, quality, place: Some(span) });
            }
        }
    }

    /// An input reads one topic.
    fn check_free(&mut self, input: &str, span: Span, settings: &RosSettings) {
        if settings.read.iter().any(|other| other.input == input) {
            self.add(span, format!("/{input} reads two topics"), "an input reads one: take one away");
        }
    }

    /// That of the file, or of the environment.
    fn domain(&mut self, table: &Table, place: Option<Span>) -> u16 {
        let (number, span, found) = match table.get("domain") {
            Some(value) => (value.as_integer(), Some(value.span), value.value.to_string()),
            None => match std::env::var(DOMAIN) {
                Ok(text) if !text.is_empty() => (text.parse().ok(), place, format!("{DOMAIN}={text}")),
                _ => return 0,
            },
        };
        match number.filter(|number| (0..=MAX_DOMAIN).contains(number)) {
            Some(number) => number as u16,
            None => {
                let message = format!("a domain is a number from 0 to {MAX_DOMAIN}, found {found}");
                let help = "write domain = 7 in [ros2], as ROS_DOMAIN_ID of the other programs";
                self.wrong.push(match span {
                    Some(span) => self.configuration.diagnostic(span, message, Some(help.into())),
                    None => Diagnostic::without_place(message, Some(help.into())),
                });
                0
            }
        }
    }

    fn node(&mut self, table: &Table, mut node: NodeName) -> NodeName {
        if let Some((name, span)) = self.text(table, "node", "node = \"r2\"") {
            if let Err(reason) = check_node(&name) {
                let message = format!("`{name}` can't be the name of a node: {reason}");
                self.add(span, message, "write node = \"r2\"");
            }
            node.name = name;
        }
        if let Some((name, span)) = self.text(table, "namespace", "namespace = \"/robots\"") {
            if let Err(reason) = if name == "/" { Ok(()) } else { check_topic(&name) } {
                let message = format!("`{name}` can't be a namespace: {reason}");
                self.add(span, message, "write namespace = \"/robots\"");
            }
            node.namespace = name;
        }
        node
    }

    fn inputs(&mut self, table: &Table) -> Vec<TopicInput> {
        let mut inputs: Vec<TopicInput> = Vec::new();
        for (input, span, entry) in self.entries(table, "read", READ) {
            let path = self.path(&input, span, READ);
            let given = self.given(&entry, "topic", &["topic"], READ);
            let topic = given.and_then(|topic| self.topic(&topic, entry.span, READ));
            let quality = entry.as_table().map_or_else(TopicQuality::default, |own| self.quality(own));
            let (Some(input), Some(topic)) = (path, topic) else { continue };
            if inputs.iter().any(|other| other.input == input) {
                self.add(span, format!("/{input} reads two topics"), "an input reads one: take one away");
            }
            inputs.push(TopicInput { input, topic, quality, place: Some(entry.span) });
        }
        inputs
    }

    fn outputs(&mut self, table: &Table) -> Vec<TopicOutput> {
        let mut outputs = Vec::new();
        for (topic, span, entry) in self.entries(table, "write", WRITE) {
            let topic = self.topic(&topic, span, WRITE);
            let given = self.given(&entry, "from", &["from", "frame"], WRITE);
            let property = given.and_then(|path| self.path(&path, entry.span, WRITE));
            let (frame, quality) = match entry.as_table() {
                Some(own) => (self.frame(own), self.quality(own)),
                None => (FRAME.to_owned(), TopicQuality::default()),
            };
            let (Some(topic), Some(property)) = (topic, property) else { continue };
            outputs.push(TopicOutput { topic, property, frame, quality, place: Some(span) });
        }
        outputs
    }

    /// A topic has one entry that writes it, and then none that reads it.
    fn check_twice(&mut self, settings: &RosSettings) {
        let mut written: BTreeMap<&str, &TopicOutput> = BTreeMap::new();
        for output in &settings.write {
            if let Some(other) = written.insert(&output.topic, output)
                && let Some(span) = output.place
            {
                let message = format!(
                    "{} is written by two entries, of /{} and /{}",
                    output.topic, other.property, output.property
                );
                self.add(span, message, "a topic has the values of one property: take one away");
            }
        }
        for input in &settings.read {
            if let (Some(output), Some(span)) = (written.get(input.topic.as_str()), input.place) {
                let message = format!(
                    "{} is read by /{} and written by /{} here",
                    input.topic, input.input, output.property
                );
                self.add(span, message, "link the two: \"driver/scan\" = \"laser/scan\" in [links]");
            }
        }
    }

    /// The entries of a table in the table: key, its place, and value.
    fn entries(&mut self, table: &Table, name: &str, help: &str) -> Vec<(String, Span, Spanned<Value>)> {
        let Some(value) = table.get(name) else { return Vec::new() };
        let Some(entries) = value.as_table() else {
            self.add(value.span, format!("`{name}` is a table, found {}", value.describe()), help);
            return Vec::new();
        };
        entries.iter().map(|(key, entry)| (key.to_owned(), entry.key, entry.value.clone())).collect()
    }

    /// Text of an entry, or of one of its keys.
    fn given(&mut self, entry: &Spanned<Value>, key: &str, own: &[&str], help: &str) -> Option<String> {
        if let Some(table) = entry.as_table() {
            let known: Vec<_> = own.iter().chain(&QUALITY).copied().collect();
            self.wrong.extend(self.configuration.unknown_keys(table, "of a topic", &known));
            if table.get(key).is_none() {
                self.add(entry.span, format!("an entry lacks `{key}`"), help);
            }
            return self.text(table, key, help).map(|(text, _)| text);
        }
        if entry.as_str().is_none() {
            let message = format!("an entry is a text or a table, found {}", entry.describe());
            self.add(entry.span, message, help);
        }
        entry.as_str().map(ToOwned::to_owned)
    }

    fn topic(&mut self, name: &str, span: Span, help: &str) -> Option<String> {
        match self.node.topic(name) {
            Ok(topic) => Some(topic),
            Err(reason) => {
                self.add(span, format!("`{name}` can't be the name of a topic: {reason}"), help);
                None
            }
        }
    }

    fn path(&mut self, text: &str, span: Span, help: &str) -> Option<String> {
        match self.configuration.own_path(text) {
            Ok(path) => Some(path),
            Err(report) => {
                let first = report.diagnostics().first();
                self.add(span, first.map_or_else(String::new, |first| first.message().into()), help);
                None
            }
        }
    }

    fn frame(&mut self, table: &Table) -> String {
        self.text(table, "frame", "frame = \"laser\"").map_or_else(|| FRAME.to_owned(), |(frame, _)| frame)
    }

    fn quality(&mut self, table: &Table) -> TopicQuality {
        let mut quality = TopicQuality::default();
        if table.get("reliable").is_some() {
            quality.reliable = self.truth(table, "reliable");
        }
        quality.transient_local = self.truth(table, "transient_local");
        if let Some(value) = table.get("depth") {
            match value.as_integer().filter(|depth| (1..=MAX_DEPTH).contains(depth)) {
                Some(depth) => quality.depth = depth as u16,
                None => {
                    let message = format!("`depth` is a number from 1 to {MAX_DEPTH}, found {}", value.value);
                    self.add(value.span, message, "write depth = 10");
                }
            }
        }
        quality
    }

    fn truth(&mut self, table: &Table, name: &str) -> bool {
        let Some(value) = table.get(name) else { return false };
        if value.as_bool().is_none() {
            let message = format!("`{name}` takes true or false, found {}", value.describe());
            self.add(value.span, message, &format!("write {name} = true"));
        }
        value.as_bool().unwrap_or(false)
    }

    fn text(&mut self, table: &Table, name: &str, help: &str) -> Option<(String, Span)> {
        let value = table.get(name)?;
        if value.as_str().is_none() {
            self.add(value.span, format!("`{name}` takes a text, found {}", value.describe()), help);
        }
        Some((value.as_str()?.to_owned(), value.span))
    }
}

/// For the parts of the table that other modules know.
impl TableReader for RosSettingsReader<'_> {
    fn add(&mut self, span: Span, message: String, help: &str) {
        Self::add(self, span, message, help);
    }

    fn check_keys(&mut self, table: &Table, place: &str, known: &[&str]) {
        self.wrong.extend(self.configuration.unknown_keys(table, place, known));
    }

    fn entries(&mut self, table: &Table, name: &str, help: &str) -> Vec<KeyedValue> {
        Self::entries(self, table, name, help)
    }

    fn text(&mut self, table: &Table, name: &str, help: &str) -> Option<(String, Span)> {
        Self::text(self, table, name, help)
    }

    fn truth(&mut self, table: &Table, name: &str) -> bool {
        Self::truth(self, table, name)
    }

    fn path(&mut self, text: &str, span: Span, help: &str) -> Option<String> {
        Self::path(self, text, span, help)
    }

    fn topic(&mut self, name: &str, span: Span, help: &str) -> Option<String> {
        Self::topic(self, name, span, help)
    }

    fn service_type(&self, name: &str, definition: Option<&str>) -> Result<ServiceType, String> {
        match definition {
            Some(text) => ServiceType::parse(WireFormat::Cdr, name, text),
            None => ServiceType::known(WireFormat::Cdr, name),
        }
    }
}
