//! Errors of behaviors.

use std::path::{Path, PathBuf};

/// Skill file that is refused, or a tick that can't be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{reason}", place(.file, *.line))]
pub struct BehaviorError {
    file: Option<PathBuf>,
    /// Line number, from 1.
    line: Option<usize>,
    reason: String,
}

impl BehaviorError {
    pub(crate) fn new(reason: impl Into<String>) -> Self {
        Self { file: None, line: None, reason: reason.into() }
    }

    pub(crate) fn at(line: usize, reason: impl Into<String>) -> Self {
        Self { line: Some(line), ..Self::new(reason) }
    }

    /// Names the file, unless one is named.
    pub fn of_file(mut self, file: &Path) -> Self {
        self.file.get_or_insert_with(|| file.into());
        self
    }

    /// Returns the line in the file, from 1.
    pub fn line(&self) -> Option<usize> {
        self.line
    }

    /// Returns the defect, without the place.
    pub fn reason(&self) -> &str {
        &self.reason
    }
}

fn place(file: &Option<PathBuf>, line: Option<usize>) -> String {
    match (file, line) {
        (Some(file), Some(line)) => format!("{}:{line}: ", file.display()),
        (Some(file), None) => format!("{}: ", file.display()),
        (None, Some(line)) => format!("line {line}: "),
        (None, None) => String::new(),
    }
}
