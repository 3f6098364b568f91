use std::net::SocketAddr;
use std::path::PathBuf;

use slate_blackboard::{Pattern, Url};
use slate_module::{Level, Stage, Trigger};
use slate_sorted::SortedMap;

use super::source::{Span, Spanned};
use super::value::Table;
use crate::levels::Levels;
use crate::schedule::Schedule;
use crate::syslog::SyslogAddress;

/// A module of the agent.
#[derive(Clone, Debug)]
pub struct Module {
    /// Name with that of its robot, such as `r2/planner`; its URL is `/r2/planner`.
    pub name: Spanned<String>,
    /// Kind, such as `pure_pursuit`.
    pub kind: Spanned<String>,
    /// True if it runs from the start.
    pub enabled: Spanned<bool>,
    /// True if it runs in a process of its own.
    pub isolated: Spanned<bool>,
    /// Limits of its process.
    pub isolation: Isolation,
    /// File that keeps its state from run to run.
    /// It is relative to the file that names it.
    pub memory: Option<Spanned<PathBuf>>,
    /// Stage that overrides the module's own.
    pub stage: Option<Spanned<Stage>>,
    /// Trigger that overrides the module's own.
    pub trigger: Option<Spanned<Trigger>>,
    /// Deadline that overrides the module's own, ns.
    pub deadline: Option<Spanned<u64>>,
    /// Parameters.
    pub params: Table,
    /// Values of inputs without a link, by port.
    pub inputs: Table,
}

/// Limits of the process of an isolated module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Isolation {
    /// Memory limit of the module's allocations, bytes.
    pub memory: u64,
    /// Place of the memory limit, if it is written.
    pub memory_at: Option<Span>,
    /// True if its actuators stay armed when it fails.
    /// They follow the module again when it restarts.
    pub rearm: bool,
}

impl Default for Isolation {
    /// Returns a limit of 1 GB, without rearming.
    fn default() -> Self {
        Self { memory: 1_000_000_000, memory_at: None, rearm: false }
    }
}

/// A plugin that is a library, or a named list of plugins.
#[derive(Clone, Debug)]
pub struct PluginEntry {
    /// Name.
    pub name: Spanned<String>,
    /// The library.
    pub file: Option<Spanned<PathBuf>>,
    /// The plugins of a list.
    pub members: Option<Vec<Spanned<String>>>,
    /// True if it is loaded at the start.
    pub load: bool,
}

/// Link from a source to a destination.
/// An input reads a property, or an inbox takes an outbox's messages.
#[derive(Clone, Debug)]
pub struct Link {
    /// Path of the input or inbox in this agent, such as `follower/pose`.
    /// For another agent's inbox it is the URL.
    pub to: Spanned<String>,
    /// Property or outbox; absolute, and without an agent for one of this agent.
    pub from: Spanned<Url>,
    /// True if it reads the last cycle's value, which breaks a cycle of modules.
    pub previous: bool,
    /// Age from which a value counts as stale, ns.
    pub stale: Option<Spanned<u64>>,
    /// Filter of the values for the port.
    pub filter: Filter,
    /// Policy of a queue input that lags; skips by default.
    pub policy: Option<Spanned<LinkPolicy>>,
    /// Window of a queue input, in values; the default is that of its module.
    pub window: Option<Spanned<u16>>,
    /// Transport between agents.
    pub transport: Transport,
    /// Origin: written or inferred.
    pub wiring: Wiring,
}

/// The origin of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wiring {
    /// The configuration.
    #[default]
    Written,
    /// Types and roles of the ports.
    /// An input has one possible source, or an outbox one possible inbox.
    Inferred {
        /// True if it carries messages.
        sends: bool,
    },
}

/// Filter of a link; values must satisfy all conditions.
#[derive(Clone, Debug, Default)]
pub struct Filter {
    /// Passes each value whose number is a multiple of this.
    pub every: Option<Spanned<u64>>,
    /// Condition on a field, such as `range < 0.5`.
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
    /// Reliability.
    pub mode: Option<Spanned<LinkMode>>,
    /// Rate.
    pub rate: Option<Spanned<LinkRate>>,
    /// Minimum interval between two values sent on change, ns.
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

/// Reliability of a link.
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
    /// The newest value, with this period, ns.
    Every(u64),
}

/// Sharing with other agents.
#[derive(Clone, Debug)]
pub struct Share {
    /// Endpoints, such as `local:base`; at least one.
    pub listen: Vec<Spanned<String>>,
    /// Endpoints of other agents by name; the default is `local:NAME`.
    pub agents: SortedMap<String, Spanned<String>>,
    /// Shared knowledge; `None` outside of a team.
    pub knowledge: Option<SharedKnowledge>,
    /// Authentication and permissions; `None` to trust all agents that reach it.
    pub security: Option<ShareSecurity>,
}

