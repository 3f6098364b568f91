//! Errors of map files.

use std::io;
use std::path::{Path, PathBuf};

/// Map file that can't be read or written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", place(.file, *.line))]
pub struct MapFileError {
    file: PathBuf,
    /// Line number, from 1.
    line: Option<usize>,
    reason: String,
}

impl MapFileError {
    pub(crate) fn new(file: &Path, reason: impl Into<String>) -> Self {
        Self { file: file.into(), line: None, reason: reason.into() }
    }

    /// Returns the error at a line, counted from 1.
    pub(crate) fn at(file: &Path, line: usize, reason: impl Into<String>) -> Self {
        Self { file: file.into(), line: Some(line), reason: reason.into() }
    }

    pub(crate) fn unreadable(file: &Path, error: &io::Error) -> Self {
        Self::new(file, format!("can't be read: {error}"))
    }

    pub(crate) fn unwritable(file: &Path, error: impl std::fmt::Display) -> Self {
        Self::new(file, format!("can't be written: {error}"))
    }
}

fn place(file: &Path, line: Option<usize>) -> String {
    match line {
        Some(line) => format!("{}:{line}", file.display()),
        None => file.display().to_string(),
    }
}
