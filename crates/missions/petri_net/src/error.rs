//! Errors of nets and plans.

use std::path::{Path, PathBuf};

/// Net, or a file of one, that is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{reason}", place(.file, *.line))]
pub struct NetError {
    file: Option<PathBuf>,
    /// Line number, from 1.
    line: Option<usize>,
    reason: String,
}

impl NetError {
    pub(crate) fn new(reason: impl Into<String>) -> Self {
        Self { file: None, line: None, reason: reason.into() }
    }

    pub(crate) fn at(line: impl Into<Option<usize>>, reason: impl Into<String>) -> Self {
        Self { line: line.into(), ..Self::new(reason) }
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
}

fn place(file: &Option<PathBuf>, line: Option<usize>) -> String {
    match (file, line) {
        (Some(file), Some(line)) => format!("{}:{line}: ", file.display()),
        (Some(file), None) => format!("{}: ", file.display()),
        (None, Some(line)) => format!("line {line}: "),
        (None, None) => String::new(),
    }
}
