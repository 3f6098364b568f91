//! What other agents may do.

use std::collections::BTreeMap;

pub use slate_runtime::configuration::Allowance;

/// What other agents may do here: all unless it is restricted, and then what is said.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rights(Option<BTreeMap<String, Allowance>>);

impl Rights {
    /// Whoever is not in it may do nothing.
    pub fn restricted(allow: BTreeMap<String, Allowance>) -> Self {
        Self(Some(allow))
    }

    /// Whether it is said what each agent may do.
    pub fn is_restricted(&self) -> bool {
        self.0.is_some()
    }

    /// What an agent may do; nothing when it may do all.
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

    /// Whether an agent is told what the team knows, and believed.
    pub fn has_team(&self, agent: &str) -> bool {
        self.0.as_ref().is_none_or(|allow| allow.get(agent).is_some_and(|allowance| allowance.team))
    }
}

/// Whether a path may be read.
pub(super) fn may_read(allowance: Option<&Allowance>, path: &str) -> bool {
    allowance.is_none_or(|allowance| allowance.read.iter().any(|pattern| pattern.matches(path)))
}

/// Whether messages may be sent to a path.
pub(super) fn may_send(allowance: Option<&Allowance>, path: &str) -> bool {
    allowance.is_none_or(|allowance| allowance.send.iter().any(|pattern| pattern.matches(path)))
}

/// Whether it is told what the team knows, and believed.
pub(super) fn is_of_team(allowance: Option<&Allowance>) -> bool {
    allowance.is_none_or(|allowance| allowance.team)
}
