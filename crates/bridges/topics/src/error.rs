use slate_runtime::configuration::{Configuration, Diagnostic, Report};

use crate::mismatch::TopicMismatch;

/// Reason why an agent is no ROS node.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// A property does not fit its topic.
    #[error(transparent)]
    Topic(#[from] Box<TopicMismatch>),
    /// Refusal of the middleware, or an unreachable one.
    #[error("{network}: {reason}")]
    Network {
        /// Middleware and its address.
        network: String,
        /// Reason, in words.
        reason: String,
        /// Advice.
        help: &'static str,
    },
    /// Name or a definition that can't be offered.
    #[error("`{name}` can't be offered: {reason}")]
    Definition {
        /// Topic, service or message.
        name: String,
        /// Reason, in words.
        reason: String,
        /// Advice.
        help: &'static str,
    },
    /// The agent has no time of its own.
    #[error(
        "/clock can't be published: the agent goes by the system's clock, and /clock is the time of a simulation"
    )]
    Clock,
    /// No thread is left.
    #[error("the bridge to ROS can't be started: {0}")]
    System(#[from] std::io::Error),
}

impl RosError {
    /// Creates the error of a definition that can't be offered.
    pub fn definition(name: &str, reason: String) -> Self {
        let help = "write each message in it, too, behind a line of = and MSG: package/Name";
        Self::Definition { name: name.into(), reason, help }
    }

    /// Returns the help that resolves it.
    pub fn help(&self) -> &str {
        match self {
            Self::Topic(mismatch) => mismatch.help,
            Self::Network { help, .. } | Self::Definition { help, .. } => help,
            Self::Clock => {
                "give the agent a time source, such as [time] source = \"simulator\"; or take clock = true away"
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
