//! Table `[ros1]` of a configuration, and links with `ros1:`.

use std::net::IpAddr;

use slate_ros_messages::WireFormat;
use slate_runtime::configuration::{Configuration, Report, Span, Spanned, Table, Value};
use slate_topics::{
    NameResolver, NodeOptions, OPTION_KEYS, ServiceCall, ServiceOffer, ServicesReader, TableReader,
    TopicOptions, TopicSettings, link_help,
};

use crate::name::{check_name, node_of_agent, whole_name};

/// Scheme of links, and name of the table.
pub const SCHEME: &str = "ros1";

/// Environment variable with the master's address of ROS programs.
const MASTER: &str = "ROS_MASTER_URI";

/// Messages that wait unless said.
const DEPTH: u16 = 10;

/// Settings of an agent's ROS 1 topics, read and written.
///
/// ```
/// use slate_ros1::Ros1Settings;
/// use slate_runtime::configuration::{Configuration, Options};
///
/// let options = Options { extra_tables: vec!["ros1".into()], ..Options::default() };
/// let read = |text: &str| Configuration::from_text("r2.toml", text, &options);
/// let text = "[ros1]\nmaster = \"http://robot:11311\"\ntrusted = true\n[links]\n\"driver/scan\" = \"ros1:/scan\"";
/// let settings = Ros1Settings::of(&read(text)?)?.ok_or("no links")?;
/// assert_eq!((settings.master.as_str(), settings.topics.read[0].topic.as_str()), ("http://robot:11311", "/scan"));
/// let wrong = read("[ros1]\nwrite.\"/cmd-vel\" = \"r2/wheels/command\"")?;
/// assert!(Ros1Settings::of(&wrong).is_err_and(|report| report.to_string().contains("cmd-vel")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Ros1Settings {
    /// Address of the master, such as `http://localhost:11311`.
    pub master: String,
    /// Name of the agent's node, such as `/r2`.
    pub node: String,
    /// Trusted network: it communicates with other machines, in clear text.
    pub trusted: bool,
    /// Topics that it reads and writes.
    pub topics: TopicSettings<TopicQueue>,
    /// Inboxes that are services.
    pub serve: Vec<ServiceOffer>,
    /// Services that outboxes call.
    pub call: Vec<ServiceCall>,
    /// Other features.
    pub options: NodeOptions,
}

/// Messages of a topic that are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicQueue {
    /// Messages that may wait: for the next cycle, or for a slow subscriber.
    pub depth: u16,
    /// Latching: later subscribers receive the last message.
    pub latched: bool,
}

impl Default for TopicQueue {
    fn default() -> Self {
        Self { depth: DEPTH, latched: false }
    }
}

impl TopicOptions for TopicQueue {
    const READ_KEYS: &'static [&'static str] = &["depth"];
    const WRITE_KEYS: &'static [&'static str] = &["depth", "latched"];

    fn read(reader: &mut TableReader<'_>, table: &Table) -> Self {
        Self { depth: reader.depth(table).unwrap_or(DEPTH), latched: reader.flag(table, "latched") }
    }
}

const KNOWN: [&str; 7] = ["master", "node", "trusted", "read", "write", "serve", "call"];

impl Ros1Settings {
    /// Reads the table `[ros1]` and links with `ros1:`; `None` without both.
    /// The configuration must be read with the table as one of
    /// [`extra_tables`](slate_runtime::configuration::Options::extra_tables).
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn of(configuration: &Configuration) -> Result<Option<Self>, Report> {
        let root = configuration.value(SCHEME);
        if root.is_none() && configuration.links_of_scheme(SCHEME).next().is_none() {
            return Ok(None);
        }
        let node = format!("/{}", node_of_agent(configuration.agent_name()));
        let mut reader = TableReader::new(configuration, SCHEME, WireFormat::Ros1, resolver(&node));
        let settings = settings(&mut reader, root, node);
        reader.finish(Some(settings))
    }

    /// Returns whether the settings connect the agent with no other node.
    fn is_empty(&self) -> bool {
        self.topics.is_empty() && self.serve.is_empty() && self.call.is_empty()
    }
}

fn resolver(node: &str) -> NameResolver {
    let node = node.to_owned();
    Box::new(move |name| whole_name(&node, name))
}

fn settings(reader: &mut TableReader<'_>, root: Option<&Spanned<Value>>, agent: String) -> Ros1Settings {
    let table = reader.table(root);
    reader.check_keys(&table, "in [ros1]", &[&KNOWN, &OPTION_KEYS[..]].concat());
    let place = root.map(|root| root.span);
    let node = node(reader, &table, agent);
    reader.set_resolver(resolver(&node));
    let trusted = reader.flag(&table, "trusted");
    let master = master(reader, &table, trusted, place);
    let mut services = ServicesReader::new(reader, "std_srvs/SetBool");
    let (serve, call) = (services.offers(&table), services.calls(&table));
    let options = NodeOptions::read(reader, &table);
    let topics = TopicSettings::read(reader, &table, &options);
    let settings = Ros1Settings { master, node, trusted, topics, serve, call, options };
    if settings.is_empty() && !NodeOptions::has_any(&table) && reader.is_valid() {
        let help = format!("{}; or take [ros1] away", link_help(SCHEME));
        reader.add(place, "[ros1] names no topic, and no link does", &help);
    }
    settings
}

/// Returns the address of the file, of the environment, or of this machine.
fn master(reader: &mut TableReader<'_>, table: &Table, trusted: bool, place: Option<Span>) -> String {
    const HELP: &str = "write master = \"http://localhost:11311\", as ROS_MASTER_URI has it";
    let from_environment = || std::env::var(MASTER).ok().filter(|address| !address.is_empty());
    let given = reader.text(table, "master", HELP);
    let span = given.as_ref().map(|(_, span)| *span).or(place);
    let master = given.map(|(text, _)| text).or_else(from_environment);
    let master = master.unwrap_or_else(|| "http://localhost:11311".into());
    match host(&master) {
        None => {
            let message = format!("a master is http://HOST:PORT, found `{master}`");
            reader.add(span, message, HELP);
        }
        Some(host) if !trusted && !is_local(host) => {
            let message = format!(
                "the master at {master} is not named by localhost or a loopback address, and ROS 1 is neither encrypted nor authenticated"
            );
            let help = "write trusted = true in [ros1] if every program that reaches this machine may read and command";
            reader.add(span, message, help);
        }
        Some(_) => {}
    }
    master
}

fn node(reader: &mut TableReader<'_>, table: &Table, agent: String) -> String {
    let Some((name, span)) = reader.text(table, "node", "node = \"r2\"") else { return agent };
    let node = if name.starts_with('/') { name } else { format!("/{name}") };
    if let Err(reason) = check_name(&node) {
        let message = format!("`{node}` can't be the name of a node: {reason}");
        reader.add(span, message, "write node = \"r2\"");
    }
    node
}

/// Returns the host of a master's address; `None` if the address is invalid.
fn host(master: &str) -> Option<&str> {
    let authority = master.strip_prefix("http://")?.trim_end_matches('/');
    let (host, port) = authority.rsplit_once(':')?;
    port.parse::<u16>().is_ok().then_some(host).filter(|host| !host.is_empty())
}

/// Returns whether a host is always this machine, whatever its name is.
fn is_local(host: &str) -> bool {
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    host == "localhost" || bare.parse().is_ok_and(|own: IpAddr| own.is_loopback())
}
