//! Errors in the source of an interface.

/// Error in a source file, with its line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SyntaxError {
    pub line: usize,
    pub message: String,
}
