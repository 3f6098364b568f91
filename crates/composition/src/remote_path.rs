use slate_configuration::TEAM;

/// Path of a property, a field or a mailbox of another agent, as a link names it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RemotePath {
    /// The other agent.
    pub agent: String,
    /// The path in it.
    pub path: String,
}

impl RemotePath {
    /// Returns the path of the local mirror on this agent's board.
    /// It is `team/TOPIC` for the team's knowledge, and `agents/AGENT/PROPERTY` for everything else.
    pub fn mirror_path(&self) -> String {
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
