use slate_configuration::TEAM;

/// A property of another agent, or a field of one, or a mailbox, as a link names it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RemotePath {
    /// The other agent.
    pub agent: String,
    /// The path in it.
    pub path: String,
}

impl RemotePath {
    /// The path on this agent's board of what stands for it: `team/TOPIC` for what the team knows, and
    /// `agents/AGENT/PROPERTY` for all else.
    pub fn place(&self) -> String {
        if self.agent == TEAM {
            return format!("{TEAM}/{}", self.path);
        }
        format!("agents/{}/{}", self.agent, self.path)
    }
}

impl std::fmt::Display for RemotePath {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "slate://{}/{}", self.agent, self.path)
    }
}
