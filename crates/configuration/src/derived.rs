//! Modules and links of a configuration that are not written: modules of plugins that were loaded by hand, and inferred
//! links.

use slate_blackboard::is_within;

use super::Configuration;
use super::model::{Isolation, Link, Module};
use super::senders::UNNAMED;
use super::source::{SettingSource, SourceKind, Span, Spanned};
use super::value::{Table, Value};

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
            let name = |module: &&Module| {
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

    /// The same with another module of that kind, which a plugin brought that was loaded by hand from `origin`.
    pub fn with_module(&self, name: &str, kind: &str, origin: &str) -> Self {
        let mut configuration = self.clone();
        let text = format!("modules.\"{name}\".kind = \"{kind}\"");
        let span = Span { source: configuration.sources.0.len(), start: 0, end: text.len() };
        let rank = configuration.sources.0.iter().map(|source| source.rank).max().unwrap_or(0) + 1;
        configuration.sources.0.push(SettingSource {
            name: origin.into(),
            kind: SourceKind::Plugin,
            path: None,
            text: text.into(),
            rank,
            place: Default::default(),
            document: None,
        });
        configuration.modules.push(Module {
            name: Spanned::new(name.into(), span),
            kind: Spanned::new(kind.into(), span),
            enabled: Spanned::new(true, span),
            isolated: Spanned::new(false, span),
            isolation: Isolation::default(),
            memory: None,
            stage: None,
            trigger: None,
            deadline: None,
            params: Table::default(),
            inputs: Table::default(),
        });
        configuration
    }

    /// The same with the modules that [`with_module`](Configuration::with_module) added to another one, and with its links
    /// that are not written.
    pub fn with_loaded_of(&self, other: &Self) -> Self {
        let missing = |module: &&Module| {
            other.is_loaded(module) && !self.modules.iter().any(|own| own.name.value == module.name.value)
        };
        let add = |configuration: Self, module: &Module| {
            let origin = &other.sources.of(module.name.span).name;
            configuration.with_module(&module.name, &module.kind, origin)
        };
        let configuration = other.modules.iter().filter(missing).fold(self.clone(), add);
        let links = configuration.inferred_of(other);
        configuration.with_inferred(links)
    }

    /// Whether a module of this configuration came with a plugin that was loaded by hand.
    pub fn is_loaded(&self, module: &Module) -> bool {
        self.sources.of(module.name.span).kind == SourceKind::Plugin
    }

    /// The same without those modules that [`with_module`](Configuration::with_module) added.
    pub fn without_loaded(&self, names: &[String]) -> Self {
        let mut configuration = self.clone();
        configuration
            .modules
            .retain(|module| !(self.is_loaded(module) && names.contains(&module.name.value)));
        configuration
    }
}
