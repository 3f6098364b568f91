use slate_runtime::configuration::{Configuration, Diagnostic, Report};
use slate_topics::TopicMisfit;

/// Why an agent has no topics of ROS 1.
#[derive(Debug, thiserror::Error)]
pub enum Ros1Error {
    /// A property does not fit its topic.
    #[error(transparent)]
    Topic(#[from] Box<TopicMisfit>),
    /// The master refuses, or is not reached.
    #[error("the master of ROS at {master}: {reason}")]
    Master {
        /// Its address.
        master: String,
        /// In words.
        reason: String,
    },
    /// A definition that can't be offered.
    #[error("`{name}` can't be offered: {reason}")]
    Definition {
        /// The topic or service.
        name: String,
        /// In words.
        reason: String,
    },
    /// The agent has no time of its own.
    #[error("/clock can't be published: {reason}")]
    Clock {
        /// In words.
        reason: String,
    },
    /// No thread is left.
    #[error("the bridge to ROS 1 can't be started: {0}")]
    System(#[from] std::io::Error),
}

impl Ros1Error {
    /// A definition that can't be offered.
    #[cfg(feature = "tcpros")]
    pub(crate) fn definition(name: &str, reason: String) -> Self {
        Self::Definition { name: name.into(), reason }
    }

    /// The advice that resolves it.
    pub fn help(&self) -> &str {
        match self {
            Self::Topic(misfit) => misfit.help,
            Self::Master { .. } => {
                "start it with roscore, or name another one: [ros1] master = \"http://HOST:11311\""
            }
            Self::Definition { .. } => {
                "write each message in it, too, behind a line of = and MSG: package/Name"
            }
            Self::Clock { .. } => {
                "give the agent a time source, such as [time] source = \"simulator\"; or take clock = true away"
            }
            Self::System(_) => "end other programs, or raise the limit of threads: ulimit -u",
        }
    }

    /// The error with file, line and what to do, of the configuration that the settings came from.
    pub fn report(&self, configuration: &Configuration) -> Report {
        match self {
            Self::Topic(misfit) => misfit.report(configuration),
            _ => Report::from(Diagnostic::without_place(self.to_string(), Some(self.help().to_owned()))),
        }
    }
}
