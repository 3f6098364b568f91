use slate_runtime::configuration::{Configuration, Diagnostic, Report, Span};

/// Why an agent has no topics of ROS.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// A property does not fit its topic.
    #[error("/{property} and {topic}: {reason}")]
    Topic {
        /// Path of the property.
        property: String,
        /// The topic.
        topic: String,
        /// In words.
        reason: String,
        /// What to do.
        help: String,
        /// Where it is written.
        place: Option<Span>,
    },
    /// DDS refuses.
    #[error("DDS can't be used in domain {domain}: {reason}")]
    Network {
        /// The domain.
        domain: u16,
        /// In words.
        reason: String,
    },
    /// No thread is left.
    #[error("the bridge to ROS can't be started: {0}")]
    System(#[from] std::io::Error),
}

impl RosError {
    /// What to do about it.
    pub fn help(&self) -> &str {
        match self {
            Self::Topic { help, .. } => help,
            Self::Network { .. } => {
                "take another domain, or end programs that have its UDP ports, 7400 + 250 x domain: ss -lunp"
            }
            Self::System(_) => "end other programs, or raise the limit of threads: ulimit -u",
        }
    }

    /// The error with file, line and what to do, of the configuration that the settings came from.
    pub fn report(&self, configuration: &Configuration) -> Report {
        let help = Some(self.help().to_owned());
        Report::from(match self {
            Self::Topic { place: Some(span), .. } => configuration.diagnostic(*span, self.to_string(), help),
            _ => Diagnostic::without_place(self.to_string(), help),
        })
    }
}
