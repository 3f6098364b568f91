use slate_device_line::simulated::TerminalError;
use slate_sim::world::DescriptionError;

/// Error of starting a controller.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    /// World or robot don't fit.
    #[error(transparent)]
    World(#[from] DescriptionError),
    /// No pseudo-terminal is available.
    #[error(transparent)]
    Terminal(#[from] TerminalError),
    /// The system can't start a thread.
    #[error("no thread: {0}")]
    Thread(#[from] std::io::Error),
    /// Without a link, a driver can't find a new terminal.
    #[error("without a link, no driver finds the new terminal: start the controller with one")]
    Unlinked,
}
