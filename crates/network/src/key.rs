//! Key expressions of an agent.

use slate_blackboard::Url;

use crate::options::ReadOptions;

/// Returns the key expression of a property.
/// `slate://arm/localizer/pose` is `slate/arm/localizer/pose`.
pub fn property_key(agent: &str, path: &str) -> String {
    format!("slate/{agent}/{path}")
}

/// Returns the key of the token that exists while an agent is on the network.
pub fn alive_key(agent: &str) -> String {
    format!("slate/{agent}/@alive")
}

/// Returns the key at which an agent lists its properties.
pub fn tree_key(agent: &str) -> String {
    format!("slate/{agent}/@tree")
}

/// Returns the key at which an agent lists the properties for another one.
/// They are those that its access control permits.
pub fn tree_key_of(agent: &str, reader: &str) -> String {
    format!("slate/{agent}/@tree/{reader}")
}

/// Returns the key for setting a property or sending a message.
/// The request is a query with a payload.
pub fn set_key(agent: &str, path: &str) -> String {
    format!("slate/{agent}/@set/{path}")
}

/// Returns the key of a property's publications for [options](crate::ReadOptions).
pub fn read_key(agent: &str, options: &str, path: &str) -> String {
    format!("slate/{agent}/@read/{options}/{path}")
}

/// Returns the key of an interface's schema; `*` for all of them.
pub fn schema_key(agent: &str, interface: &str) -> String {
    format!("slate/{agent}/@schema/{interface}")
}

/// Returns the key of the token that exists while an agent is in its team.
pub fn team_token_key(agent: &str) -> String {
    format!("slate/{agent}/@team")
}

/// Returns the key of messages of the team's knowledge from one agent to another.
pub fn team_key(from: &str, to: &str) -> String {
    format!("slate/{from}/@team/{to}")
}

/// Returns the agent of a key `slate/AGENT/...` with that end.
pub fn agent_before<'k>(key: &'k str, end: &str) -> Option<&'k str> {
    key.strip_prefix("slate/")?.strip_suffix(end)?.strip_suffix('/').filter(|agent| !agent.contains('/'))
}

/// Returns the agent whose token a key is.
pub fn alive_agent(key: &str) -> Option<&str> {
    agent_before(key, "@alive")
}

/// Source of an input's values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum InputSource {
    /// Property of another agent, `slate://base/sensor/reading`.
    Property {
        /// Agent.
        agent: String,
        /// Path of the property in it.
        path: String,
    },
    /// Key of Zenoh, `zenoh:demo/temperature`.
    Key(String),
}

impl InputSource {
    /// Reads a source.
    ///
    /// # Errors
    /// Reason why it is invalid, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        if let Some(key) = text.strip_prefix("zenoh:") {
            return match check_key(key) {
                None => Ok(Self::Key(key.into())),
                Some(reason) => Err(format!("`{key}` is not a key of Zenoh: {reason}")),
            };
        }
        let url = Url::parse(text).map_err(|error| error.to_string())?;
        match url.agent() {
            Some(agent) => Ok(Self::Property { agent: agent.into(), path: url.path_in("") }),
            None => Err(format!("`{text}` names no agent")),
        }
    }

    /// Returns its key expression for a reader with those options.
    pub fn key(&self, options: &ReadOptions) -> String {
        match self {
            Self::Property { agent, path } if *options != ReadOptions::default() => {
                read_key(agent, &options.to_string(), path)
            }
            Self::Property { agent, path } => property_key(agent, path),
            Self::Key(key) => key.clone(),
        }
    }
}

impl std::fmt::Display for InputSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Property { agent, path } => write!(f, "slate://{agent}/{path}"),
            Self::Key(key) => write!(f, "zenoh:{key}"),
        }
    }
}

/// Returns the reason why a text is not the key of one value, if any.
pub fn check_key(key: &str) -> Option<&'static str> {
    if key.split('/').any(str::is_empty) {
        return Some("its parts are separated by single slashes, and none is empty");
    }
    if key.contains(['*', '$', '?', '#']) {
        return Some("an input reads one key, so `*`, `$`, `?` and `#` can't be in it");
    }
    None
}
