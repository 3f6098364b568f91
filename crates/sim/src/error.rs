//! Errors of descriptions, with their places.

use std::ops::Range;

use slate_module::blackboard::nearest_names;
use toml_edit::{Document, Item, Key};

/// Error of an invalid description of a world or a robot.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{source_name}{}: {message}", place(.position))]
pub struct DescriptionError {
    /// File of the description.
    pub source_name: String,
    /// Error and expectation.
    pub message: String,
    /// Byte range of the error in the file, if known.
    pub span: Option<Range<usize>>,
    /// Line and column of the error, both from 1.
    pub position: Option<(usize, usize)>,
}

fn place(position: &Option<(usize, usize)>) -> String {
    position.map_or_else(String::new, |(line, column)| format!(", line {line}, column {column}"))
}

impl DescriptionError {
    pub(crate) fn new(source_name: &str, message: impl Into<String>) -> Self {
        Self { source_name: source_name.into(), message: message.into(), span: None, position: None }
    }

    /// Creates an error at a byte range of the text.
    pub(crate) fn at(
        source_name: &str,
        text: &str,
        span: Option<Range<usize>>,
        message: impl Into<String>,
    ) -> Self {
        let before = span.as_ref().and_then(|span| text.get(..span.start));
        let position = before.map(|before| {
            let line = before.rsplit('\n').next().unwrap_or(before);
            (before.matches('\n').count() + 1, line.chars().count() + 1)
        });
        Self { source_name: source_name.into(), message: message.into(), span, position }
    }

    /// Creates an error at an element of the document.
    /// If the element is missing, the error is at its table.
    pub(crate) fn within(
        source_name: &str,
        text: &str,
        path: &[DocumentStep<'_>],
        message: impl Into<String>,
    ) -> Self {
        let document = Document::parse(text).ok();
        let mut span = None;
        let mut item = document.as_ref().map(Document::as_item);
        for step in path {
            item = item.and_then(|item| match step {
                DocumentStep::Key(key) => item.get(key),
                DocumentStep::Index(index) => item.get(index),
            });
            span = item.and_then(Item::span).or(span);
        }
        Self::at(source_name, text, span, message)
    }

    /// Prefixes the error with the setting that names the description.
    /// Such a setting is `world.arena`.
    pub(crate) fn of(self, setting: &str) -> Self {
        let source_name = match self.position {
            Some(_) => format!("{setting}: {}", self.source_name),
            None => setting.into(),
        };
        Self { source_name, ..self }
    }

    pub(crate) fn parse<T: serde::de::DeserializeOwned>(source_name: &str, text: &str) -> Result<T, Self> {
        toml_edit::de::from_str(text)
            .map_err(|error| Self::at(source_name, text, error.span(), error.message()))
    }
}

/// Returns the message for an unknown name, with the most similar known one.
pub(crate) fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    let near = nearest_names(name, known.clone()).into_iter().next();
    let near = near.map_or_else(String::new, |near| format!(" (did you mean `{near}`?)"));
    let known: Vec<_> = known.collect();
    let known = if known.is_empty() { "none, as it has none".into() } else { known.join(", ") };
    format!("unknown {what} `{name}`{near}; expected {known}")
}

/// Returns a key for a path in a configuration, quoted if needed.
pub(crate) fn key(name: &str) -> String {
    Key::new(name).display_repr().into_owned()
}

/// Step on the path to a value of a document.
#[derive(Clone, Debug)]
pub(crate) enum DocumentStep<'a> {
    Key(&'a str),
    Index(usize),
}

/// Returns the other kinds of files that may contain the description.
fn also(kind: &str) -> &'static str {
    if kind == "world" { ", or of a map.yaml" } else { "" }
}

/// Returns the text of a description by its name or path.
/// A name is that of a built-in description; a path is relative to the working directory.
pub(crate) fn text_of(
    kind: &str,
    name: &str,
    embedded: &[(&str, &'static str)],
) -> Result<(String, String), DescriptionError> {
    if let Some((name, text)) = embedded.iter().find(|(known, _)| *known == name) {
        return Ok((format!("{kind}s/{name}.toml"), (*text).into()));
    }
    if !name.ends_with(".toml") {
        let message = unknown(kind, name, embedded.iter().map(|(name, _)| *name));
        return Err(DescriptionError::new(
            name,
            format!("{message}, or the path of a .toml file{}", also(kind)),
        ));
    }
    let text = std::fs::read_to_string(name).map_err(|error| {
        let tried = std::path::absolute(name).unwrap_or_else(|_| name.into());
        DescriptionError::new(name, format!("can't read {}: {error}", tried.display()))
    })?;
    Ok((name.into(), text))
}
