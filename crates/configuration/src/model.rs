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
    /// What holds for that process.
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

/// What holds for the process of an isolated module.
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
    /// What happens to a queue input that lags; it skips unless said.
    pub policy: Option<Spanned<LinkPolicy>>,
    /// How many values a queue input gets at once; what its module says unless said.
    pub window: Option<Spanned<u16>>,
    /// How the values travel.
    pub transport: Transport,
    /// Who says that it is there.
    pub wiring: Wiring,
}

/// Who says that a link is there.
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
    /// Every so manieth value that is written.
    pub every: Option<Spanned<u64>>,
    /// A condition on a field, such as `range < 0.5`.
    pub when: Option<Spanned<String>>,
}

/// What happens to a queue input that the writer has overtaken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkPolicy {
    /// It goes on with the oldest value kept; what it lost is counted.
    Skip,
    /// It gets no more.
    Evict,
}

/// How values travel between agents; nothing of it can be said of a link inside of one.
#[derive(Clone, Debug, Default)]
pub struct Transport {
    /// What carries them, such as `local` or `zenoh`.
    pub carrier: Option<Spanned<String>>,
    /// Whether losses are made good.
    pub mode: Option<Spanned<LinkMode>>,
    /// When they are sent.
    pub rate: Option<Spanned<LinkRate>>,
    /// What is between two values that are sent on change at least, nanoseconds.
    pub interval: Option<Spanned<u64>>,
    /// Whether they are made smaller.
    pub compression: Option<Spanned<Compression>>,
}

/// How values are made smaller on their way to another agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// Not at all.
    None,
    /// Without loss.
    Lossless,
    /// Images as JPEG of that quality, from 1 to 100, and others without loss.
    Jpeg(u8),
}

/// Whether losses on the way are made good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkMode {
    /// They are, which takes time.
    Reliable,
    /// They are counted.
    BestEffort,
}

/// When values are sent to another agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkRate {
    /// When there is a new one.
    OnChange,
    /// Once in so many nanoseconds.
    Every(u64),
}

/// What the agent records of itself.
#[derive(Clone, Debug)]
pub struct Record {
    /// Whether it does from the start.
    pub enabled: bool,
    /// The file; `run.mcap` beside the report unless said.
    pub file: Option<Spanned<PathBuf>>,
    /// What is recorded.
    pub selection: RecordSelection,
    /// Bytes from which a piece of the file is closed, with its checksum.
    pub chunk: u64,
    /// Wall-clock nanoseconds after which it is closed even when it is smaller.
    pub within: u64,
    /// Bytes that each thread which writes values may be ahead of the file; of large values it may be sixteen, up to
    /// 32 MiB.
    pub buffer: u64,
    /// What is kept in memory of the last seconds.
    pub flight: Flight,
}

impl Default for Record {
    /// Everything, when somebody asks for it.
    fn default() -> Self {
        Self {
            enabled: false,
            file: None,
            selection: RecordSelection::default(),
            chunk: 64 << 10,
            within: 100_000_000,
            buffer: 4 << 20,
            flight: Flight::default(),
        }
    }
}

/// Which values are recorded of which properties.
#[derive(Clone, Debug)]
pub struct RecordSelection {
    /// The properties.
    pub select: Vec<Pattern>,
    /// Those of them that are not recorded.
    pub exclude: Vec<Pattern>,
    /// Of which of them not every value is; the first rule for a property counts.
    pub rules: Vec<RecordRule>,
}

impl Default for RecordSelection {
    /// Every value of every property.
    fn default() -> Self {
        Self { select: Pattern::parse("/**").into_iter().collect(), exclude: Vec::new(), rules: Vec::new() }
    }
}

/// Which values of some properties are recorded.
#[derive(Clone, Debug)]
pub struct RecordRule {
    /// The properties.
    pub select: Vec<Pattern>,
    /// At most one in so many nanoseconds of the agent's time; 0 is each.
    pub period: u64,
    /// Only those that are other ones than the last that was recorded.
    pub on_change: bool,
}

