/// What is wrong with a file of IDL.
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
