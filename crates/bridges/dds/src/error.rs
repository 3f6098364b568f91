use slate_runtime::configuration::{Configuration, Diagnostic, Report};
use slate_topics::TopicMismatch;

/// Reason why an agent has no DDS topics.
#[derive(Debug, thiserror::Error)]
pub enum DdsError {
    /// A property does not fit its topic.
    #[error(transparent)]
    Topic(#[from] Box<TopicMismatch>),
    /// DDS refuses.
    #[error("DDS can't be used in domain {domain}: {reason}")]
    Network {
        /// Domain.
        domain: u16,
        /// Reason, in words.
        reason: String,
    },
    /// No thread is left.
    #[error("the bridge to DDS can't be started: {0}")]
    System(#[from] std::io::Error),
}

impl DdsError {
    /// Returns the help that resolves it.
    pub fn help(&self) -> &str {
        match self {
            Self::Topic(mismatch) => mismatch.help,
            Self::Network { .. } => {
                "take another domain, or end programs that have its UDP ports, 7400 + 250 x domain: ss -lunp"
            }
            Self::System(_) => "end other programs, or raise the limit of threads: ulimit -u",
        }
    }

    /// Returns the error with file, line and help.
    /// `configuration` must be the one that the settings came from.
    pub fn report(&self, configuration: &Configuration) -> Report {
        match self {
            Self::Topic(mismatch) => mismatch.report(configuration),
            _ => Report::from(Diagnostic::without_place(self.to_string(), Some(self.help().to_owned()))),
        }
    }
}
