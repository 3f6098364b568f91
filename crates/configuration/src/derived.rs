//! Derived parts of a configuration.
//! These are the inputs and properties of its links, and modules and links that are not written: modules of plugins
//! loaded by hand, and inferred links.

use slate_blackboard::is_within;

use super::Configuration;
use super::external::{ExternalDirection, ExternalLink};
use super::inferred::InferredLink;
use super::model::{Isolation, Link, Module, Wiring};
use super::senders::UNNAMED;
use super::source::{SettingSource, SourceKind, Span, Spanned};
use super::value::{Table, Value};

impl Configuration {
    /// Links to and from external programs, which are not agents.
    pub fn external_links(&self) -> &[ExternalLink] {
        &self.external
    }

    /// External links of a scheme.
    pub fn links_of_scheme(&self, scheme: &str) -> impl Iterator<Item = &ExternalLink> {
        self.external.iter().filter(move |link| link.other.value.scheme == scheme)
    }

    /// Returns true if a link fills an input or a part of it.
    /// Its source is in this agent, in another one or in a program that is not an agent.
    pub fn is_filled(&self, input: &str) -> bool {
        let fills = |link: &Link| is_within(&link.to.value, input);
        self.links.iter().any(fills) || self.external.iter().any(|link| link.fills(input))
    }

    /// Returns true if a link carries a property, or a part of it, to a program.
    /// The program is not an agent.
    pub fn is_sent_outside(&self, path: &str) -> bool {
        let is_out = |link: &&ExternalLink| link.direction == ExternalDirection::Out;
        let mut sent = self.external.iter().filter(is_out);
        sent.any(|link| is_within(&link.path.value, path))
    }

    /// Returns true if the configuration decides on an input.
    /// The input has a link or a value, or must have neither. Readers of the input do not count.
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

    /// Returns true if an outbox has a receiver, or must have none.
    pub fn says_of_outbox(&self, path: &str) -> bool {
        let sends = |link: &Link| !link.is_inferred() && link.from.value.path_in("") == path;
        self.links.iter().any(sends) || self.says_of_port(path)
    }

    /// Returns true if a port must stay without a link.
    /// `false` is set for the port, or for it as one of an inbox's senders. An inbox also counts if `false` is in the
    /// list of its senders: it then has only the listed ones.
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

    /// Returns a link as written in a configuration, in one line.
    pub fn link_line(&self, link: &Link) -> String {
        let (path, value) = link.setting();
        format!("{path} = {value}")
    }

    /// Returns the configuration with additional inferred links.
    pub fn with_inferred(&self, links: impl IntoIterator<Item = Link>) -> Self {
        let mut configuration = self.clone();
        configuration.links.extend(links);
        configuration
    }

    /// Returns the configuration without the inferred links of the ports in `gone`.
    pub fn without_inferred(&self, gone: impl Fn(&str) -> bool) -> Self {
        let mut configuration = self.clone();
        configuration.links.retain(|link| !link.inferred_port().is_some_and(|port| gone(&port)));
        configuration
    }

    /// Returns the inferred links.
    pub fn inferred_links(&self) -> Vec<InferredLink> {
        let ends = |link: &Link| match link.wiring {
            Wiring::Written => None,
            Wiring::Inferred { sends } => {
                Some(InferredLink { to: link.to.value.clone(), from: link.from.value.path_in(""), sends })
            }
        };
        self.links.iter().filter_map(ends).collect()
    }

    /// Returns the configuration with these inferred links in place of its own.
    /// Ports that it decides on are excluded.
    pub fn with_inferred_links(&self, links: &[InferredLink]) -> Self {
        let nowhere = Span { source: 0, start: 0, end: 0 };
        let link = |own: &InferredLink| Link::inferred(&own.to, &own.from, own.sends, nowhere);
        let links: Vec<Link> = links.iter().filter_map(link).collect();
        let configuration = self.without_inferred(|_| true);
        let links = configuration.open_links(&links);
        configuration.with_inferred(links)
    }

    /// Returns the inferred value of a link's setting, by the names of its path.
    /// It is a source, the senders of an inbox, or `true` for one of them.
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

    /// Returns those inferred links whose ports are undecided here.
    /// Such ports have no link, and the configuration does not decide on them.
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

    /// Returns the configuration with another module of a kind.
    /// A plugin that was loaded by hand from `origin` brought the module.
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

    /// Returns the configuration with the unwritten modules and links of another.
    /// The modules are those that [`with_module`](Configuration::with_module) added there.
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

    /// Returns true if a module came with a plugin that was loaded by hand.
    pub fn is_loaded(&self, module: &Module) -> bool {
        self.sources.of(module.name.span).kind == SourceKind::Plugin
    }

    /// Returns the configuration without some modules loaded by hand.
    /// Only those count that [`with_module`](Configuration::with_module) added.
    pub fn without_loaded(&self, names: &[String]) -> Self {
        let mut configuration = self.clone();
        configuration
            .modules
            .retain(|module| !(self.is_loaded(module) && names.contains(&module.name.value)));
        configuration
    }
}
