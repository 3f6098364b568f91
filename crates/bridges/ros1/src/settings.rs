//! The table `[ros1]` of a configuration, and links with `ros1:`.

use std::collections::BTreeMap;

use slate_runtime::Message;
use slate_runtime::configuration::{
    Configuration, Diagnostic, ExternalDirection, ExternalLink, Report, Span, Table,
};

use crate::name::{check_name, node_of_agent};

/// Scheme of links, and name of the table.
pub const SCHEME: &str = "ros1";

/// The variable that programs of ROS have the master's address from.
const MASTER: &str = "ROS_MASTER_URI";

/// Largest depth.
const DEEPEST: i64 = 10_000;

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
/// let wrong = read("[links]\n\"driver/scan\" = \"ros1:/scan\"")?;
/// assert!(Ros1Settings::of(&wrong).is_err_and(|report| report.to_string().contains("trusted")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Ros1Settings {
    /// Address of the master, such as `http://localhost:11311`.
    pub master: String,
    /// As what the agent appears, such as `/r2`.
    pub node: String,
    /// Inputs that topics fill.
    pub read: Vec<TopicInput>,
    /// Topics that have the values of properties.
    pub write: Vec<TopicOutput>,
}

/// An input that a topic fills.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicInput {
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
pub struct TopicOutput {
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

const KNOWN: [&str; 3] = ["master", "node", "trusted"];
const LINK: &str =
    "write \"driver/scan\" = \"ros1:/scan\" or \"ros1:/cmd_vel\" = \"/r2/wheels/command\" in [links]";

impl Ros1Settings {
    /// What a configuration says in its links with `ros1:`, and in its table `[ros1]`, which it has to be read with as one of
    /// [`extra_tables`](slate_runtime::configuration::Options::extra_tables); nothing without both.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn of(configuration: &Configuration) -> Result<Option<Self>, Report> {
        let root = configuration.value(SCHEME);
        let mut links = configuration.links_of_scheme(SCHEME).peekable();
        if root.is_none() && links.peek().is_none() {
            return Ok(None);
        }
        let mut reader = Ros1SettingsReader { configuration, wrong: Vec::new() };
        let empty = Table::default();
        let table = match root {
            Some(root) => root.as_table().unwrap_or_else(|| {
                let message = format!("`{SCHEME}` is a table, found {}", root.describe());
                reader.add(Some(root.span), message, "write [ros1]");
                &empty
            }),
            None => &empty,
        };
        let mut settings = reader.node(table);
        for link in links {
            reader.link(link, &mut settings);
        }
        reader.check_twice(&settings);
        if settings.read.is_empty() && settings.write.is_empty() && reader.wrong.is_empty() {
            let help = format!("{LINK}; or take [ros1] away");
            reader.add(root.map(|root| root.span), "[ros1] is there, and no link names a topic", &help);
        }
        reader.check_trusted(table, root.map(|root| root.span), &settings);
        if reader.wrong.is_empty() { Ok(Some(settings)) } else { Err(Report::from(reader.wrong)) }
    }
}

struct Ros1SettingsReader<'c> {
    configuration: &'c Configuration,
    wrong: Vec<Diagnostic>,
}

