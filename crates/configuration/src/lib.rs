//! Configuration of an agent, read from TOML.
//!
//! A configuration comes in layers, of which a later one overrides an earlier one setting by setting: built-in
//! defaults, included files, the file itself, the host's file, and settings of the command line. It is read as a
//! whole or not at all: either all of it is right, or a [`Report`] shows everything that is wrong with file, line
//! and caret. Every value keeps its place in the text, so that later checks can
//! point there, too ([`Configuration::diagnostic`]).
//!
//! A file may describe several agents: each has a table `agents.NAME` with the tables of a configuration, also an
//! `include`. It overrides the settings outside of `agents`, which hold for all of them. [`Options::agent`] selects the
//! agent to read. With `agents.NAME.runs` the agent has those robots and modules of the settings outside, and no other
//! agent has them.
//!
//! A [`Configuration`] never changes. A [`Database`] holds the one of a running agent, with a last layer of changes
//! made at run time.
//!
//! ```
//! use slate_configuration::{Configuration, Options};
//!
//! let text = r#"
//!     [modules.follower]
//!     params.gain = 1.2
//!     [links]
//!     "follower/pose" = "localizer/pose"
//! "#;
//! let options = Options { sets: vec!["modules.follower.params.gain=2.5".into()], ..Options::default() };
//! let configuration = Configuration::from_text("exp1.toml", text, &options)?;
//! let gain = configuration.value("modules.follower.params.gain").and_then(|gain| gain.as_f64());
//! assert_eq!(gain, Some(2.5));
//! assert_eq!(configuration.origin("links.'follower/pose'").map(|o| o.to_string()), Some("exp1.toml:5".into()));
//! # Ok::<(), slate_configuration::Report>(())
//! ```

mod actuators;
mod agents;
mod bridged;
mod build;
mod change;
mod choices;
mod compare;
mod comparison;
mod context_lines;
mod database;
mod derived;
mod described;
mod diagnostic;
mod division;
mod document;
mod error_code;
mod exclusive;
mod external;
mod files;
mod inferred;
mod layered;
mod layers;
mod levels;
mod links;
mod log;
mod model;
mod modules;
mod path;
mod places;
mod plugins;
mod printable;
mod problems;
mod read;
mod record;
pub mod replacement;
mod schedule;
mod scope;
mod senders;
mod set;
mod share;
mod snapshot;
mod source;
mod stages;
mod syslog;
mod team;
mod trigger;
mod value;

use std::path::{Path, PathBuf};

use agents::Described;
use bridged::BridgedPorts;
pub use change::Change;
pub use choices::Variant;
pub use comparison::Comparison;
pub use database::{Database, Difference, Edit, Proposal, SaveTo, Subscription, Watch, parse_change};
pub use diagnostic::{Diagnostic, Report};
pub use error_code::{EXPLANATIONS, ErrorCode, Explanation, Message};
pub use external::{ExternalDirection, ExternalLink, ExternalUrl};
pub use inferred::InferredLink;
pub use layered::Layered;
pub use levels::Levels;
pub use model::{
    Actuator, Allowance, Compression, Credentials, Filter, Isolation, Limit, Link, LinkMode, LinkPolicy,
    LinkRate, Log, LogFile, LogTargets, Mission, Module, PluginEntry, RateLimit, Share, ShareSecurity,
    SharedKnowledge, Transport, Wiring,
};
use path::Prefix;
pub use path::{limit_setting, link_setting, robot_setting, sender_setting};
pub use places::empty_robots;
pub use printable::{printable, printable_text};
use problems::Problems;
use read::Main;
pub use record::{Flight, FlightTrigger, RATE, Record, RecordRule, RecordSelection, period};
pub use schedule::{Schedule, ScheduleError, ScheduledStage, is_stage_name};
use source::Sources;
pub use source::{Origin, SettingSource, SourceKind, Span, Spanned};
pub use syslog::SyslogAddress;
pub use team::{TEAM, is_topic};
pub use trigger::{SnapshotCondition, SnapshotTrigger};
pub use value::{Table, TableEntry, Value};

