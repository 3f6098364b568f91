use std::path::Path;

use super::super::compare::leaves;
use super::super::exclusive::counterpart;
use super::super::source::{SourceKind, Span};
use super::super::value::Value;
use super::Configuration;

/// Returns the source of the file in which a setting is changed.
/// It contains the setting, or the one that it replaces; `None` if no file contains either.
pub(super) fn home(configuration: &Configuration, path: &[String]) -> Option<usize> {
    stands(configuration, path).or_else(|| stands(configuration, &counterpart(path)?))
}

/// Returns the source of the main file.
pub(super) fn main_file(configuration: &Configuration) -> Option<usize> {
    configuration.sources().iter().position(|source| source.kind() == SourceKind::File)
}

/// Returns the source of a file by its path as given.
pub(super) fn file(configuration: &Configuration, path: &Path) -> Option<usize> {
    configuration.sources().iter().position(|source| source.path() == Some(path))
}

/// Place where a setting is written.
pub(super) struct SettingPlace<'a> {
    /// Source of the whole text.
    pub(super) text: usize,
    /// Path of its table in that text.
    pub(super) table: Vec<&'a str>,
    /// True for the place of the setting itself.
    /// False for a place that overrides it.
    pub(super) stands: bool,
}

/// Returns the place where a change of a source's setting is written.
/// It is the source, unless that would change other agents too; then it is this agent's table in the file that they
/// share.
pub(super) fn place(
    configuration: &Configuration,
    id: usize,
    is_of_others: impl Fn(&Path) -> bool,
) -> SettingPlace<'_> {
    let agent = configuration.described_as();
    let source = &configuration.sources()[id];
    let alone = agent.is_none() || (source.place.own && !source.path().is_some_and(is_of_others));
    let in_own_table = source.place.table.first().is_some_and(|first| first == "agents");
    match source.place.part_of {
        Some(text) if alone || in_own_table => {
            let table = source.place.table.iter().map(String::as_str).collect();
            SettingPlace { text, table, stands: true }
        }
        None if alone => SettingPlace { text: id, table: Vec::new(), stands: true },
        _ => {
            let table = agent.into_iter().flat_map(|agent| ["agents", agent]).collect();
            SettingPlace { text: source.place.root, table, stands: false }
        }
    }
}

fn stands(configuration: &Configuration, path: &[String]) -> Option<usize> {
    let mut table = &configuration.files;
    let mut names = path.iter();
    let span = loop {
        let value = table.get(names.next()?)?;
        match &value.value {
            Value::Table(inner) if !names.as_slice().is_empty() => table = inner,
            // An override of a whole table must stand in the last file that adds to it.
            Value::Table(inner) => {
                let mut last = value.span;
                leaves(inner, &[], &mut |_, leaf| last = later(configuration, last, leaf.span));
                break last;
            }
            _ => break value.span,
        }
    };
    (configuration.sources.of(span).kind() == SourceKind::File).then_some(span.source)
}

fn later(configuration: &Configuration, first: Span, second: Span) -> Span {
    if configuration.sources.rank(second) > configuration.sources.rank(first) { second } else { first }
}
