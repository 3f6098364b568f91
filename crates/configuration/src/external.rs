//! Links to external programs, which are not agents; bridges carry them.

use std::fmt;

use super::source::Spanned;
use super::value::Table;

/// Address outside of all agents, such as `ros2:/scan`.
/// The scheme names the bridge.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ExternalUrl {
    /// The scheme, such as `ros2`.
    pub scheme: String,
    /// Address for the bridge, such as `/scan`.
    pub address: String,
}

impl ExternalUrl {
    /// Parses an address.
    /// `None` for a text without a scheme, with `slate:`, or with two slashes, as no bridge names a host.
    ///
    /// ```
    /// use slate_configuration::ExternalUrl;
    ///
    /// let topic = ExternalUrl::parse("ros2:/scan").ok_or("no scheme")?;
    /// assert_eq!((topic.scheme.as_str(), topic.address.as_str()), ("ros2", "/scan"));
    /// assert!(ExternalUrl::parse("laser/scan").is_none() && ExternalUrl::parse("slate://base/laser/scan").is_none());
    /// # Ok::<(), &str>(())
    /// ```
    pub fn parse(text: &str) -> Option<Self> {
        let (scheme, address) = text.split_once(':')?;
        let is_scheme = scheme.starts_with(|first: char| first.is_ascii_lowercase())
            && scheme.bytes().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'-')
            && scheme != "slate"
            && !address.starts_with("//");
        is_scheme.then(|| Self { scheme: scheme.into(), address: address.into() })
    }
}

impl fmt::Display for ExternalUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.scheme, self.address)
    }
}

/// Direction of a link to or from an external program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExternalDirection {
    /// The program fills an input.
    In,
    /// The program receives the values of a property.
    Out,
}

/// Link between this agent and an external program.
#[derive(Clone, Debug)]
pub struct ExternalLink {
    /// Path in this agent: of the input, or of the property.
    pub path: Spanned<String>,
    /// The other end.
    pub other: Spanned<ExternalUrl>,
    /// Direction of the values.
    pub direction: ExternalDirection,
    /// Options of its table beside `from`; the bridge defines the keys.
    pub options: Table,
}

impl ExternalLink {
    /// Destination and source, as written.
    pub fn ends(&self) -> (String, String) {
        let (own, other) = (self.path.value.clone(), self.other.value.to_string());
        match self.direction {
            ExternalDirection::In => (own, other),
            ExternalDirection::Out => (other, format!("/{own}")),
        }
    }

    /// Keys and values of its table beside `from`.
    pub fn option_texts(&self) -> Vec<(String, String)> {
        self.options.iter().map(|(name, entry)| (name.to_owned(), entry.value.value.to_string())).collect()
    }

    /// Returns true if it fills an input, or a part of it.
    pub fn fills(&self, input: &str) -> bool {
        self.direction == ExternalDirection::In && slate_blackboard::is_within(&self.path.value, input)
    }
}