/// Layers of a configuration beside its main file.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Default settings of the program, `path=value`.
    /// Files and the command line override them.
    pub defaults: Vec<String>,
    /// Settings of the command line, `path=value`, later ones last.
    pub sets: Vec<String>,
    /// File with the settings of this machine; it overrides the main file.
    pub host: Option<PathBuf>,
    /// Agent to read from a file with several, by the name of its table.
    pub agent: Option<String>,
    /// Names of top-level tables of the application, such as `world`.
    pub extra_tables: Vec<String>,
    /// Settings of the application that may be paths, such as `world.arena`.
    /// Paths are relative to the file that they are written in; `*` is any name. A text with neither a slash nor the
    /// ending `.toml` is a name, and no path.
    pub paths: Vec<String>,
    /// Path and text of files that are part of the program.
    /// A main text includes them in place of those on the disk.
    pub embedded: &'static [(&'static str, &'static str)],
    /// True if the main text is that of a running or recorded agent.
    /// The settings of its variants are part of it already, below later settings.
    pub is_recorded: bool,
}

/// Value and its origin.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Path, as `--set` takes it.
    pub path: String,
    /// The value.
    pub value: Value,
    /// Place where it is written.
    pub origin: Origin,
}

/// A valid configuration.
#[derive(Clone, Debug)]
pub struct Configuration {
    sources: Sources,
    /// This agent and the others, if the files describe several.
    described: Option<Described>,
    /// Settings of the files, without the command line and changes at run time.
    files: Table,
    /// Settings of the files, with waiting changes reverted.
    base: Table,
    /// Tables of the settings above the files, in their order.
    upper: Vec<(SourceKind, Table)>,
    merged: Table,
    agent: model::Agent,
    time_source: Option<Spanned<String>>,
    clock_elsewhere: bool,
    mission: Option<Mission>,
    snapshot: Option<SnapshotTrigger>,
    record: Record,
    log: Log,
    share: Option<Share>,
    plugins: Vec<PluginEntry>,
    modules: Vec<Module>,
    links: Vec<Link>,
    external: Vec<ExternalLink>,
    actuators: Vec<Actuator>,
}

impl Configuration {
    /// Reads a file and all its layers.
    ///
    /// # Errors
    /// All errors in any of them.
    pub fn load(path: impl AsRef<Path>, options: &Options) -> Result<Self, Report> {
        let main = Main::File(path.as_ref().to_owned());
        described::read_all(&main, options).result
    }

    /// Reads a text as a file of that name.
    /// Included files are found beside that name.
    ///
    /// # Errors
    /// All errors in any of the layers.
    pub fn from_text(name: &str, text: &str, options: &Options) -> Result<Self, Report> {
        let main = Main::Text { name: name.into(), text: text.into() };
        described::read_all(&main, options).result
    }

    /// Returns the agents of a file, by name; empty for the file of one agent.
    ///
    /// # Errors
    /// A file that can't be read, or is no TOML.
    pub fn agents(path: impl AsRef<Path>, options: &Options) -> Result<Vec<String>, Report> {
        described::names(&Main::File(path.as_ref().to_owned()), options)
    }

    /// Name of the agent; the default is that of the file, without its ending.
    pub fn agent_name(&self) -> &str {
        &self.agent.name
    }

    /// Seed of all random streams.
    pub fn seed(&self) -> &Spanned<u64> {
        &self.agent.seed
    }

    /// Period of the main loop, ns.
    pub fn period(&self) -> &Spanned<u64> {
        &self.agent.main_loop.period
    }

    /// Wall-clock time after which a step counts as hung, ns.
    pub fn hang(&self) -> &Spanned<u64> {
        &self.agent.main_loop.hang
    }

    /// Minimum period of a cycle on the wall clock, ns.
    /// It keeps a loop that is behind from spinning.
    pub fn minimum(&self) -> Option<&Spanned<u64>> {
        self.agent.main_loop.minimum.as_ref()
    }

    /// The stages of the main loop.
    pub fn schedule(&self) -> &Schedule {
        &self.agent.main_loop.schedule
    }

    /// Module that is the time source; `None` for the system's clock.
    pub fn time_source(&self) -> Option<&Spanned<String>> {
        self.time_source.as_ref()
    }

    /// Returns true if the time source is a module of another agent of the file.
    /// An example is a simulator that embodies the robots of other agents. This agent then uses the system's clock.
    pub fn is_clock_elsewhere(&self) -> bool {
        self.clock_elsewhere
    }

    /// Mission, which ends the run.
    pub fn mission(&self) -> Option<&Mission> {
        self.mission.as_ref()
    }

    /// Trigger of automatic snapshots.
    pub fn snapshot(&self) -> Option<&SnapshotTrigger> {
        self.snapshot.as_ref()
    }

