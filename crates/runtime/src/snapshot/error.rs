use std::path::PathBuf;
use std::time::Duration;

use slate_configuration::Report;

/// One in the same line, several in a line each, and no more than anybody reads.
fn list(problems: &[String]) -> String {
    const MOST: usize = 10;
    let mut lines: Vec<_> = problems.iter().take(MOST).cloned().collect();
    if problems.len() > MOST {
        lines.push(format!("and {} more", problems.len() - MOST));
    }
    let before = if lines.len() > 1 { "\n" } else { "" };
    format!("{before}{}", lines.join("\n"))
}

/// Why there is no snapshot, or an agent does not go on from one; the agent is as it was.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum SnapshotError {
    /// The file can't be read or written.
    #[error("snapshot {} can't be {what}: {source}", file.display())]
    #[diagnostic(help("{help}"))]
    File {
        /// The file.
        file: PathBuf,
        /// What was tried with it.
        what: &'static str,
        /// What went wrong.
        source: std::io::Error,
        /// What to do.
        help: &'static str,
    },
    /// The file is damaged, or no snapshot.
    #[error("{} is not a complete snapshot: {problem}", file.display())]
    #[diagnostic(help("take another snapshot: slate snapshot save FILE"))]
    Damaged {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// The file has another format.
    #[error("{} has version {found} of the format, this program reads version {expected}", file.display())]
    #[diagnostic(help("use the `slate` that wrote it"))]
    Version {
        /// The file.
        file: PathBuf,
        /// Its version.
        found: u64,
        /// The version that is read.
        expected: u64,
    },
    /// It is of another agent, or one that was made of other things.
    #[error("the snapshot of agent `{agent}` does not fit: {}", list(problems))]
    #[diagnostic(help("start an agent from it, with the plugins that it names: slate run --resume FILE"))]
    Unfit {
        /// The agent that it is of.
        agent: String,
        /// Everything that does not fit.
        problems: Vec<String>,
    },
    /// The agent can't have the configuration of the snapshot while it runs.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Configuration(#[from] Report),
    /// A module does not stand still.
    #[error(
        "module `{module}` has not returned from its last call{}, so the agent does not stand still",
        within(*.limit)
    )]
    #[diagnostic(help("wait until it returns and try again, or take its plugin out"))]
    Busy {
        /// The module.
        module: String,
        /// How long was waited, if at all.
        limit: Duration,
    },
    /// A module's state can't be saved.
    #[error("module `{module}` can't be saved: {reason}")]
    #[diagnostic(help("mend its state, which must be one that serde writes"))]
    Save {
        /// The module.
        module: String,
        /// Why.
        reason: String,
    },
    /// New code runs beside a plugin.
    #[error("new code runs beside plugin `{plugin}`, which is no part of a snapshot")]
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
    #[error("thread `{thread}` of module `{module}` has not ended within {limit:?} of being told to stop")]
    #[diagnostic(help("wait until it ends and try again"))]
    Thread {
        /// The module.
        module: String,
        /// Its thread.
        thread: String,
        /// How long was waited.
        limit: Duration,
    },
}

fn within(limit: Duration) -> String {
    if limit.is_zero() { String::new() } else { format!(" within {limit:?}") }
}
