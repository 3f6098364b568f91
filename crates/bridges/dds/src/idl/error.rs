/// Mistake in an IDL file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}: {reason}")]
pub struct IdlError {
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: usize,
    /// In words.
    pub reason: String,
}
