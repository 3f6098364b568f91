use std::path::PathBuf;

use slate_sim::world::DescriptionError;

/// Error of starting a controller.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    /// World or robot don't fit.
    #[error(transparent)]
    World(#[from] DescriptionError),
    /// The system gives no pseudo-terminal, or no thread.
    #[error("no pseudo-terminal: {0}")]
    Terminal(#[from] std::io::Error),
    /// The link can't be made.
    #[error("{}: {error}; expected a path where there is nothing, or an older link", .path.display())]
    Link {
        /// Where it should be.
        path: PathBuf,
        /// Error of the system.
        error: std::io::Error,
    },
    /// Without a link, a driver can't find a new terminal.
    #[error("without a link, no driver finds the new terminal: start the controller with one")]
    Unlinked,
}
