use std::path::PathBuf;
use std::sync::Arc;

use slate_sorted::SortedSet;

use super::actuators::ActuatorReader;
use super::agents::Described;
use super::build::Build;
use super::change::Change;
use super::exclusive::settle;
use super::files::Files;
use super::layers::Layers;
use super::links::{LinkReader, WrittenLinks};
use super::log::LogReader;
use super::modules::ModuleReader;
use super::plugins::PluginReader;
use super::problems::Problem;
use super::record::RecordReader;
use super::set::Written;
use super::share::ShareReader;
use super::snapshot::SnapshotReader;
use super::source::{SourceKind, Span};
use super::value::Table;
use super::{Configuration, Options, Report, report};
use crate::error_code::ErrorCode;

/// Main file of a configuration, or a text in place of one.
#[derive(Debug)]
pub(super) enum Main {
    File(PathBuf),
    Text { name: String, text: Arc<str> },
}

/// Input of a reader: main file, options and changes.
pub(super) struct ReadRequest<'a> {
    pub(super) main: &'a Main,
    pub(super) options: &'a Options,
    /// Changes of edited files that wait for the next start.
    pub(super) waiting: &'a [Change],
    /// Changes made at run time, later ones last.
    pub(super) changes: &'a [Written<'a>],
    /// True if the agent may run on another machine.
    /// A missing file is not an error then.
    pub(super) elsewhere: bool,
}

impl<'a> ReadRequest<'a> {
    /// Makes a request of the settings at the start.
    pub(super) fn new(main: &'a Main, options: &'a Options) -> Self {
        Self { main, options, waiting: &[], changes: &[], elsewhere: false }
    }
}

/// Result of reading.
pub(super) struct ReadOutcome {
    pub(super) result: Result<Configuration, Report>,
    /// Files that were read, also unreadable ones.
    pub(super) files: Files,
    /// Tables of the changes, if all can be read.
    pub(super) changes: Vec<Table>,
    /// Other agents that the files describe.
    pub(super) others: Vec<String>,
    /// Files that contribute to it, each by its canonical path.
    pub(super) paths: SortedSet<PathBuf>,
}

/// Reads a configuration; known files are not read again.
pub(super) fn read(request: &ReadRequest<'_>, files: Files) -> ReadOutcome {
    let ReadRequest { options, waiting, changes, .. } = request;
    let mut layers = layers(request, files);
    layers.incomplete |= !layers.agents.is_chosen(layers.incomplete, &mut layers.problems);
    layers.name_agent();
    let settings = options.sets.iter().map(String::as_str).chain(changes.iter().map(|change| change.text));
    layers.choose(settings, options.is_recorded);
    let of_files = layers.merged.clone();
    layers.flat_sets.clear();
    layers.sets(SourceKind::Set, options.sets.iter().map(|text| Written { text, equals: None }));
    let sets = std::mem::take(&mut layers.flat_sets);
    let base = layers.hold(waiting, of_files.clone());
    layers.sets(SourceKind::Change, changes.iter().copied());
    let [of_files, base] = layers.divide([of_files, base], &options.extra_tables);
    let files = std::mem::take(&mut layers.walk.files);
    let changes = std::mem::take(&mut layers.flat_sets);
    let sets = sets.into_iter().map(|table| (SourceKind::Set, table));
    let upper = sets.chain(changes.iter().map(|table| (SourceKind::Change, table.clone()))).collect();
    let paths = std::mem::take(&mut layers.walk.read);
    let described = layers.agents.described();
    let others = described.as_ref().map_or(Vec::new(), |described| described.others.clone());
    let below = Below { files: of_files, base, upper };
    ReadOutcome { result: build(layers, below, options, described), files, changes, others, paths }
}

