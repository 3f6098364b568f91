use std::fmt;

/// Address of a property or of a field in it.
/// `slate://agent/module/property/field`, absolute in an agent `/module/property`, or relative to a scope
/// `module/property`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Url {
    agent: Option<String>,
    absolute: bool,
    path: String,
}

/// Error of a text that is not a URL.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is not a property's URL: {reason}")]
pub struct UrlError {
    /// The given text.
    pub text: String,
    /// Reason.
    pub reason: &'static str,
}

impl Url {
    /// Reads a URL.
    ///
    /// # Errors
    /// States the fault: another scheme, an empty part, an invalid character in a name.
    pub fn parse(text: &str) -> Result<Self, UrlError> {
        let wrong = |reason| UrlError { text: text.into(), reason };
        let (agent, absolute, path) = if let Some(rest) = text.strip_prefix("slate://") {
            let (agent, path) = rest.split_once('/').ok_or(wrong("expected a path after slate://agent"))?;
            (Some(agent), true, path)
        } else if text.contains("://") {
            return Err(wrong("the scheme is slate://"));
        } else if let Some(path) = text.strip_prefix('/') {
            (None, true, path)
        } else {
            (None, false, text)
        };
        if !path.split('/').all(is_name) || agent.is_some_and(|agent| !is_name(agent)) {
            return Err(wrong("names are letters, digits, _ and -, separated by single slashes"));
        }
        Ok(Self { agent: agent.map(Into::into), absolute, path: path.into() })
    }

    /// Returns the agent, when the URL names one.
    pub fn agent(&self) -> Option<&str> {
        self.agent.as_deref()
    }

    /// Returns the path in the agent, without a leading slash.
    /// A relative URL is resolved in `scope` (empty for the root).
    pub fn path_in(&self, scope: &str) -> String {
        if self.absolute || scope.is_empty() { self.path.clone() } else { format!("{scope}/{}", self.path) }
    }
}

impl fmt::Display for Url {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.agent, self.absolute) {
            (Some(agent), _) => write!(f, "slate://{agent}/{}", self.path),
            (None, true) => write!(f, "/{}", self.path),
            (None, false) => f.write_str(&self.path),
        }
    }
}

/// Returns true if `path` equals `whole` or leads into it.
/// All paths lead into the empty one.
///
/// ```
/// use slate_blackboard::is_within;
///
/// assert!(is_within("planner/goal", "planner/goal") && is_within("planner/goal/x", "planner/goal"));
/// assert!(!is_within("planner/goals", "planner/goal"));
/// ```
pub fn is_within(path: &str, whole: &str) -> bool {
    let rest = path.strip_prefix(whole);
    rest.is_some_and(|rest| whole.is_empty() || rest.is_empty() || rest.starts_with('/'))
}

/// Returns true if a text can be a part of a path.
pub(crate) fn is_name(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'_' || c == b'-')
}
