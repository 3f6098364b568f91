use crate::channel::{LinkError, Misfit};
use crate::interface::AccessError;

/// What goes wrong with the address space.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// Nothing is there.
    #[error("no property at {url}{}", nearest(.near))]
    Unknown {
        /// What was asked for.
        url: String,
        /// The nearest names there are.
        near: Vec<String>,
    },
    /// Something else is there already.
    #[error("{url} exists already")]
    Exists {
        /// Where.
        url: String,
    },
    /// A module writes it, so nobody else may.
    #[error("{url} is written by its module; only parameters and inputs without a link can be set")]
    ReadOnly {
        /// Which.
        url: String,
    },
    /// A link fills it, so nobody else may.
    #[error("{url} follows {from}; take the link away first: slate unlink {url}")]
    Linked {
        /// Which field.
        url: String,
        /// What it is linked to.
        from: String,
    },
    /// The value or the field doesn't fit.
    #[error("{url}: {error}")]
    Access {
        /// Which property.
        url: String,
        /// What is wrong.
        error: AccessError,
    },
    /// The URL belongs to another agent.
    #[error("{url} belongs to another agent than {agent}")]
    OtherAgent {
        /// What was asked for.
        url: String,
        /// This agent.
        agent: String,
    },
    /// A value of a snapshot doesn't fit.
    #[error("{url}: {error}")]
    Misfit {
        /// Which property.
        url: String,
        /// The value.
        error: Misfit,
    },
    /// No handle is given out.
    #[error("{url}: {error}")]
    Link {
        /// Which property.
        url: String,
        /// Why.
        error: LinkError,
    },
}

fn nearest(near: &[String]) -> String {
    if near.is_empty() { String::new() } else { format!("; nearest: {}", near.join(", ")) }
}