    /// The recording.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// The log.
    pub fn log(&self) -> &Log {
        &self.log
    }

    /// Sharing; `None` without a section `[share]`: no agent finds this one then.
    pub fn share(&self) -> Option<&Share> {
        self.share.as_ref()
    }

    /// The modules of the agent and of its robots, by name.
    pub fn modules(&self) -> &[Module] {
        &self.modules
    }

    /// Links, by the input that they fill.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// The gates, by name.
    pub fn actuators(&self) -> &[Actuator] {
        &self.actuators
    }

    /// Table at the top, such as one of [`Options::extra_tables`].
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.merged.get(name)?.as_table()
    }

    /// Setting at a path as of `--set`.
    /// Examples are `world.layout` and `log.levels."r2/planner"`.
    pub fn value(&self, path: &str) -> Option<&Spanned<Value>> {
        let names = scope::flatten_path(path::names(path, self.described_as()).ok()?);
        self.merged.at(names.iter().map(String::as_str))
    }

    /// Returns true if the messages of an outbox leave the agent over a bridge.
    /// An entry of `[ros1.call]` or `[ros2.call]` names the outbox.
    pub fn is_outgoing(&self, outbox: &str) -> bool {
        BridgedPorts(self).is_outgoing(outbox)
    }

    /// Returns true if a bridge reads or fills a port.
    /// `[dds]`, `[ros1]` or `[ros2]` names the port.
    pub fn is_bridged(&self, port: &str) -> bool {
        BridgedPorts(self).has(port)
    }

    /// Returns the place of a complaint that begins with the path of a setting.
    /// An example is `world.goal: two numbers`. It is the place of the setting, or of the nearest written table above
    /// it; `None` for other complaints.
    pub fn place_of(&self, complaint: &str) -> Option<Span> {
        let (mut path, _) = complaint.split_once(": ")?;
        loop {
            if let Some(value) = self.value(path) {
                return Some(value.span);
            }
            path = path.rsplit_once('.')?.0;
        }
    }

    /// Returns the settings at a path and below it, in the order of their paths.
    /// An empty path selects all.
    ///
    /// # Errors
    /// The path is invalid.
    pub fn settings(&self, path: &str) -> Result<Vec<Setting>, Report> {
        let prefix = Prefix::parse(path, self.described_as())?;
        let mut settings = Vec::new();
        compare::leaves(&self.merged, &[], &mut |path, value| {
            if prefix.holds(&path) {
                let (value, origin) = (value.value.clone(), self.origin_of(value.span));
                settings.push(Setting { path: path::render(&path), value, origin });
            }
        });
        Ok(settings)
    }

    /// Origin of the setting at a path; `None` if only code decides it.
    pub fn origin(&self, path: &str) -> Option<Origin> {
        self.value(path).map(|value| self.origin_of(value.span))
    }

    /// Origin of a span.
    pub fn origin_of(&self, span: Span) -> Origin {
        self.sources.origin(span)
    }

    /// Texts in the order in which they were found.
    /// A later text does not always override an earlier one.
    pub fn sources(&self) -> &[SettingSource] {
        &self.sources.0
    }

    /// Rank of the text of a place.
    /// A text of higher rank overrides the others, as a file overrides those that it includes.
    pub fn rank(&self, span: Span) -> usize {
        self.sources.rank(span)
    }

    /// Returns the options of a link, as written.
    pub fn link_options(&self, link: &Link) -> Vec<(String, String)> {
        let of_sender = sender_setting(&link.to.value, &link.from.value.to_string());
        let is_sender = self.value(&of_sender).is_some();
        let path = if is_sender { of_sender } else { link_setting(&link.to.value) };
        let depth = toml_edit::Key::parse(&path).map_or(0, |keys| keys.len());
        let options = self.settings(&path).unwrap_or_default().into_iter();
        let named = options.filter_map(|option| {
            let keys = toml_edit::Key::parse(&option.path).ok()?;
            let name = keys.get(depth).filter(|key| key.get() != "from")?;
            Some((name.get().to_owned(), option.value.to_string()))
        });
        named.collect()
    }

    /// Returns the path in this agent that a text denotes.
    ///
    /// # Errors
    /// When it is not a URL, or that of another agent.
    pub fn own_path(&self, text: &str) -> Result<String, Report> {
        let refusal = |message: Message, help: &str| {
            Report::from(Diagnostic::without_place(message, Some(help.into())))
        };
        let help = "a property is module/property, /module/property or slate://agent/module/property";
        let url = slate_blackboard::Url::parse(text)
            .map_err(|error| refusal(ErrorCode::Value.of(error.to_string()), help))?;
        match url.agent() {
            Some(TEAM) => Ok(format!("{TEAM}/{}", url.path_in(""))),
            Some(agent) if agent != self.agent_name() => {
                let message = ErrorCode::OtherAgent
                    .of(format!("`{text}` belongs to agent `{agent}`, and this is `{}`", self.agent_name()));
                Err(refusal(message, &format!("ask that agent: --agent {agent}")))
            }
            _ => Ok(url.path_in("")),
        }
    }

    /// Returns the parameters that links fill, all or in part, with their modules.
    pub fn linked_parameters(&self) -> impl Iterator<Item = (&str, &str)> {
        self.links().iter().filter_map(|link| {
            let (module, rest) = link.to.value.split_once("/params/")?;
            Some((module, rest.split('/').next()?))
        })
    }

    /// Endpoint of another agent.
    pub fn endpoint_of(&self, agent: &str) -> String {
        let named = self.share().and_then(|share| share.agents.get(agent));
        named.map_or_else(|| format!("local:{agent}"), |at| at.value.clone())
    }

    /// Returns the name of this agent's table, if the files describe several.
    fn described_as(&self) -> Option<&str> {
        self.described.as_ref().map(|described| described.name.as_str())
    }

    /// Folder for relative paths at a place: that of the file they are written in.
    pub fn folder_of(&self, span: Span) -> PathBuf {
        self.sources.folder(span)
    }

    /// The plugins that are libraries, and named lists of plugins, by name.
    pub fn plugins(&self) -> &[PluginEntry] {
        &self.plugins
    }

    /// The text at a place.
    pub fn text_at(&self, span: Span) -> &str {
        self.sources.of(span).text.get(span.start..span.end).unwrap_or_default()
    }

    /// Makes an error at a place of this configuration, for its user.
    pub fn diagnostic(&self, span: Span, message: impl Into<Message>, help: Option<String>) -> Diagnostic {
        Diagnostic::at(&self.sources, span, message.into(), help)
    }

    /// Returns an error for each key of a table that is not among `known`.
    /// `place` names the table, such as `in [world]`.
    pub fn unknown_keys(&self, table: &Table, place: &str, known: &[&str]) -> Vec<Diagnostic> {
        let mut problems = Problems::default();
        problems.unknown_keys(table, place, known);
        report(&self.sources, problems).diagnostics().to_vec()
    }
}

