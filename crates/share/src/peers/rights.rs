//! Rights of other agents.

use slate_sorted::SortedMap;

pub use slate_runtime::configuration::Allowance;

/// Rights of other agents in this one.
/// Everything is allowed unless they are restricted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rights(Option<SortedMap<String, Allowance>>);

impl Rights {
    /// Creates restricted rights; agents that are not listed have none.
    pub fn restricted(allow: SortedMap<String, Allowance>) -> Self {
        Self(Some(allow))
    }

    /// Returns whether rights are configured for each agent.
    pub fn is_restricted(&self) -> bool {
        self.0.is_some()
    }

    /// Returns the rights of an agent; `None` if they are unrestricted.
    ///
    /// # Errors
    /// In words, when it may not even connect.
    pub fn of(&self, own: &str, agent: &str) -> Result<Option<&Allowance>, String> {
        let Some(allow) = &self.0 else { return Ok(None) };
        allow.get(agent).map(Some).ok_or_else(|| {
            format!(
                "agent `{agent}` is not in [share.security.allow] of agent `{own}`, so they may not connect"
            )
        })
    }

    /// Returns whether an agent exchanges the team's knowledge.
    /// It then receives that knowledge, and its statements are believed.
    pub fn has_team(&self, agent: &str) -> bool {
        self.0.as_ref().is_none_or(|allow| allow.get(agent).is_some_and(|allowance| allowance.team))
    }
}

/// Returns whether a path may be read.
pub(super) fn may_read(allowance: Option<&Allowance>, path: &str) -> bool {
    allowance.is_none_or(|allowance| allowance.read.iter().any(|pattern| pattern.matches(path)))
}

/// Returns whether messages may be sent to a path.
pub(super) fn may_send(allowance: Option<&Allowance>, path: &str) -> bool {
    allowance.is_none_or(|allowance| allowance.send.iter().any(|pattern| pattern.matches(path)))
}

/// Returns whether an agent exchanges the team's knowledge.
/// It then receives that knowledge, and its statements are believed.
pub(super) fn is_of_team(allowance: Option<&Allowance>) -> bool {
    allowance.is_none_or(|allowance| allowance.team)
}
