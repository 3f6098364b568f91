use slate_runtime::configuration::{Configuration, Diagnostic, Report};
use slate_topics::TopicMisfit;

/// Why an agent has no topics of ROS.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// A property does not fit its topic.
    #[error(transparent)]
    Topic(#[from] Box<TopicMisfit>),
    /// DDS refuses.
    #[error("DDS can't be used in domain {domain}: {reason}")]
    Network {
        /// The domain.
        domain: u16,
        /// In words.
        reason: String,
    },
    /// A name that ROS forbids.
    #[error("`{name}` can't be offered: {reason}")]
    Name {
        /// The name.
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
    #[error("the bridge to ROS can't be started: {0}")]
    System(#[from] std::io::Error),
}

impl RosError {
    /// A name that ROS forbids.
    #[cfg(feature = "dds")]
    pub(crate) fn name(name: &str, reason: String) -> Self {
        Self::Name { name: name.into(), reason }
    }

    /// The advice that resolves it.
    pub fn help(&self) -> &str {
        match self {
            Self::Topic(misfit) => misfit.help,
            Self::Network { .. } => {
                "take another domain, or end programs that have its UDP ports, 7400 + 250 x domain: ss -lunp"
            }
            Self::Name { .. } => "take a shorter name for the node: node = \"r2\" in [ros2]",
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
