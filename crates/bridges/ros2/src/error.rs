use slate_runtime::configuration::{Configuration, Diagnostic, Report, Span};

/// A property that does not fit its topic.
#[derive(Debug, thiserror::Error)]
#[error("/{property} and {topic}: {reason}")]
pub struct TopicMisfit {
    /// Path of the property.
    pub property: String,
    /// The topic.
    pub topic: String,
    /// In words.
    pub reason: String,
    /// What to do.
    pub help: &'static str,
    /// Where it is written.
    pub place: Option<Span>,
}

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
        /// What it is.
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

    /// What to do about it.
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
        let help = Some(self.help().to_owned());
        let place = if let Self::Topic(misfit) = self { misfit.place } else { None };
        Report::from(match place {
            Some(span) => configuration.diagnostic(span, self.to_string(), help),
            None => Diagnostic::without_place(self.to_string(), help),
        })
    }
}
