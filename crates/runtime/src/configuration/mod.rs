//! What an agent is made of, read from TOML.
//!
//! A configuration comes in layers, of which a later one overrides an earlier one setting by setting: built-in
//! defaults, included files, the file itself, the host's file, and settings of the command line. It is read as a
//! whole or not at all: either all of it is right, or a [`Report`] shows everything that is wrong with file, line
//! and caret. Every value remembers where it is written, so that whoever finds out later that it doesn't fit can
//! point there too ([`Configuration::diagnostic`]).
//!
//! ```
//! use slate_runtime::configuration::{Configuration, Options};
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
//! # Ok::<(), slate_runtime::configuration::Report>(())
//! ```

mod build;
mod diagnostic;
mod layers;
mod log;
mod model;
mod problems;
mod scope;
mod set;
mod source;
mod value;

use std::path::{Path, PathBuf};

use build::Build;
pub use diagnostic::{Diagnostic, Report};
use layers::Layers;
pub use model::{Actuator, Limit, Link, Log, LogFile, LogTargets, Mission, Module, RateLimit};
use problems::Problems;
use source::Sources;
pub use source::{Origin, Source, SourceKind, Span, Spanned};
pub use value::{Entry, Table, Value};

/// What else goes into a configuration, beside its main file.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Settings of the command line, `path=value`, later ones last.
    pub sets: Vec<String>,
    /// A file with the settings of this computer; it overrides the main file.
    pub host: Option<PathBuf>,
    /// Names at the top that belong to the application, such as `world`.
    pub extra_tables: Vec<String>,
}

/// A valid configuration.
#[derive(Clone, Debug)]
pub struct Configuration {
    sources: Sources,
    merged: Table,
    agent: model::Agent,
    time_source: Option<Spanned<String>>,
    mission: Option<Mission>,
    log: Log,
    modules: Vec<Module>,
    links: Vec<Link>,
    actuators: Vec<Actuator>,
}

impl Configuration {
    /// Reads a file and all its layers.
    ///
    /// # Errors
    /// Everything that is wrong with any of them.
    pub fn load(path: impl AsRef<Path>, options: &Options) -> Result<Self, Report> {
        Self::read(options, |layers| layers.file(path.as_ref(), None))
    }

    /// Reads a text as if it were a file of that name; files it includes are found beside that name.
    ///
    /// # Errors
    /// Everything that is wrong with any of the layers.
    pub fn from_text(name: &str, text: &str, options: &Options) -> Result<Self, Report> {
        Self::read(options, |layers| layers.text(name.into(), SourceKind::File, None, text))
    }

    fn read(options: &Options, main: impl FnOnce(&mut Layers)) -> Result<Self, Report> {
        let mut layers = Layers::default();
        layers.defaults();
        let main_source = layers.sources.0.len();
        main(&mut layers);
        if let Some(host) = &options.host {
            layers.file(host, None);
        }
        layers.sets(options);
        let Layers { sources, mut problems, merged, incomplete, .. } = layers;
        if incomplete {
            return Err(report(&sources, problems));
        }
        let main = Span { source: main_source, start: 0, end: 0 };
        let mut build = Build { sources: &sources, problems: &mut problems };
        build.top(&merged, &options.extra_tables);
        let agent = build.agent(&merged, main);
        let log = build.log(&merged);
        let time_source = build.time_source(&merged);
        let mission = build.mission(&merged);
        let name = agent.as_ref().map_or("", |agent| agent.name.as_str());
        let mut modules = build.modules(&merged);
        let mut links = build.links(&merged, name);
        build.links_or_values(&mut modules, &mut links);
        let actuators = build.actuators(&merged, name);
        match (agent, log) {
            (Some(agent), Some(log)) if problems.0.is_empty() => {
                Ok(Self { sources, merged, agent, time_source, mission, log, modules, links, actuators })
            }
            _ => Err(report(&sources, problems)),
        }
    }

    /// The agent's name; by default that of the file, without its ending.
    pub fn agent_name(&self) -> &str {
        &self.agent.name
    }

    /// The seed of all random streams.
    pub fn seed(&self) -> &Spanned<u64> {
        &self.agent.seed
    }

    /// The period of the main loop, nanoseconds.
    pub fn period(&self) -> &Spanned<u64> {
        &self.agent.period
    }

    /// Wall-clock time after which a step counts as hung, nanoseconds.
    pub fn hang(&self) -> &Spanned<u64> {
        &self.agent.hang
    }

    /// The module that is the time source; without one, it is the system's clock.
    pub fn time_source(&self) -> Option<&Spanned<String>> {
        self.time_source.as_ref()
    }

    /// What ends the run.
    pub fn mission(&self) -> Option<&Mission> {
        self.mission.as_ref()
    }

    /// What is logged.
    pub fn log(&self) -> &Log {
        &self.log
    }

    /// The modules of the agent and of its robots, by name.
    pub fn modules(&self) -> &[Module] {
        &self.modules
    }

    /// The links, by the input they feed.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// The gates, by name.
    pub fn actuators(&self) -> &[Actuator] {
        &self.actuators
    }

    /// A table at the top, such as one of [`Options::extra_tables`].
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.merged.get(name)?.as_table()
    }

    /// The setting at a path as `--set` takes it, such as `world.layout` or `log.levels."r2/planner"`.
    pub fn value(&self, path: &str) -> Option<&Spanned<Value>> {
        let keys = toml_edit::Key::parse(path).ok()?;
        let names = scope::flatten_path(keys.iter().map(|key| key.get().to_owned()).collect());
        self.merged.at(names.iter().map(String::as_str))
    }

    /// Where the setting at a path comes from; nothing if only code decides it.
    pub fn origin(&self, path: &str) -> Option<Origin> {
        self.value(path).map(|value| self.origin_of(value.span))
    }

    /// Where a span is.
    pub fn origin_of(&self, span: Span) -> Origin {
        self.sources.origin(span)
    }

    /// The texts, as they were found; the later of two doesn't always override the earlier.
    pub fn sources(&self) -> &[Source] {
        &self.sources.0
    }

    /// An error at a place of this configuration, found by whoever uses it.
    pub fn diagnostic(&self, span: Span, message: impl Into<String>, help: Option<String>) -> Diagnostic {
        Diagnostic::at(&self.sources, span, message.into(), help)
    }

    /// An error for each key of a table that is none of `known`; `place` names the table, such as `in [world]`.
    pub fn unknown_keys(&self, table: &Table, place: &str, known: &[&str]) -> Vec<Diagnostic> {
        let mut problems = Problems::default();
        problems.unknown_keys(table, place, known);
        report(&self.sources, problems).diagnostics().to_vec()
    }
}

/// All problems in the order of the texts; a setting that is written once is reported once.
fn report(sources: &Sources, mut problems: Problems) -> Report {
    problems.0.sort_by_key(|problem| problem.span.map(|span| (span.source, span.start)));
    problems.0.dedup_by(|a, b| a.span == b.span && a.message == b.message);
    let diagnostics = problems.0.into_iter().map(|problem| match problem.span {
        Some(span) => Diagnostic::at(sources, span, problem.message, problem.help),
        None => Diagnostic::without_place(problem.message, problem.help),
    });
    Report::from(diagnostics.collect::<Vec<_>>())
}
