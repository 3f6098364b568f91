//! Inferred links, determined by types and roles of blocks.

use serde::{Deserialize, Serialize};
use slate_blackboard::Url;

use super::model::{Filter, Link, Transport, Wiring};
use super::path::{link_setting, sender_setting};
use super::source::{Span, Spanned};

/// Ends of an inferred link.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InferredLink {
    /// The path of the input or inbox.
    pub to: String,
    /// The path of the property or outbox.
    pub from: String,
    /// True if it carries messages.
    pub sends: bool,
}

impl Link {
    /// Makes an inferred link between two paths.
    /// Complaints about it point to `at`.
    pub fn inferred(to: &str, from: &str, sends: bool, at: Span) -> Option<Self> {
        Some(Self {
            to: Spanned::new(to.into(), at),
            from: Spanned::new(Url::parse(&format!("/{from}")).ok()?, at),
            previous: false,
            stale: None,
            filter: Filter::default(),
            policy: None,
            window: None,
            transport: Transport::default(),
            wiring: Wiring::Inferred { sends },
        })
    }

    /// Returns true if the link is inferred.
    pub fn is_inferred(&self) -> bool {
        self.wiring != Wiring::Written
    }

    /// Returns true if it is an inferred link that carries messages.
    pub fn carries_messages(&self) -> bool {
        self.wiring == Wiring::Inferred { sends: true }
    }

    /// Returns the setting that would make the link, and its value.
    pub fn setting(&self) -> (String, String) {
        let from = self.from.value.to_string();
        match self.wiring {
            Wiring::Inferred { sends: true } => (sender_setting(&self.to.value, &from), "true".into()),
            _ => (link_setting(&self.to.value), toml_edit::Value::from(from).to_string()),
        }
    }

    /// Returns the port of an inferred link.
    /// It is the input that it fills, or the outbox that sends.
    pub(super) fn inferred_port(&self) -> Option<String> {
        match self.wiring {
            Wiring::Written => None,
            Wiring::Inferred { sends: true } => Some(self.from.value.path_in("")),
            Wiring::Inferred { sends: false } => Some(self.to.value.clone()),
        }
    }
}
