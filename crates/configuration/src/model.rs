use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::PathBuf;

use slate_blackboard::{Pattern, Url};
use slate_module::{Level, Stage, Trigger};

use super::source::{Span, Spanned};
use super::value::Table;
use crate::levels::Levels;
use crate::schedule::Schedule;
use crate::syslog::SyslogAddress;

/// A module of the agent.
#[derive(Clone, Debug)]
pub struct Module {
    /// Its name with that of its robot, such as `r2/planner`; its URL is `/r2/planner`.
    pub name: Spanned<String>,
    /// Its kind, such as `pure_pursuit`.
    pub kind: Spanned<String>,
    /// Whether it runs from the start.
    pub enabled: Spanned<bool>,
    /// Whether it runs in a process of its own.
    pub isolated: Spanned<bool>,
    /// Limits of that process.
    pub isolation: Isolation,
    /// The file in which it remembers its state from run to run; relative to the file that names it.
    pub memory: Option<Spanned<PathBuf>>,
    /// Overrides the stage that the module names itself.
    pub stage: Option<Spanned<Stage>>,
    /// Overrides the trigger that the module names itself.
    pub trigger: Option<Spanned<Trigger>>,
    /// Overrides its deadline, nanoseconds.
    pub deadline: Option<Spanned<u64>>,
    /// Its parameters.
    pub params: Table,
    /// Values of inputs that have no link, by port.
    pub inputs: Table,
}

/// Limits of the process of an isolated module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Isolation {
    /// Bytes that the module may allocate.
    pub memory: u64,
    /// Where that is written, if it is.
    pub memory_at: Option<Span>,
    /// Whether the actuators that it commands stay armed when it fails, and follow it again when it starts anew.
    pub rearm: bool,
}

impl Default for Isolation {
    /// 1 GB, and disarmed.
    fn default() -> Self {
        Self { memory: 1_000_000_000, memory_at: None, rearm: false }
    }
}

/// A plugin that is a library, or a named list of plugins.
#[derive(Clone, Debug)]
pub struct PluginEntry {
    /// Its name.
    pub name: Spanned<String>,
    /// The library.
    pub file: Option<Spanned<PathBuf>>,
    /// The plugins of a list.
    pub members: Option<Vec<Spanned<String>>>,
    /// Whether it is loaded at the start.
    pub load: bool,
}

/// A destination and its source: an input that reads a property, or an inbox that takes an outbox's messages.
#[derive(Clone, Debug)]
pub struct Link {
    /// The path of the input or inbox in this agent, such as `follower/pose`; the URL of another agent's inbox.
    pub to: Spanned<String>,
    /// The property or outbox; absolute, and without an agent when it is one of this agent.
    pub from: Spanned<Url>,
    /// Whether it reads last cycle's value, and so breaks a cycle of modules.
    pub previous: bool,
    /// Age from which a value counts as stale, nanoseconds.
    pub stale: Option<Spanned<u64>>,
    /// Which of the values that are written the port gets.
    pub filter: Filter,
    /// Policy of a queue input that lags; skips by default.
    pub policy: Option<Spanned<LinkPolicy>>,
    /// How many values a queue input gets at once; what its module says unless said.
    pub window: Option<Spanned<u16>>,
    /// Transport between agents.
    pub transport: Transport,
    /// Whether it is written or inferred.
    pub wiring: Wiring,
}

/// The origin of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wiring {
    /// The configuration.
    #[default]
    Written,
    /// The types and roles of the ports: an input has one possible source, or an outbox one possible inbox.
    Inferred {
        /// Whether it carries messages.
        sends: bool,
    },
}

/// Which values a link lets through: those that meet all of it.
#[derive(Clone, Debug, Default)]
pub struct Filter {
    /// Passes each value whose number is a multiple of this.
    pub every: Option<Spanned<u64>>,
    /// A condition on a field, such as `range < 0.5`.
    pub when: Option<Spanned<String>>,
}

/// Policy of a queue input that the writer has overtaken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkPolicy {
    /// Continues with the oldest value kept, and counts the lost ones.
    Skip,
    /// Stops reading.
    Evict,
}

/// Transport of values between agents; links inside of one have none.
#[derive(Clone, Debug, Default)]
pub struct Transport {
    /// The carrier, such as `local` or `zenoh`.
    pub carrier: Option<Spanned<String>>,
    /// Whether lost values are sent again.
    pub mode: Option<Spanned<LinkMode>>,
    /// Rate.
    pub rate: Option<Spanned<LinkRate>>,
    /// Least time between two values that are sent on change, nanoseconds.
    pub interval: Option<Spanned<u64>>,
    /// Compression.
    pub compression: Option<Spanned<Compression>>,
}

/// Compression of values to another agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// No compression.
    None,
    /// Without loss.
    Lossless,
    /// Images as JPEG of that quality, from 1 to 100, and others without loss.
    Jpeg(u8),
}

/// Whether lost values are sent again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkMode {
    /// Lost values are sent again.
    Reliable,
    /// Lost values are counted.
    BestEffort,
}

/// Rate of values to another agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkRate {
    /// Each new value.
    OnChange,
    /// The newest value, with this period in nanoseconds.
    Every(u64),
}

/// Sharing with other agents.
#[derive(Clone, Debug)]
pub struct Share {
    /// Its endpoints, such as `local:base`; at least one.
    pub listen: Vec<Spanned<String>>,
    /// Endpoints of other agents by name; `local:NAME` for those that are not named.
    pub agents: BTreeMap<String, Spanned<String>>,
    /// Shared knowledge; nothing when it takes no part in a team.
    pub knowledge: Option<SharedKnowledge>,
    /// Authentication and permissions of others; nothing when it trusts every agent that reaches it.
    pub security: Option<ShareSecurity>,
}

