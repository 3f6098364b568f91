//! Table `[dds]` of a configuration.

use slate_ros_messages::WireFormat;
use slate_runtime::configuration::{Configuration, Report, Spanned, Table, Value};
use slate_topics::{NodeOptions, TableReader, TopicSettings};

use crate::topic_type::{DdsTopic, check_topic};

/// Name of the table, and scheme of links.
pub const TABLE: &str = "dds";

/// Highest domain whose ports exist.
const MAX_DOMAIN: i64 = 232;

const LINK: &str = "write \"planner/target\" = { from = \"dds:Target\", type = \"demo::Target\", idl = \"target.idl\" } in [links]";

/// Settings of an agent's DDS topics, read and written.
///
/// ```
/// use slate_dds::DdsSettings;
/// use slate_runtime::configuration::{Configuration, Options};
///
/// let options = Options { extra_tables: vec!["dds".into()], ..Options::default() };
/// let read = |text: &str| Configuration::from_text("r2.toml", text, &options);
/// let text = "[dds]\ndomain = 7\nread.\"planner/target\" = { topic = \"Target\", reliable = false }";
/// let settings = DdsSettings::of(&read(text)?)?.ok_or("no table")?;
/// assert_eq!((settings.domain, settings.topics.read[0].topic.as_str()), (7, "Target"));
/// let wrong = read("[dds]\nwrite.\"Pose\" = { from = \"r2/pose\", idl = \"pose.idl\" }")?;
/// assert!(DdsSettings::of(&wrong).is_err_and(|report| report.to_string().contains("needs a `type`")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DdsSettings {
    /// Programs see each other within a domain.
    pub domain: u16,
    /// Trusted network: it communicates with other machines, in clear text.
    pub trusted: bool,
    /// Topics that it reads and writes.
    pub topics: TopicSettings<DdsTopic>,
}

impl DdsSettings {
    /// Reads the table `[dds]` and links with `dds:`; `None` without both.
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
        let mut reader = TableReader::new(configuration, TABLE, WireFormat::Cdr, Box::new(check_topic));
        let settings = settings(&mut reader, root);
        reader.finish(Some(settings))
    }
}

fn settings(reader: &mut TableReader<'_>, root: Option<&Spanned<Value>>) -> DdsSettings {
    let table = reader.table(root);
    reader.check_keys(&table, "in [dds]", &["domain", "trusted", "read", "write"]);
    let domain = domain(reader, &table);
    let trusted = reader.flag(&table, "trusted");
    // A participant has no topics of its own.
    let none = NodeOptions { log: false, ..NodeOptions::default() };
    let topics = TopicSettings::read(reader, &table, &none);
    if topics.is_empty() && reader.is_valid() {
        let help = format!("{LINK}; or take [dds] away");
        reader.add(root.map(|root| root.span), "[dds] names no topic, and no link does", &help);
    }
    DdsSettings { domain, trusted, topics }
}

fn domain(reader: &mut TableReader<'_>, table: &Table) -> u16 {
    let Some(value) = table.get("domain") else { return 0 };
    match value.as_integer().filter(|number| (0..=MAX_DOMAIN).contains(number)) {
        Some(number) => number as u16,
        None => {
            let message = format!("a domain is a number from 0 to {MAX_DOMAIN}, found {}", value.value);
            reader.add(value.span, message, "write domain = 7, as the other programs have it");
            0
        }
    }
}
