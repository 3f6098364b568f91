use std::path::PathBuf;
use std::time::Duration;

use slate_configuration::Report;

/// Formats one problem in the same line, several in a line each, ten at most.
fn list(problems: &[String]) -> String {
    const MAX_PROBLEMS: usize = 10;
    let mut lines: Vec<_> = problems.iter().take(MAX_PROBLEMS).cloned().collect();
    if problems.len() > MAX_PROBLEMS {
        lines.push(format!("and {} more", problems.len() - MAX_PROBLEMS));
    }
    let before = if lines.len() > 1 { "\n" } else { "" };
    format!("{before}{}", lines.join("\n"))
}

/// Error of taking or restoring a snapshot; the agent is unchanged.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum SnapshotError {
    /// The file can't be read or written.
    #[error("snapshot {} can't be {what}: {source}", file.display())]
    #[diagnostic(help("{help}"))]
    File {
        /// The file.
        file: PathBuf,
        /// Operation that failed.
        what: &'static str,
        /// Cause.
        source: std::io::Error,
        /// Remedy.
        help: &'static str,
    },
    /// The file is damaged, or no snapshot.
    #[error("{} is not a complete snapshot: {problem}", file.display())]
    #[diagnostic(help("take another snapshot: slate snapshot save FILE"))]
    Damaged {
        /// The file.
        file: PathBuf,
        /// Problem.
        problem: String,
    },
    /// The file has another format.
    #[error("{} has version {found} of the format, this program reads version {expected}", file.display())]
    #[diagnostic(help("use the `slate` that wrote it"))]
    Version {
        /// The file.
        file: PathBuf,
        /// Version.
        found: u64,
        /// The version that is read.
        expected: u64,
    },
    /// Snapshot of another agent, or of one with another composition.
    #[error("the snapshot of agent `{agent}` does not fit: {}", list(problems))]
    #[diagnostic(help("start an agent from it, with the plugins that it names: slate run --resume FILE"))]
    Unfit {
        /// Agent of the snapshot.
        agent: String,
        /// All mismatches.
        problems: Vec<String>,
    },
    /// Configuration that the agent can't have while it runs.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Configuration(#[from] Report),
    /// A module has not returned from its last call.
    #[error(
        "module `{module}` has not returned from its last call{}, so the agent does not stand still",
        within(*.limit)
    )]
    #[diagnostic(help("wait until it returns and try again, or take its plugin out"))]
    Busy {
        /// The module.
        module: String,
        /// Time waited; 0 if the call does not wait.
        limit: Duration,
    },
    /// A module's state can't be saved.
    #[error("module `{module}` can't be saved: {reason}")]
    #[diagnostic(help("mend its state, which must be one that serde writes"))]
    Save {
        /// The module.
        module: String,
        /// Reason.
        reason: String,
    },
    /// Shadow beside a plugin.
    #[error("new code runs beside plugin `{plugin}`, which is not part of a snapshot")]
    #[diagnostic(help("end it first: slate plugin shadow {plugin} --end"))]
    Shadow {
        /// The plugin.
        plugin: String,
    },
    /// A property has no memory left for a copy.
    #[error("{0}")]
    #[diagnostic(help("give the property room for another reader"))]
    Property(#[from] slate_blackboard::BoardError),
    /// A thread of a module does not stop.
    #[error("thread `{thread}` of module `{module}` has not ended within {limit:?} after the stop request")]
    #[diagnostic(help("wait until it ends and try again"))]
    Thread {
        /// The module.
        module: String,
        /// Thread.
        thread: String,
        /// Time waited.
        limit: Duration,
    },
}

fn within(limit: Duration) -> String {
    if limit.is_zero() { String::new() } else { format!(" within {limit:?}") }
}
