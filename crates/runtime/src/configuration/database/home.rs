use std::path::Path;

use super::super::compare::leaves;
use super::super::exclusive::counterpart;
use super::super::source::{SourceKind, Span};
use super::super::value::Value;
use super::Configuration;

/// The source of the file that a setting is changed in: where it stands, or what it takes the place of; nothing if no
/// file has either.
pub(super) fn home(configuration: &Configuration, path: &[String]) -> Option<usize> {
    stands(configuration, path).or_else(|| stands(configuration, &counterpart(path)?))
}

/// The source of the main file.
pub(super) fn main_file(configuration: &Configuration) -> Option<usize> {
    configuration.sources().iter().position(|source| source.kind() == SourceKind::File)
}

/// The source of a file by its path as given.
pub(super) fn file(configuration: &Configuration, path: &Path) -> Option<usize> {
    configuration.sources().iter().position(|source| source.path() == Some(path))
}

fn stands(configuration: &Configuration, path: &[String]) -> Option<usize> {
    let mut table = &configuration.files;
    let mut names = path.iter();
    let span = loop {
        let value = table.get(names.next()?)?;
        match &value.value {
            Value::Table(inner) if !names.as_slice().is_empty() => table = inner,
            // What overrides a whole table must stand in the last file that adds to it.
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