/// Knowledge that a robot shares with its team.
#[derive(Clone, Debug)]
pub struct SharedKnowledge {
    /// Properties with this robot's facts, by topic.
    pub facts: SortedMap<String, Spanned<String>>,
    /// Polling interval for changes, ns.
    pub period: u64,
    /// Number of facts of a topic that are shown.
    pub room: usize,
    /// Folder for the saved knowledge.
    pub save: Option<PathBuf>,
}

/// Authentication and permissions of other agents.
#[derive(Clone, Debug)]
pub struct ShareSecurity {
    /// Place where it is written.
    pub place: Span,
    /// Own certificate, and the authority of others.
    pub credentials: Option<Credentials>,
    /// Permissions by agent; agents that are not in it have none.
    /// `None` permits all agents everything.
    pub allow: Option<SortedMap<String, Allowance>>,
}

/// The files of an agent's certificate, in PEM.
#[derive(Clone, Debug)]
pub struct Credentials {
    /// Certificate chain up to the authority; its common name is the agent's name.
    /// The chain contains the certificate and those between it and the authority's.
    pub certificate: Spanned<PathBuf>,
    /// The private key that belongs to it.
    pub key: Spanned<PathBuf>,
    /// Certificates of the authorities that sign agents' certificates.
    pub authority: Spanned<PathBuf>,
}

/// Permissions of another agent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Allowance {
    /// The properties that it may read.
    pub read: Vec<Pattern>,
    /// The mailboxes that it may send messages to.
    pub send: Vec<Pattern>,
    /// True for a member of the team.
    /// It receives the team's knowledge, and its facts are trusted.
    pub team: bool,
}

/// Gate of an actuator.
#[derive(Clone, Debug)]
pub struct Actuator {
    /// Name with that of its robot, such as `r2/wheels`.
    pub name: Spanned<String>,
    /// The properties that command it.
    pub commands: Vec<Spanned<Url>>,
    /// Modules with the aspect Actuators that may command it too.
    pub modules: Vec<Spanned<String>>,
    /// Intervals for fields of the command, by field.
    pub limits: Vec<Limit>,
    /// Rate limits of fields of the command, per second.
    pub rate_limits: Vec<RateLimit>,
    /// Time to live of a command, ns.
    pub time_to_live: Spanned<u64>,
    /// Command in the absence of any other.
    /// Missing fields have the interface's safe value.
    pub safe: Table,
}

/// Closed interval for a field of a command.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// The field, such as `left`.
    pub field: Spanned<String>,
    /// Minimum, in the field's unit.
    pub low: f64,
    /// Maximum, in the field's unit.
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

/// Condition for the end of a run.
#[derive(Clone, Debug)]
pub struct Mission {
    /// Property with an outcome field.
    pub outcome: Spanned<Url>,
}

/// Levels and targets of the log.
#[derive(Clone, Debug)]
pub struct Log {
    /// Level of modules without one of their own.
    pub level: Spanned<Level>,
    /// Levels of single modules, or of all modules below a name.
    /// The name comes with its place in the text.
    pub levels: Vec<(Spanned<String>, Spanned<Level>)>,
    /// Largest rate of lines with one text from a module, 1/s; 0 for no limit.
    pub repeat: Spanned<u64>,
    /// Targets of the log.
    pub targets: LogTargets,
}

/// Targets of the log, beside those of the application.
#[derive(Clone, Debug)]
pub struct LogTargets {
    /// True for standard error.
    pub console: bool,
    /// Log file.
    pub file: Option<LogFile>,
    /// Syslog.
    pub syslog: Option<Spanned<SyslogAddress>>,
    /// Address for subscribers.
    pub remote: Option<Spanned<SocketAddr>>,
}

/// Rotated log file.
#[derive(Clone, Debug, PartialEq)]
pub struct LogFile {
    /// Path; relative to the file that names it.
    pub path: Spanned<PathBuf>,
    /// Size at which a new file is begun, bytes.
    pub size: u64,
    /// Number of older files that are kept.
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

/// Pace and stages of the main loop; durations in ns.
#[derive(Clone, Debug)]
pub(super) struct Loop {
    pub(super) period: Spanned<u64>,
    pub(super) minimum: Option<Spanned<u64>>,
    pub(super) hang: Spanned<u64>,
    pub(super) schedule: Schedule,
}
