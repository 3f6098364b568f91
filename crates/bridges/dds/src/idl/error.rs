/// Error in an IDL file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}: {reason}")]
pub struct IdlError {
    /// File.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Reason, in words.
    pub reason: String,
}
