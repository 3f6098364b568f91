use std::path::PathBuf;
use std::sync::Arc;

use super::build::Build;
use super::exclusive::settle;
use super::files::Files;
use super::layers::Layers;
use super::set::Written;
use super::source::{SourceKind, Span};
use super::value::Table;
use super::{Change, Configuration, Options, Report, report};

/// The file that a configuration is read from, or a text in place of one.
#[derive(Debug)]
pub(super) enum Main {
    File(PathBuf),
    Text { name: String, text: Arc<str> },
}

/// All that a configuration is read from.
pub(super) struct Request<'a> {
    pub(super) main: &'a Main,
    pub(super) options: &'a Options,
    /// What the files say and only the next start can have.
    pub(super) waiting: &'a [Change],
    /// Made at run time, later ones last.
    pub(super) changes: &'a [Written<'a>],
}

/// What came of reading.
pub(super) struct Read {
    pub(super) result: Result<Configuration, Report>,
    /// The files that were read, also those that could not be.
    pub(super) files: Files,
    /// What each of the changes says, when all can be read.
    pub(super) changes: Vec<Table>,
}

/// Reads a configuration; files that are known already are not read again.
pub(super) fn read(request: &Request<'_>, files: Files) -> Read {
    let Request { main, options, waiting, changes } = request;
    let mut layers = Layers::default();
    layers.files = files;
    layers.defaults();
    layers.sets(SourceKind::Default, options.defaults.iter().map(|text| Written { text, equals: None }));
    let main_source = layers.sources.0.len();
    match main {
        Main::File(path) => layers.file(path, None),
        Main::Text { name, text } => layers.text(name.clone(), SourceKind::File, None, Arc::clone(text)),
    }
    if let Some(host) = &options.host {
        layers.file(host, None);
    }
    let of_files = layers.merged.clone();
    layers.sets(SourceKind::Set, options.sets.iter().map(|text| Written { text, equals: None }));
    layers.flat_sets.clear();
    layers.hold(waiting);
    layers.sets(SourceKind::Change, changes.iter().copied());
    let files = std::mem::take(&mut layers.files);
    let changes = std::mem::take(&mut layers.flat_sets);
    Read { result: build(layers, of_files, options, main_source), files, changes }
}

fn build(
    layers: Layers,
    mut files: Table,
    options: &Options,
    main_source: usize,
) -> Result<Configuration, Report> {
    let Layers { sources, mut problems, mut merged, incomplete, .. } = layers;
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
    let snapshot = build.snapshot(&merged);
    let name = agent.as_ref().map_or("", |agent| agent.name.as_str());
    let share = build.share(&merged, name);
    let plugins = build.plugins(&merged);
    let mut modules = build.modules(&merged);
    let mut links = build.links(&merged, name);
    build.links_or_values(&mut modules, &mut links);
    let actuators = build.actuators(&merged, name);
    match (agent, log) {
        (Some(agent), Some(log)) if problems.0.is_empty() => {
            settle(&mut merged, &sources);
            settle(&mut files, &sources);
            Ok(Configuration {
                sources,
                files,
                merged,
                agent,
                time_source,
                mission,
                snapshot,
                plugins,
                log,
                share,
                modules,
                links,
                actuators,
            })
        }
        _ => Err(report(&sources, problems)),
    }
}
