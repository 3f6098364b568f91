use slate_runtime::configuration::{Configuration, Diagnostic, Report, Span};

/// Reason why an agent is not on its network.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// Failure to listen at an endpoint.
    #[error("`{endpoint}` can't be listened at: {reason}")]
    Listen {
        /// Endpoint.
        endpoint: String,
        /// Reason, in words.
        reason: String,
        /// Place in the configuration.
        place: Option<Span>,
    },
    /// No router is reached.
    #[error("no router is reached at {endpoints}: {reason}")]
    Connect {
        /// Endpoints.
        endpoints: String,
        /// Reason, in words.
        reason: String,
        /// Place of the first one.
        place: Option<Span>,
    },
    /// An input can't read from the network.
    #[error("/{input} can't read from the network: {reason}")]
    Input {
        /// Path.
        input: String,
        /// Reason, in words.
        reason: String,
        /// Advice.
        help: &'static str,
        /// Place in the configuration.
        place: Option<Span>,
    },
    /// A property can't be published at a key.
    #[error("/{property} can't be published at `{key}`: {reason}")]
    Output {
        /// Path.
        property: String,
        /// Key.
        key: String,
        /// Reason, in words.
        reason: String,
        /// Advice.
        help: &'static str,
        /// Place in the configuration.
        place: Option<Span>,
    },
    /// The agent takes no part in a team.
    #[error("facts of the team can't travel over the network: the agent takes no part in a team")]
    Team {
        /// Place in the configuration.
        place: Option<Span>,
    },
    /// Certificates can't be used.
    #[error("{reason}")]
    Security {
        /// Reason, in words.
        reason: String,
        /// Advice.
        help: String,
        /// Place of the file in the configuration.
        place: Option<Span>,
    },
    /// Zenoh refuses.
    #[error("the network can't be used: {0}")]
    Session(String),
    /// No thread or descriptor is left.
    #[error("the network can't be used: {0}")]
    System(#[from] std::io::Error),
}

impl NetworkError {
    /// Returns the help.
    pub fn help(&self) -> &str {
        match self {
            Self::Listen { .. } => "take another port, or end the program that has it: ss -ltnup",
            Self::Connect { .. } => {
                "start the router first: a Zenoh router, or an agent with mode = \"router\"; a peer waits for it"
            }
            Self::Input { help, .. } | Self::Output { help, .. } => help,
            Self::Team { .. } => "add [share.knowledge], or take `team` away",
            Self::Security { help, .. } => help,
            Self::Session(_) | Self::System(_) => "see the log",
        }
    }

    /// Returns the error with file, line and help.
    /// `configuration` must be the one that the settings came from.
    pub fn report(&self, configuration: &Configuration) -> Report {
        let help = Some(self.help().to_owned());
        let place = match self {
            Self::Listen { place, .. }
            | Self::Connect { place, .. }
            | Self::Input { place, .. }
            | Self::Output { place, .. }
            | Self::Team { place }
            | Self::Security { place, .. } => *place,
            Self::Session(_) | Self::System(_) => None,
        };
        Report::from(match place {
            Some(span) => configuration.diagnostic(span, self.to_string(), help),
            None => Diagnostic::without_place(self.to_string(), help),
        })
    }
}
