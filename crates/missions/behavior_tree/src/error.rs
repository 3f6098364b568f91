//! Errors of behavior trees.

use std::path::{Path, PathBuf};

/// Behavior tree, or a file of one, that is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{reason}", place(.file, *.line))]
pub struct TreeError {
    file: Option<PathBuf>,
    /// Line number, from 1.
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

/// Failure of a tick, because of a value of the blackboard or the host.
///
/// The tree has been halted, and begins anew with the next tick.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("node `{path}` ({}): {reason}", node_place(.file, *.line))]
pub struct TickError {
    /// Path of the node, such as `patrol/2 GoTo`.
    pub path: String,
    /// File of the node, if the tree's file includes that.
    pub file: Option<PathBuf>,
    /// Line in the file, from 1.
    pub line: usize,
    /// Defect and expectation.
    pub reason: String,
}

/// State that does not fit into a tree.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the state of the run doesn't fit into the tree: {0}; restart the tree, or keep that node")]
pub struct TreeStateError(pub(crate) String);
