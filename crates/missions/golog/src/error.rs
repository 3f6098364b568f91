//! Errors of theories and of their execution.

use std::fmt::Write;
use std::path::{Path, PathBuf};

/// File of a theory that is refused, with its place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{reason}{}", place(.file, *.line, *.column), help_text(.help))]
pub struct GologError {
    file: Option<PathBuf>,
    /// Line number, from 1; 0 without a place.
    line: usize,
    /// Column, from 1, in characters.
    column: usize,
    /// Number of marked characters.
    width: usize,
    /// Text of the line.
    excerpt: String,
    reason: String,
    help: Option<String>,
}

impl GologError {
    pub(crate) fn new(reason: impl Into<String>) -> Self {
        let (file, help, excerpt) = (None, None, String::new());
        Self { file, line: 0, column: 0, width: 0, excerpt, reason: reason.into(), help }
    }

    /// Returns an error at a range of bytes of a text.
    pub(crate) fn at(text: &str, start: usize, end: usize, reason: impl Into<String>) -> Self {
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let excerpt = text[line_start..].lines().next().unwrap_or_default();
        let end = end.clamp(start, line_start + excerpt.len().max(start - line_start));
        Self {
            line: text[..start].matches('\n').count() + 1,
            column: text[line_start..start].chars().count() + 1,
            width: text[start..end].chars().count().max(1),
            excerpt: excerpt.into(),
            ..Self::new(reason)
        }
    }

    pub(crate) fn with_help(mut self, help: Option<String>) -> Self {
        self.help = help;
        self
    }

    /// Names the file, unless one is named.
    pub fn of_file(mut self, file: &Path) -> Self {
        self.file.get_or_insert_with(|| file.into());
        self
    }

    /// Returns the line in the file, from 1; `None` for an error without a place.
    pub fn line(&self) -> Option<usize> {
        (self.line > 0).then_some(self.line)
    }

    /// Returns the error for a terminal: place, line with a caret, and help.
    pub fn render(&self) -> String {
        let mut text = format!("{}{}", place(&self.file, self.line, self.column), self.reason);
        if self.line > 0 {
            // Writing into a string can't fail.
            let _ = write!(text, "\n{:5} | {}\n      | ", self.line, self.excerpt.replace('\t', " "));
            text.extend(std::iter::repeat_n(' ', self.column - 1));
            text.extend(std::iter::repeat_n('^', self.width));
        }
        if let Some(help) = &self.help {
            let _ = write!(text, "\n      = {help}");
        }
        text
    }
}

fn place(file: &Option<PathBuf>, line: usize, column: usize) -> String {
    match (file, line) {
        (Some(file), 0) => format!("{}: ", file.display()),
        (Some(file), line) => format!("{}:{line}:{column}: ", file.display()),
        (None, 0) => String::new(),
        (None, line) => format!("line {line}, column {column}: "),
    }
}

fn help_text(help: &Option<String>) -> String {
    help.as_ref().map_or(String::new(), |help| format!("; {help}"))
}

/// Failure of a program.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct GologRunError {
    /// Line in the file, from 1.
    pub line: usize,
    /// Defect and expectation.
    pub reason: String,
}

/// State that does not fit into a theory.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the state of the run doesn't fit into the theory: {0}; restart the mission, or keep that part")]
pub struct GologStateError(pub(crate) String);
