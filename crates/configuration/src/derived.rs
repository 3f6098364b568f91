//! What a configuration's links fill and carry, and modules and links that are not written: modules of plugins that were loaded
//! by hand, and inferred links.

use slate_blackboard::is_within;

use super::Configuration;
use super::external::{ExternalDirection, ExternalLink};
use super::inferred::InferredLink;
use super::model::{Isolation, Link, Module, Wiring};
use super::senders::UNNAMED;
use super::source::{SettingSource, SourceKind, Span, Spanned};
use super::value::{Table, Value};

impl Configuration {
    /// The links to and from programs that are no agents.
    pub fn external_links(&self) -> &[ExternalLink] {
        &self.external
    }

    /// Those with a scheme.
    pub fn links_of_scheme(&self, scheme: &str) -> impl Iterator<Item = &ExternalLink> {
        self.external.iter().filter(move |link| link.other.value.scheme == scheme)
    }

    /// Whether a link fills an input or a part of it, from this agent, another one or a program that is no agent.
    pub fn is_filled(&self, input: &str) -> bool {
        let fills = |link: &Link| is_within(&link.to.value, input);
        self.links.iter().any(fills) || self.external.iter().any(|link| link.fills(input))
    }

    /// Whether a link to a program that is no agent carries a property or a part of it.
    pub fn is_sent_outside(&self, path: &str) -> bool {
        let is_out = |link: &&ExternalLink| link.direction == ExternalDirection::Out;
        let mut sent = self.external.iter().filter(is_out);
        sent.any(|link| is_within(&link.path.value, path))
    }

    /// Whether an input is linked, or has a value, or is to have neither. That others read it says nothing of it.
    pub fn says_of_port(&self, path: &str) -> bool {
        let fills = |link: &Link| !link.is_inferred() && is_within(&link.to.value, path);
        let has_value = |name: &str, port: &str| {
            let module = self.modules.iter().find(|module| module.name.value == name);
            module.is_some_and(|module| module.inputs.get(port).is_some())
        };
        self.links.iter().any(fills)
            || self.external.iter().any(|link| link.fills(path))
            || path.rsplit_once('/').is_some_and(|(name, port)| has_value(name, port))
            || self.is_left_out(path)
    }

    /// Whether an outbox has a receiver, or is to have none.
    pub fn says_of_outbox(&self, path: &str) -> bool {
        let sends = |link: &Link| !link.is_inferred() && link.from.value.path_in("") == path;
        self.links.iter().any(sends) || self.says_of_port(path)
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

    /// The inferred links.
    pub fn inferred_links(&self) -> Vec<InferredLink> {
        let ends = |link: &Link| match link.wiring {
            Wiring::Written => None,
            Wiring::Inferred { sends } => {
                Some(InferredLink { to: link.to.value.clone(), from: link.from.value.path_in(""), sends })
            }
        };
        self.links.iter().filter_map(ends).collect()
    }

    /// The same with these inferred links instead of its own, except for ports of which it says something.
    pub fn with_inferred_links(&self, links: &[InferredLink]) -> Self {
        let nowhere = Span { source: 0, start: 0, end: 0 };
        let link = |own: &InferredLink| Link::inferred(&own.to, &own.from, own.sends, nowhere);
        let links: Vec<Link> = links.iter().filter_map(link).collect();
        let configuration = self.without_inferred(|_| true);
        let links = configuration.open_links(&links);
        configuration.with_inferred(links)
    }

    /// What inference gives the setting of a link, by the names of its path: a source, the senders of an inbox, or
    /// `true` for one of them.
    pub fn inferred_value(&self, names: &[String]) -> Option<Value> {
        let [section, to, sender @ ..] = names else { return None };
        let is_it = |link: &&Link| section == "links" && link.is_inferred() && link.to.value == *to;
        let mut links = self.links.iter().filter(is_it);
        if let [sender] = sender {
            return links.any(|link| link.from.value.to_string() == *sender).then_some(Value::Bool(true));
        }
        let links: Vec<&Link> = links.filter(|_| sender.is_empty()).collect();
        let text = |link: &Link| Value::Text(link.from.value.to_string());
        match links[..] {
            [] => None,
            [link] if link.wiring == (Wiring::Inferred { sends: false }) => Some(text(link)),
            _ => {
                Some(Value::List(links.iter().map(|link| Spanned::new(text(link), link.from.span)).collect()))
            }
        }
    }

    /// Those of some inferred links whose ports have no link here, and of which this configuration says nothing.
    pub(super) fn open_links(&self, links: &[Link]) -> Vec<Link> {
        let open = |link: &&Link| {
            let port = link.inferred_port();
            let is_said = |port: &str| match link.wiring {
                Wiring::Inferred { sends: true } => self.says_of_outbox(port),
                _ => self.says_of_port(port),
            };
            port.is_some_and(|port| {
                !is_said(&port)
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
        links.iter().filter(open).filter_map(at).collect()
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
        let links = configuration.open_links(&other.links);
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
