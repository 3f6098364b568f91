use crate::channel::{LinkError, ValueMismatch};
use crate::interface::AccessError;

/// Error of the address space.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// No property is at the URL.
    #[error("no property at {url}{}", nearest(.near))]
    Unknown {
        /// The requested URL.
        url: String,
        /// Most similar names.
        near: Vec<String>,
    },
    /// The URL is taken already.
    #[error("{url} exists already")]
    Exists {
        /// The URL.
        url: String,
    },
    /// A module writes the property, so no other caller may.
    #[error("{url} is written by its module; only parameters and inputs without a link can be set")]
    ReadOnly {
        /// The URL.
        url: String,
    },
    /// A link fills the property, so no other caller may.
    #[error("{url} follows {from}; remove the link first: slate unlink {url}")]
    Linked {
        /// URL of the field.
        url: String,
        /// URL that the field is linked to.
        from: String,
    },
    /// The value or the field doesn't fit.
    #[error("{url}: {error}")]
    Access {
        /// URL of the property.
        url: String,
        /// Reason.
        error: AccessError,
    },
    /// The URL belongs to another agent.
    #[error("{url} belongs to another agent than {agent}")]
    OtherAgent {
        /// The requested URL.
        url: String,
        /// This agent.
        agent: String,
    },
    /// A value of a snapshot does not fit.
    #[error("{url}: {error}")]
    Mismatch {
        /// URL of the property.
        url: String,
        /// The value.
        error: ValueMismatch,
    },
    /// No handle is available.
    #[error("{url}: {error}")]
    Link {
        /// URL of the property.
        url: String,
        /// Reason.
        error: LinkError,
    },
}

fn nearest(near: &[String]) -> String {
    if near.is_empty() { String::new() } else { format!("; nearest: {}", near.join(", ")) }
}
