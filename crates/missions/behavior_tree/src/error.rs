//! Errors of behaviour trees.

use std::path::{Path, PathBuf};

/// A behaviour tree, or a file of one, that is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{reason}", place(.file, *.line))]
pub struct TreeError {
    file: Option<PathBuf>,
    /// From 1.
    line: Option<usize>,
    reason: String,
}

impl TreeError {
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
}

fn place(file: &Option<PathBuf>, line: Option<usize>) -> String {
    match (file, line) {
        (Some(file), Some(line)) => format!("{}:{line}: ", file.display()),
        (Some(file), None) => format!("{}: ", file.display()),
        (None, Some(line)) => format!("line {line}: "),
        (None, None) => String::new(),
    }
}

fn node_place(file: &Option<PathBuf>, line: usize) -> String {
    match file {
        Some(file) => format!("{}:{line}", file.display()),
        None => format!("line {line}"),
    }
}

/// A tick that can't be made, because of what the blackboard or the host has.
///
/// The tree has been halted, and begins anew with the next tick.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("node `{path}` ({}): {reason}", node_place(.file, *.line))]
pub struct TickError {
    /// Path of the node, such as `patrol/2 GoTo`.
    pub path: String,
    /// Its file, if the tree's file includes that.
    pub file: Option<PathBuf>,
    /// Its line in the file, from 1.
    pub line: usize,
    /// Defect, and what was expected.
    pub reason: String,
}

/// A state that does not fit into a tree.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the state of the run doesn't fit into the tree: {0}; restart the tree, or keep that node")]
pub struct TreeStateError(pub(crate) String);
