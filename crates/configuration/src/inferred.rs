//! Links that nobody has written: what types and roles of blocks leave no choice of.

use slate_blackboard::{Url, is_within};

use super::model::{Filter, Link, Transport};
use super::path::{link_setting, sender_setting};
use super::senders::UNNAMED;
use super::source::Spanned;
use super::{Configuration, Span, Table, Value};

/// Who says that a link is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wiring {
    /// The configuration.
    #[default]
    Written,
    /// The types and roles of the ports: an input has one possible source, or an outbox one possible inbox.
    Inferred {
        /// Whether it carries messages.
        sends: bool,
    },
}

impl Link {
    /// A link between two paths that is not written; `at` is what complaints of it point at.
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

    /// Whether it is not written.
    pub fn is_inferred(&self) -> bool {
        self.wiring != Wiring::Written
    }

    /// The setting that would make it, and its value.
    pub fn setting(&self) -> (String, String) {
        let from = self.from.value.to_string();
        match self.wiring {
            Wiring::Inferred { sends: true } => (sender_setting(&self.to.value, &from), "true".into()),
            _ => (link_setting(&self.to.value), toml_edit::Value::from(from).to_string()),
        }
    }

    /// The port that has it: the input that it fills, or the outbox that sends.
    fn inferred_port(&self) -> Option<String> {
        match self.wiring {
            Wiring::Written => None,
            Wiring::Inferred { sends: true } => Some(self.from.value.path_in("")),
            Wiring::Inferred { sends: false } => Some(self.to.value.clone()),
        }
    }
}

impl Configuration {
    /// Whether a port is linked, or has a value, or is to have neither.
    pub fn says_of_port(&self, path: &str) -> bool {
        let fills = |link: &Link| !link.is_inferred() && is_within(&link.to.value, path);
        let sends = |link: &Link| !link.is_inferred() && link.from.value.path_in("") == path;
        let has_value = |name: &str, port: &str| {
            let module = self.modules.iter().find(|module| module.name.value == name);
            module.is_some_and(|module| module.inputs.get(port).is_some())
        };
        self.links.iter().any(|link| fills(link) || sends(link))
            || path.rsplit_once('/').is_some_and(|(name, port)| has_value(name, port))
            || self.is_left_out(path)
    }

    /// Whether a port is to be without a link: `false` stands for it, or for it as one of an inbox's senders. An inbox
    /// is also when `false` stands in the list of its senders: then it has only those that are named.
    pub fn is_left_out(&self, path: &str) -> bool {
        let Some(links) = self.table("links") else { return false };
        let is_false = |senders: &Table, name: &str| {
            senders.get(name).is_some_and(|sender| sender.as_bool() == Some(false))
        };
        links.iter().any(|(to, entry)| match &entry.value.value {
            Value::Bool(false) => to == path,
            Value::Table(senders) => {
                is_false(senders, &format!("/{path}")) || to == path && is_false(senders, UNNAMED)
            }
            _ => false,
        })
    }

    /// A link as it would be written, in a line.
    pub fn link_line(&self, link: &Link) -> String {
        let (path, value) = link.setting();
        format!("{path} = {value}")
    }

    /// The same with links that are not written.
    pub fn with_inferred(&self, links: impl IntoIterator<Item = Link>) -> Self {
        let mut configuration = self.clone();
        configuration.links.extend(links);
        configuration
    }

    /// The same without those of the ports that `gone` names.
    pub fn without_inferred(&self, gone: impl Fn(&str) -> bool) -> Self {
        let mut configuration = self.clone();
        configuration.links.retain(|link| !link.inferred_port().is_some_and(|port| gone(&port)));
        configuration
    }

    /// The links that are not written of another configuration, as far as this one says nothing of their ports.
    pub(super) fn inferred_of(&self, other: &Self) -> Vec<Link> {
        let open = |link: &&Link| {
            let port = link.inferred_port();
            port.is_some_and(|port| {
                !self.says_of_port(&port)
                    && !self.is_left_out(&link.to.value)
                    && !self.links.iter().any(|own| own.inferred_port().as_ref() == Some(&port))
            })
        };
        let at = |link: &Link| {
            let name = |module: &&super::Module| {
                let port = link.inferred_port().unwrap_or_default();
                port.strip_prefix(module.name.value.as_str()).is_some_and(|rest| rest.starts_with('/'))
            };
            // Where it is written in this one.
            let span =
                self.modules.iter().filter(name).max_by_key(|module| module.name.value.len())?.name.span;
            let mut link = link.clone();
            (link.to.span, link.from.span) = (span, span);
            Some(link)
        };
        other.links.iter().filter(open).filter_map(at).collect()
    }
}
