use std::io;
use std::path::PathBuf;

/// Error of reading or writing a file.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system does not let it be read.
    #[error("`{}` can't be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The operating system does not let it be written.
    #[error("`{}` can't be written: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The file violates its format, or a checksum is wrong.
    #[error("`{}` is damaged at byte {offset}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Offset of the invalid record.
        offset: u64,
        /// Reason.
        what: String,
    },
    /// A line of a log is invalid.
    #[error("`{}`, line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// Found and expected.
        what: String,
    },
    /// The file has another format.
    #[error("`{}` is not an MCAP file: {what}", path.display())]
    NoBag {
        /// The file.
        path: PathBuf,
        /// Found instead.
        what: String,
    },
    /// The request does not fit the content of the file.
    #[error("`{}`: {what}", path.display())]
    Unfit {
        /// The file.
        path: PathBuf,
        /// Reason, and the alternatives.
        what: String,
    },
}