/// What an agent keeps in memory of the last seconds, to save it when something has happened.
#[derive(Clone, Debug)]
pub struct Flight {
    /// Whether it does.
    pub enabled: bool,
    /// How far back that goes, nanoseconds of the agent's time,
    pub keep: u64,
    /// and how many bytes it takes at most.
    pub memory: u64,
    /// Properties whose values may have more bytes are left out.
    pub largest: u64,
    /// What saves it.
    pub triggers: Vec<FlightTrigger>,
    /// Nanoseconds of the agent's time after which the same trigger may save again.
    pub every: u64,
    /// How many files of a trigger are kept; the oldest one makes room.
    pub files: u64,
}

impl Default for Flight {
    /// In memory, and on the disk when somebody asks.
    fn default() -> Self {
        Self {
            enabled: true,
            keep: 60_000_000_000,
            memory: 64 << 20,
            largest: 64 << 10,
            triggers: Vec::new(),
            every: 10_000_000_000,
            files: 4,
        }
    }
}

/// What makes an agent save its last seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FlightTrigger {
    /// A module panicked, does not return, or has failed for good.
    Fault,
    /// An actuator was stopped.
    Stop,
    /// A reflex took over.
    Reflex,
}

impl FlightTrigger {
    /// All of them, by the names that a configuration has for them.
    pub const NAMES: [(&str, Self); 3] =
        [("fault", Self::Fault), ("stop", Self::Stop), ("reflex", Self::Reflex)];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }
}

/// How the agent shares with others.
#[derive(Clone, Debug)]
pub struct Share {
    /// Where others find it, such as `local:base`; at least one place.
    pub listen: Vec<Spanned<String>>,
    /// Where it finds others, by their names; `local:NAME` for those that are not named.
    pub agents: BTreeMap<String, Spanned<String>>,
    /// What it shares of its knowledge; nothing when it takes no part in a team.
    pub knowledge: Option<SharedKnowledge>,
    /// How it knows others, and what they may do; nothing when it trusts whoever reaches it.
    pub security: Option<ShareSecurity>,
}

/// What a robot shares of its knowledge with its team.
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

/// How an agent knows others, and what they may do.
#[derive(Clone, Debug)]
pub struct ShareSecurity {
    /// Where it is written.
    pub place: Span,
    /// What this agent shows others, and what it takes from them.
    pub credentials: Option<Credentials>,
    /// What each agent may do, by its name; whoever is not in it may do nothing. Nothing when all may do all.
    pub allow: Option<BTreeMap<String, Allowance>>,
}

/// The files of an agent's certificate, in PEM.
#[derive(Clone, Debug)]
pub struct Credentials {
    /// The certificate, whose common name is the agent's, and those between it and the authority's.
    pub certificate: Spanned<PathBuf>,
    /// The private key that belongs to it.
    pub key: Spanned<PathBuf>,
    /// The certificates of those who may sign the certificates of agents.
    pub authority: Spanned<PathBuf>,
}

/// What another agent may do.
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
    /// How fast fields of the command may change, per second, by field.
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

/// How fast a field of a command may change.
#[derive(Clone, Debug, PartialEq)]
pub struct RateLimit {
    /// The field, such as `left`.
    pub field: Spanned<String>,
    /// The largest change, in the field's unit per second.
    pub per_second: f64,
}

/// What ends a run.
#[derive(Clone, Debug)]
pub struct Mission {
    /// A property with an outcome field.
    pub outcome: Spanned<Url>,
}

/// What is logged, and where to.
#[derive(Clone, Debug)]
pub struct Log {
    /// The level of every module that has none of its own.
    pub level: Spanned<Level>,
    /// Levels of single modules, or of all whose names begin so: where the name is written, the name, and the level.
    pub levels: Vec<(Spanned<String>, Spanned<Level>)>,
    /// How many lines of one text a module may write in a second; 0 for all.
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