/// Reads all texts in effect at the start, except the command line.
pub(super) fn layers(request: &ReadRequest<'_>, files: Files) -> Layers {
    let ReadRequest { main, options, elsewhere, .. } = request;
    let mut layers = Layers::of(options.agent.clone(), files, *elsewhere);
    layers.paths = options.paths.iter().map(|path| path.split('.').map(String::from).collect()).collect();
    layers.embedded = options.embedded.to_vec();
    layers.defaults();
    layers.sets(SourceKind::Default, options.defaults.iter().map(|text| Written { text, equals: None }));
    match main {
        Main::File(path) => layers.file(path, None),
        Main::Text { name, text } => layers.text(name.clone(), SourceKind::File, None, Arc::clone(text)),
    }
    if let Some(host) = &options.host {
        let described = layers.agents.known.clone();
        layers.file(host, None);
        // The file of this machine describes no agent.
        let all = std::mem::replace(&mut layers.agents.known, described);
        for (name, span) in all {
            if !layers.agents.known.contains_key(&name) {
                layers.agents.unknown(&name, Some(span), layers.incomplete, &mut layers.problems);
            }
        }
    }
    layers
}

/// Layers below a configuration.
struct Below {
    files: Table,
    base: Table,
    upper: Vec<(SourceKind, Table)>,
}

fn build(
    layers: Layers,
    below: Below,
    options: &Options,
    described: Option<Described>,
) -> Result<Configuration, Report> {
    let Below { mut files, mut base, upper } = below;
    let Layers { sources, mut problems, mut merged, incomplete, agents, .. } = layers;
    if incomplete {
        return Err(report(&sources, problems));
    }
    // The first text that is not a setting of the program; built-in defaults are one that is complete.
    let main = sources.0.iter().position(|source| source.kind() == SourceKind::File).unwrap_or_default();
    let main = Span { source: main, start: 0, end: 0 };
    let mut build = Build { sources: &sources, problems: &mut problems };
    build.top(&merged, &options.extra_tables);
    let agent = build.agent(&merged, main);
    let time_source = build.time_source(&merged);
    let mission = build.mission(&merged);
    let name = agent.as_ref().map_or("", |agent| agent.name.as_str());
    let wanted = options.agent.as_deref().filter(|_| described.is_none() && !name.is_empty());
    if let Some(wanted) = wanted.filter(|wanted| *wanted != name) {
        let message = ErrorCode::OtherAgent.of(format!("no agent is called `{wanted}`"));
        let help = format!("the configuration describes one, `{name}`");
        build.problems.0.push(Problem { span: None, message, help: Some(help) });
    }
    let log = LogReader { sources: &sources, problems: &mut problems }.log(&merged);
    let snapshot = SnapshotReader { sources: &sources, problems: &mut problems }.snapshot(&merged);
    let record = RecordReader { sources: &sources, problems: &mut problems }.record(&merged);
    let share = ShareReader { sources: &sources, problems: &mut problems, agent: name }.share(&merged);
    let plugins = PluginReader { sources: &sources, problems: &mut problems }.plugins(&merged);
    let mut modules = ModuleReader { sources: &sources, problems: &mut problems }.modules(&merged);
    let mut links = LinkReader::new(&mut problems, name).links(&merged);
    Build { sources: &sources, problems: &mut problems }.links_or_values(&mut modules, &mut links);
    let WrittenLinks { links, external } = links;
    let actuators =
        ActuatorReader { sources: &sources, problems: &mut problems, agent: name }.actuators(&merged);
    match (agent, log) {
        (Some(agent), Some(log)) if problems.0.is_empty() => {
            settle(&mut merged, &sources);
            settle(&mut files, &sources);
            settle(&mut base, &sources);
            Ok(Configuration {
                sources,
                described,
                files,
                base,
                upper,
                merged,
                agent,
                time_source,
                clock_elsewhere: agents.clock_elsewhere,
                mission,
                snapshot,
                record,
                plugins,
                log,
                share,
                modules,
                links,
                external,
                actuators,
            })
        }
        _ => Err(report(&sources, problems)),
    }
}
