use std::io::IsTerminal;
use std::path::PathBuf;

use slate::runtime::StartError;
use slate::runtime::configuration::Report;

use crate::arguments::MAXIMUM_SEED;

/// Why a command can't do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    #[error("no example and no file is called `{name}`")]
    Unknown { name: String, help: String },
    #[error("the last seed of the batch is greater than {MAXIMUM_SEED}")]
    Seeds,
    #[error("{0}")]
    Configuration(#[from] Report),
    #[error("{0}")]
    Start(StartError),
    #[error("{0}")]
    Report(#[from] slate::record::Error),
    #[error("{0}")]
    World(String),
    #[error("`{path}` can't be used: {source}")]
    File { path: PathBuf, source: std::io::Error },
}

impl From<StartError> for Failure {
    fn from(error: StartError) -> Self {
        match error {
            StartError::Configuration(report) => Self::Configuration(report),
            other => Self::Start(other),
        }
    }
}

impl Failure {
    /// Says on stderr what is wrong, where, and what to do.
    pub fn print(&self) {
        let colour = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        match self {
            Self::Configuration(report) => eprint!("{}", report.render(colour)),
            Self::Unknown { help, .. } => eprintln!("error: {self}\n  help: {help}"),
            Self::Start(error) => {
                eprintln!("error: {error}");
                if let Some(help) = miette::Diagnostic::help(error) {
                    eprintln!("  help: {help}");
                }
            }
            other => eprintln!("error: {other}"),
        }
    }
}