/// Returns the configuration of a recorded agent, to load an agent like it.
/// `text` is the configuration as the agent gave it. `sets` are settings of the command line above it.
///
/// # Errors
/// When the text is no longer valid, or a setting is wrong.
pub fn recorded_configuration(name: &str, text: &str, sets: Vec<String>) -> Result<Database, Report> {
    let options = Options { sets, extra_tables: extra_tables(text), is_recorded: true, ..Options::default() };
    Database::from_text(name, text, options)
}

/// Returns the names at the top of a configuration that choose no variant.
/// They may belong to an application.
pub fn extra_tables(text: &str) -> Vec<String> {
    let document = text.parse::<toml_edit::DocumentMut>().unwrap_or_default();
    let chooses =
        |name: &str| document.get(layers::CHOICES).is_some_and(|choices| choices.get(name).is_some());
    document.iter().map(|(name, _)| name.to_owned()).filter(|name| !chooses(name)).collect()
}

/// Returns all problems in the order of the texts.
/// A setting that is written once is reported once.
fn report(sources: &Sources, mut problems: Problems) -> Report {
    let text = |source: usize| sources.0[source].place.part_of.unwrap_or(source);
    problems.0.sort_by_key(|problem| problem.span.map(|span| (text(span.source), span.start)));
    problems.0.dedup_by(|a, b| a.span == b.span && a.message == b.message);
    // To show one takes as long as its text is long.
    let unsaid = problems.0.len().saturating_sub(diagnostic::MAX_SHOWN_ERRORS);
    problems.0.truncate(diagnostic::MAX_SHOWN_ERRORS);
    let diagnostics = problems.0.into_iter().map(|problem| match problem.span {
        Some(span) => Diagnostic::at(sources, span, problem.message, problem.help),
        None => Diagnostic::without_place(problem.message, problem.help),
    });
    Report::of(diagnostics.collect(), unsaid)
}
