use std::path::PathBuf;

use miette::Diagnostic;
use slate_control::OpenError;
use slate_mapek::RobotErrors;
use slate_runtime::configuration::Report;
use slate_runtime::memory::MemoryError;
use slate_runtime::snapshot::SnapshotError;
use slate_runtime::{ErrorCode, StartError};

use crate::PrintedError;

/// Reason why a run fails.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The configuration is invalid.
    #[error("{0}")]
    Configuration(#[from] Report),
    /// The robot of a program is invalid.
    #[error("{0}")]
    Robot(#[from] RobotErrors),
    /// The agent can't start.
    #[error("{0}")]
    Start(StartError),
    /// The report can't be written.
    #[error("{0}")]
    Report(#[from] slate_report::Error),
    /// The recording is incomplete.
    #[error("{0}")]
    Record(#[from] slate_record::RecordError),
    /// The web console can't start.
    #[cfg(feature = "console")]
    #[error("{0}")]
    Console(#[from] slate_console::StartError),
    /// The world is invalid.
    #[error("{0}")]
    World(String),
    /// The pace is that of a simulator, and none drives the clock.
    #[error("`--rate` needs a simulator: this agent runs on the wall clock")]
    WallClock,
    /// Tools can't reach the agent.
    #[error("{0}")]
    Unreachable(OpenError),
    /// The snapshot can't be restored.
    #[error("{0}")]
    Snapshot(SnapshotError),
    /// The memory of modules can't be written.
    #[error("{0}")]
    Memory(#[from] MemoryError),
    /// The folder of the report can't be made or opened.
    #[error("{} can't be used as a folder: {source}", slate_runtime::printable(.path))]
    Folder {
        /// Folder.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// Conflict: another run writes into the folder of the report.
    #[error("another run is writing its report into {}", slate_runtime::printable(.path))]
    FolderInUse {
        /// Folder.
        path: PathBuf,
    },
    /// A file or folder can't be used.
    #[error("`{path}` can't be used: {source}")]
    File {
        /// File.
        path: PathBuf,
        /// System's reason.
        source: std::io::Error,
    },
}

impl From<StartError> for RunError {
    fn from(error: StartError) -> Self {
        match error {
            StartError::Configuration(report) => Self::Configuration(report),
            other => Self::Start(other),
        }
    }
}

impl From<SnapshotError> for RunError {
    fn from(error: SnapshotError) -> Self {
        match error {
            SnapshotError::Configuration(report) => Self::Configuration(report),
            other => Self::Snapshot(other),
        }
    }
}

impl RunError {
    /// Exit code of a run that fails.
    pub const EXIT: u8 = 2;

    /// Returns the help, if any.
    pub fn help(&self) -> Option<String> {
        Some(match self {
            Self::Start(error) => error.help()?.to_string(),
            Self::Snapshot(error) => error.help()?.to_string(),
            Self::Memory(error) => error.help()?.to_string(),
            Self::Unreachable(error) => error.help()?.to_string(),
            #[cfg(feature = "console")]
            Self::Console(error) => error.help()?.to_string(),
            Self::WallClock => {
                "omit `--rate`, or give the configuration a time source (`time.source`)".into()
            }
            Self::Folder { .. } => "name another folder with --out; it is made if it is missing".into(),
            Self::FolderInUse { .. } => {
                "choose another folder with --out, or wait until that run has ended".into()
            }
            _ => return None,
        })
    }

    /// Returns the error code that `slate explain` describes, if it has one.
    pub fn error_code(&self) -> Option<ErrorCode> {
        match self {
            Self::Configuration(report) => report.error_code(),
            _ => None,
        }
    }

    /// Prints the error to stderr: message, place and help.
    pub fn print(&self) {
        let report = match self {
            Self::Configuration(report) => Some(report),
            _ => None,
        };
        let (message, help, error_code) = (self.to_string(), self.help(), self.error_code());
        PrintedError { message, help, error_code, exit: Self::EXIT, report }.print();
    }
}