impl Ros1SettingsReader<'_> {
    fn add(&mut self, span: Option<Span>, message: impl Into<Message>, help: &str) {
        self.wrong.push(match span {
            Some(span) => self.configuration.diagnostic(span, message, Some(help.into())),
            None => Diagnostic::without_place(message, Some(help.into())),
        });
    }

    /// What a configuration says of the node, without topics.
    fn node(&mut self, table: &Table) -> Ros1Settings {
        self.wrong.extend(self.configuration.unknown_keys(table, "in [ros1]", &KNOWN));
        let from_environment = || std::env::var(MASTER).ok().filter(|address| !address.is_empty());
        let given = self.text(table, "master", "master = \"http://localhost:11311\"");
        let span = given.as_ref().map(|(_, span)| *span);
        let master = given.map(|(text, _)| text).or_else(from_environment);
        let master = master.unwrap_or_else(|| "http://localhost:11311".into());
        if !master.starts_with("http://") {
            let message = format!("the address of a master begins with http://, found `{master}`");
            self.add(span, message, "write master = \"http://localhost:11311\", as ROS_MASTER_URI has it");
        }
        let given = self.text(table, "node", "node = \"r2\"");
        let name = match &given {
            Some((name, _)) => name.clone(),
            None => node_of_agent(self.configuration.agent_name()),
        };
        let node = if name.starts_with('/') { name } else { format!("/{name}") };
        if let Err(reason) = check_name(&node) {
            let message = format!("`{node}` can't be the name of a node: {reason}");
            self.add(given.map(|(_, span)| span), message, "write node = \"r2\"");
        }
        Ros1Settings { master, node, read: Vec::new(), write: Vec::new() }
    }

    /// ROS 1 knows neither encryption nor who somebody is, and listens to all machines.
    fn check_trusted(&mut self, table: &Table, place: Option<Span>, settings: &Ros1Settings) {
        let own = table.get("trusted");
        if let Some(own) = own
            && own.as_bool().is_none()
        {
            let message = format!("`trusted` takes true or false, found {}", own.describe());
            self.add(Some(own.span), message, "write trusted = true");
        } else if own.and_then(|own| own.as_bool()) != Some(true) {
            let links = settings.read.iter().map(|own| own.place);
            let link = links.chain(settings.write.iter().map(|own| own.place)).next();
            let message =
                "ROS 1 is open to everybody in the network, and nothing says that this one is trusted";
            let help = "write trusted = true in [ros1] if all who reach this machine may read and command";
            self.add(own.map(|own| own.span).or(place).or(link), message, help);
        }
    }

    /// A topic that a link names.
    fn link(&mut self, link: &ExternalLink, settings: &mut Ros1Settings) {
        let (path, place) = (link.path.value.clone(), link.other.span);
        let address = &link.other.value.address;
        let topic = if address.starts_with('/') { address.clone() } else { format!("/{address}") };
        if let Err(reason) = check_name(&topic) {
            let message = format!("`{topic}` can't be the name of a topic: {reason}");
            return self.add(Some(place), message, LINK);
        }
        let known: &[&str] = match link.direction {
            ExternalDirection::In => &["depth"],
            ExternalDirection::Out => &["depth", "latched", "frame"],
        };
        self.wrong.extend(self.configuration.unknown_keys(&link.options, "of a topic", known));
        let depth = self.depth(&link.options);
        match link.direction {
            ExternalDirection::In => {
                if settings.read.iter().any(|other| other.input == path) {
                    let message = format!("/{path} reads two topics");
                    self.add(Some(link.path.span), message, "an input reads one: take one away");
                }
                settings.read.push(TopicInput { input: path, topic, depth, place });
            }
            ExternalDirection::Out => {
                let frame = self.text(&link.options, "frame", "frame = \"laser\"");
                let frame = frame.map_or_else(|| FRAME.to_owned(), |(frame, _)| frame);
                let latched = self.latched(&link.options);
                settings.write.push(TopicOutput { topic, property: path, frame, latched, depth, place });
            }
        }
    }

    /// A topic has one property, and none that it fills.
    fn check_twice(&mut self, settings: &Ros1Settings) {
        let mut written: BTreeMap<&str, &TopicOutput> = BTreeMap::new();
        for output in &settings.write {
            if let Some(other) = written.insert(&output.topic, output) {
                let (first, second) = (&other.property, &output.property);
                let message = format!("{} is written by two links, of /{first} and /{second}", output.topic);
                let help = "a topic has the values of one property: take one away";
                self.add(Some(output.place), message, help);
            }
        }
        for input in &settings.read {
            if let Some(output) = written.get(input.topic.as_str()) {
                let (reader, writer) = (&input.input, &output.property);
                let message = format!("{} is read by /{reader} and written by /{writer} here", input.topic);
                let help = "link the two: \"driver/scan\" = \"laser/scan\"";
                self.add(Some(input.place), message, help);
            }
        }
    }

    fn depth(&mut self, table: &Table) -> u16 {
        let Some(value) = table.get("depth") else { return 10 };
        match value.as_integer().filter(|depth| (1..=DEEPEST).contains(depth)) {
            Some(depth) => depth as u16,
            None => {
                let message = format!("`depth` is a number from 1 to {DEEPEST}, found {}", value.value);
                self.add(Some(value.span), message, "write depth = 10");
                1
            }
        }
    }

    fn latched(&mut self, table: &Table) -> bool {
        let Some(value) = table.get("latched") else { return false };
        if value.as_bool().is_none() {
            let message = format!("`latched` takes true or false, found {}", value.describe());
            self.add(Some(value.span), message, "write latched = true");
        }
        value.as_bool().unwrap_or(false)
    }

    fn text(&mut self, table: &Table, name: &str, help: &str) -> Option<(String, Span)> {
        let value = table.get(name)?;
        if value.as_str().is_none() {
            let message = format!("`{name}` takes a text, found {}", value.describe());
            self.add(Some(value.span), message, &format!("write {help}"));
        }
        Some((value.as_str()?.to_owned(), value.span))
    }
}