/// The knowledge that a robot shares with its team.
#[derive(Clone, Debug)]
pub struct SharedKnowledge {
    /// The properties with what this robot states, by topic.
    pub facts: BTreeMap<String, Spanned<String>>,
    /// From one look at what changed to the next, nanoseconds.
    pub period: u64,
    /// How many facts of a topic are shown.
    pub room: usize,
    /// The folder where what is known is saved.
    pub save: Option<PathBuf>,
}

/// Authentication and permissions of other agents.
#[derive(Clone, Debug)]
pub struct ShareSecurity {
    /// Where it is written.
    pub place: Span,
    /// Own certificate, and the authority of others.
    pub credentials: Option<Credentials>,
    /// Permissions by agent; an agent that is not in it has none. Nothing when all agents may do all.
    pub allow: Option<BTreeMap<String, Allowance>>,
}

/// The files of an agent's certificate, in PEM.
#[derive(Clone, Debug)]
pub struct Credentials {
    /// The certificate, whose common name is the agent's, and those between it and the authority's.
    pub certificate: Spanned<PathBuf>,
    /// The private key that belongs to it.
    pub key: Spanned<PathBuf>,
    /// The certificates of the authorities that sign the certificates of agents.
    pub authority: Spanned<PathBuf>,
}

/// Permissions of another agent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Allowance {
    /// The properties that it may read.
    pub read: Vec<Pattern>,
    /// The mailboxes that it may send messages to.
    pub send: Vec<Pattern>,
    /// Whether it is of the team: it is told what the team knows, and believed.
    pub team: bool,
}

/// A gate in front of an actuator.
#[derive(Clone, Debug)]
pub struct Actuator {
    /// Its name with that of its robot, such as `r2/wheels`.
    pub name: Spanned<String>,
    /// The properties that command it.
    pub commands: Vec<Spanned<Url>>,
    /// Modules with the aspect Actuators that may command it too.
    pub modules: Vec<Spanned<String>>,
    /// Intervals that fields of the command are kept in, by field.
    pub limits: Vec<Limit>,
    /// Rate limits of fields of the command, per second.
    pub rate_limits: Vec<RateLimit>,
    /// Age at which a command is no longer followed, nanoseconds.
    pub time_to_live: Spanned<u64>,
    /// The command that holds when there is no other; what it leaves out is the interface's own safe value.
    pub safe: Table,
}

/// The closed interval that a field of a command is kept in.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// The field, such as `left`.
    pub field: Spanned<String>,
    /// The lowest value, in the field's unit.
    pub low: f64,
    /// The highest value, in the field's unit.
    pub high: f64,
}

/// Rate limit of a field of a command.
#[derive(Clone, Debug, PartialEq)]
pub struct RateLimit {
    /// The field, such as `left`.
    pub field: Spanned<String>,
    /// The largest change, in the field's unit per second.
    pub per_second: f64,
}

/// The end of a run.
#[derive(Clone, Debug)]
pub struct Mission {
    /// A property with an outcome field.
    pub outcome: Spanned<Url>,
}

/// Levels and targets of the log.
#[derive(Clone, Debug)]
pub struct Log {
    /// The level of every module that has none of its own.
    pub level: Spanned<Level>,
    /// Levels of single modules, or of all whose names begin so: where the name is written, the name, and the level.
    pub levels: Vec<(Spanned<String>, Spanned<Level>)>,
    /// Lines of one text that a module may write in a second; 0 for all.
    pub repeat: Spanned<u64>,
    /// Where the log goes.
    pub targets: LogTargets,
}

/// Where the log goes, beside what the application adds.
#[derive(Clone, Debug)]
pub struct LogTargets {
    /// Whether it goes to standard error.
    pub console: bool,
    /// The file that it is written to.
    pub file: Option<LogFile>,
    /// The syslog that it is sent to.
    pub syslog: Option<Spanned<SyslogAddress>>,
    /// The address at which subscribers get it.
    pub remote: Option<Spanned<SocketAddr>>,
}

/// A log file that is rotated.
#[derive(Clone, Debug, PartialEq)]
pub struct LogFile {
    /// Where it is; relative to the file that names it.
    pub path: Spanned<PathBuf>,
    /// The size at which a new file is begun, bytes.
    pub size: u64,
    /// How many older files are kept.
    pub keep: u32,
}

impl Log {
    /// The level of a module.
    pub fn level_of(&self, module: &str) -> Level {
        self.levels().of(module)
    }

    /// All levels.
    pub fn levels(&self) -> Levels {
        let mut levels = Levels::new(self.level.value);
        self.levels.iter().for_each(|(name, level)| levels.set(Some(name), level.value));
        levels
    }
}

/// Name, seed and main loop of the agent.
#[derive(Clone, Debug)]
pub(super) struct Agent {
    pub(super) name: Spanned<String>,
    pub(super) seed: Spanned<u64>,
    pub(super) main_loop: Loop,
}

/// Pace and stages of the main loop; durations in nanoseconds.
#[derive(Clone, Debug)]
pub(super) struct Loop {
    pub(super) period: Spanned<u64>,
    pub(super) minimum: Option<Spanned<u64>>,
    pub(super) hang: Spanned<u64>,
    pub(super) schedule: Schedule,
}
