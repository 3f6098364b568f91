//! Errors of data.

use std::io;
use std::path::{Path, PathBuf};

use slate_slam::carmen::LaserLogError;

/// Data that can't be used.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", place(.file, *.line))]
pub struct DataError {
    file: PathBuf,
    /// Line number, from 1.
    line: Option<usize>,
    reason: String,
}

impl DataError {
    pub(crate) fn new(file: &Path, reason: impl Into<String>) -> Self {
        Self { file: file.into(), line: None, reason: reason.into() }
    }

    /// Returns the error at a line, counted from 0.
    pub(crate) fn at(file: &Path, line: usize, reason: impl Into<String>) -> Self {
        Self { file: file.into(), line: Some(line + 1), reason: reason.into() }
    }

    pub(crate) fn unreadable(file: &Path, error: &io::Error) -> Self {
        Self::new(file, format!("can't be read: {error}"))
    }
}

impl From<LaserLogError> for DataError {
    fn from(error: LaserLogError) -> Self {
        match error {
            LaserLogError::Unreadable { file, source } => Self::unreadable(&file, &source),
            LaserLogError::Line { ref file, line } => {
                Self::at(file, line - 1, "expected CARMEN's `ODOM` or `FLASER` with its columns")
            }
            LaserLogError::Empty { ref file } => Self::new(file, "expected lines `ODOM` and `FLASER`"),
        }
    }
}

fn place(file: &Path, line: Option<usize>) -> String {
    match line {
        Some(line) => format!("{}:{line}", file.display()),
        None => file.display().to_string(),
    }
}
