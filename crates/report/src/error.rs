use std::{io, path::PathBuf};

/// Error of making a report.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The directory or a file of the report could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The directory or file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A plot could not be drawn.
    #[error("cannot draw the plot: {0}")]
    Draw(String),
    /// A recording could not be read, or does not have what is asked for.
    #[error(transparent)]
    Recording(#[from] slate_bag::Error),
    /// A value could not be written as JSON.
    #[error("cannot write as JSON: {0}")]
    Json(#[from] serde_json::Error),
}
