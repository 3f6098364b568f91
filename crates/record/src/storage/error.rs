use std::io;
use std::path::PathBuf;

/// Why a file can't be read, or not be written.
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
    /// It is not what the format says, or a checksum does not fit.
    #[error("`{}` is damaged at byte {offset}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where the record begins that is wrong.
        offset: u64,
        /// Reason.
        what: String,
    },
    /// A line of a log is not what its system writes.
    #[error("`{}`, line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// Found and expected.
        what: String,
    },
    /// It is no such file at all.
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
    /// A picture could not be drawn.
    #[error(transparent)]
    Draw(#[from] crate::Error),
}
