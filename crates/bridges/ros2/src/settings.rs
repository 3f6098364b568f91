//! Table `[ros2]` of a configuration.

use slate_ros_messages::WireFormat;
use slate_runtime::configuration::{Configuration, Report, Span, Spanned, Table, Value};
use slate_sorted::SortedSet;
use slate_topics::{
    ActionCall, ActionOffer, NameResolver, NodeAccess, NodeOptions, OPTION_KEYS, ServiceCall, ServiceOffer,
    ServicesReader, TableReader, TopicSettings, link_help,
};

use crate::name::{NodeName, check_node, check_topic};
use crate::wire_settings::RosWireSettings;
use slate_dds::TopicQuality;

/// Name of the table, and scheme of links.
pub const TABLE: &str = "ros2";

/// Environment variable with the domain of ROS programs.
const DOMAIN: &str = "ROS_DOMAIN_ID";

/// Highest domain whose ports exist.
const MAX_DOMAIN: i64 = 232;

/// Settings of an agent's ROS topics, read and written.
///
/// ```
/// use slate_ros2::RosSettings;
/// use slate_runtime::configuration::{Configuration, Options};
///
/// let options = Options { extra_tables: vec!["ros2".into()], ..Options::default() };
/// let read = |text: &str| Configuration::from_text("r2.toml", text, &options);
/// let text = "[ros2]\ndomain = 7\nread.\"driver/scan\" = { topic = \"/scan\", reliable = false }";
/// let settings = RosSettings::of(&read(text)?)?.ok_or("no table")?;
/// assert_eq!((settings.domain, settings.topics.read[0].topic.as_str()), (7, "/scan"));
/// let wrong = read("[ros2]\nwrite.\"/cmd-vel\" = \"r2/wheels/command\"")?;
/// assert!(RosSettings::of(&wrong).is_err_and(|report| report.to_string().contains("cmd-vel")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RosSettings {
    /// Programs see each other within a domain.
    pub domain: u16,
    /// Middleware.
    pub wire: RosWireSettings,
    /// Name of the agent's node.
    pub node: NodeName,
    /// Trusted network: it communicates with other machines, in clear text.
    pub trusted: bool,
    /// Topics that it reads and writes.
    pub topics: TopicSettings<TopicQuality>,
    /// Inboxes that are services.
    pub serve: Vec<ServiceOffer>,
    /// Services that outboxes call.
    pub call: Vec<ServiceCall>,
    /// Inboxes that are servers of actions.
    pub offered_actions: Vec<ActionOffer>,
    /// Actions that outboxes call.
    pub called_actions: Vec<ActionCall>,
    /// Access of other nodes to the state of the agent as that of a lifecycle node.
    pub lifecycle: NodeAccess,
    /// Other features.
    pub options: NodeOptions,
}

const KNOWN: [&str; 11] = [
    "domain",
    "wire",
    "router",
    "node",
    "namespace",
    "trusted",
    "read",
    "write",
    "serve",
    "call",
    "lifecycle",
];

impl RosSettings {
    /// Reads the table `[ros2]` and links with `ros2:`; `None` without both.
    /// The configuration must be read with the table as one of
    /// [`extra_tables`](slate_runtime::configuration::Options::extra_tables).
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn of(configuration: &Configuration) -> Result<Option<Self>, Report> {
        let root = configuration.value(TABLE);
        if root.is_none() && configuration.links_of_scheme(TABLE).next().is_none() {
            return Ok(None);
        }
        let node = NodeName::of_agent(configuration.agent_name());
        let mut reader = TableReader::new(configuration, TABLE, WireFormat::Cdr, resolver(&node));
        let settings = settings(&mut reader, root, node);
        reader.finish(Some(settings))
    }

    /// Returns whether the settings connect the agent with no other node.
    fn is_empty(&self) -> bool {
        let has_services = !self.serve.is_empty() || !self.call.is_empty();
        let has_actions = !self.offered_actions.is_empty() || !self.called_actions.is_empty();
        self.topics.is_empty() && !has_services && !has_actions
    }
}

fn resolver(node: &NodeName) -> NameResolver {
    let node = node.clone();
    Box::new(move |name| node.topic(name))
}

fn settings(reader: &mut TableReader<'_>, root: Option<&Spanned<Value>>, agent: NodeName) -> RosSettings {
    let table = reader.table(root);
    reader.check_keys(&table, "in [ros2]", &[&KNOWN, &OPTION_KEYS[..]].concat());
    let place = root.map(|root| root.span);
    let domain = domain(reader, &table, place);
    let node = node(reader, &table, agent);
    reader.set_resolver(resolver(&node));
    let trusted = reader.flag(&table, "trusted");
    let wire = RosWireSettings::of(reader, &table, trusted);
    let mut services = ServicesReader::new(reader, "std_srvs/srv/SetBool");
    let (serve, call) = (services.offers(&table), services.calls(&table));
    let (offered_actions, called_actions) = (services.action_offers(&table), services.action_calls(&table));
    let lifecycle = NodeAccess::read(reader, &table, "lifecycle", NodeAccess::None);
    let options = NodeOptions::read(reader, &table);
    let topics = TopicSettings::read(reader, &table, &options);
    let settings = RosSettings {
        domain,
        wire,
        node,
        trusted,
        topics,
        serve,
        call,
        offered_actions,
        called_actions,
        lifecycle,
        options,
    };
    check_outboxes(reader, &settings);
    let is_node = settings.lifecycle != NodeAccess::None || NodeOptions::has_any(&table);
    if settings.is_empty() && !is_node && reader.is_valid() {
        let help = format!("{}; or take [ros2] away", link_help(TABLE));
        reader.add(place, "[ros2] names no topic, and no link does", &help);
    }
    settings
}

/// Checks that an outbox has one receiver.
fn check_outboxes(reader: &mut TableReader<'_>, settings: &RosSettings) {
    let mut known: SortedSet<&String> = settings.call.iter().map(|own| &own.outbox).collect();
    for call in &settings.called_actions {
        for outbox in [Some(&call.outbox), call.cancel.as_ref()].into_iter().flatten() {
            if !known.insert(outbox) {
                let text = format!("/{outbox} calls two services or actions");
                reader.add(call.place, text, "an outbox has one receiver: take one away");
            }
        }
    }
}

/// Returns the domain of the file, or of the environment.
fn domain(reader: &mut TableReader<'_>, table: &Table, place: Option<Span>) -> u16 {
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
            reader.add(span, message, help);
            0
        }
    }
}

fn node(reader: &mut TableReader<'_>, table: &Table, mut node: NodeName) -> NodeName {
    if let Some((name, span)) = reader.text(table, "node", "node = \"r2\"") {
        if let Err(reason) = check_node(&name) {
            let message = format!("`{name}` can't be the name of a node: {reason}");
            reader.add(span, message, "write node = \"r2\"");
        }
        node.name = name;
    }
    if let Some((name, span)) = reader.text(table, "namespace", "namespace = \"/robots\"") {
        if let Err(reason) = if name == "/" { Ok(()) } else { check_topic(&name) } {
            let message = format!("`{name}` can't be a namespace: {reason}");
            reader.add(span, message, "write namespace = \"/robots\"");
        }
        node.namespace = name;
    }
    node
}
