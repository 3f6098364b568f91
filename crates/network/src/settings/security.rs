//! Table `[network.security]` of a configuration.

use std::path::PathBuf;

use slate_blackboard::{Pattern, Url};
use slate_runtime::configuration::{Span, Spanned, Table, Value};
use slate_sorted::SortedMap;

use super::NetworkSettingsReader;

/// Certificates of an agent on a network, and the rights of others.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkSecurity {
    /// Agent's certificate, in PEM.
    pub certificate: NetworkFile,
    /// Private key of the certificate.
    pub key: NetworkFile,
    /// Authority that signs the certificates of agents.
    pub authority: NetworkFile,
    /// Rights of agents, by the common names of their certificates.
    pub allow: SortedMap<String, NetworkRights>,
    /// Rights of programs over `tcp/` and `udp/`, which have no name.
    pub unauthenticated: Option<NetworkRights>,
}

/// File that a configuration names.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Place in the configuration.
    pub place: Option<Span>,
}

/// Rights of others on a network.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NetworkRights {
    /// Properties that they may read.
    pub read: Vec<Pattern>,
    /// Properties that they may set, and inboxes that they may send messages to.
    pub send: Vec<Pattern>,
    /// Team membership, which includes the exchange of facts.
    pub team: bool,
    /// Router role: it speaks for other agents.
    pub router: bool,
}

impl NetworkSecurity {
    /// Returns the rights of an agent, directly or else through a router.
    /// `None` for a stranger.
    pub fn rights(&self, agent: &str) -> Option<&NetworkRights> {
        let router = || self.allow.values().find(|rights| rights.router);
        self.allow.get(agent).or_else(router)
    }
}

impl NetworkRights {
    /// Returns whether they include reading a property.
    pub fn may_read(&self, path: &str) -> bool {
        self.read.iter().any(|pattern| pattern.matches(path))
    }

    /// Returns whether they include setting a property, or sending messages to it.
    pub fn may_send(&self, path: &str) -> bool {
        self.send.iter().any(|pattern| pattern.matches(path))
    }
}

const FILE_KEYS: [&str; 3] = ["certificate", "key", "authority"];

impl NetworkSettingsReader<'_> {
    pub(super) fn security(&mut self, table: &Table) -> Option<NetworkSecurity> {
        let root = table.get("security")?;
        let Some(table) = root.as_table() else {
            let message = format!("`security` is a table, found {}", root.describe());
            self.add(root.span, message, "write [network.security]");
            return None;
        };
        let known = [&FILE_KEYS[..], &["allow", "unauthenticated"]].concat();
        self.unknown_keys(table, "in [network.security]", &known);
        let [certificate, key, authority] = FILE_KEYS.map(|name| self.file(root.span, table, name));
        let allow = self.allow(root.span, table);
        let unauthenticated = table
            .get("unauthenticated")
            .and_then(|value| self.rights("network.security.unauthenticated", value, &["read", "send"]));
        Some(NetworkSecurity {
            certificate: certificate?,
            key: key?,
            authority: authority?,
            allow: allow?,
            unauthenticated,
        })
    }

    fn file(&mut self, place: Span, table: &Table, name: &str) -> Option<NetworkFile> {
        let Some(value) = table.get(name) else {
            let help = "`certificate`, `key` and `authority` belong together";
            self.add(place, format!("[network.security] lacks `{name}`"), help);
            return None;
        };
        let Some(text) = value.as_str() else {
            let message = format!("`{name}` takes text, found {}", value.describe());
            self.add(value.span, message, &format!("write {name} = \"keys/{name}.pem\""));
            return None;
        };
        let path = self.configuration.folder_of(value.span).join(text);
        // Zenoh takes paths in a list that these separate.
        if path.to_str().is_none_or(|path| path.contains([';', '#'])) {
            let message = format!("the path {} contains `;` or `#`, or is not UTF-8", path.display());
            self.add(value.span, message, "give the file another name, or move it");
            return None;
        }
        Some(NetworkFile { path, place: Some(value.span) })
    }

    fn allow(&mut self, place: Span, table: &Table) -> Option<SortedMap<String, NetworkRights>> {
        const HELP: &str = "add [network.security.allow.NAME] with `read` and `send` for each permitted agent; \
                            all others are refused";
        let Some(value) = table.get("allow") else {
            let message = "[network.security] has this agent's identity, but no rights of others";
            self.add(place, message, HELP);
            return None;
        };
        let Some(agents) = value.as_table() else {
            self.add(value.span, format!("`allow` is a table, found {}", value.describe()), HELP);
            return None;
        };
        let mut allow = SortedMap::new();
        for (agent, entry) in agents.iter() {
            if Url::parse(&format!("slate://{agent}/x")).is_err() {
                let message = format!("`{agent}` can't be an agent's name");
                self.add(entry.key, message, "names are letters, digits, _ and -");
                continue;
            }
            let name = format!("network.security.allow.{agent}");
            let rights = self.rights(&name, &entry.value, &["read", "send", "router", "team"]);
            allow.extend(rights.map(|rights| (agent.to_owned(), rights)));
        }
        Some(allow)
    }

    fn rights(&mut self, name: &str, value: &Spanned<Value>, known: &[&str]) -> Option<NetworkRights> {
        let Some(table) = value.as_table() else {
            let message = format!("`{name}` is a table, found {}", value.describe());
            self.add(value.span, message, &format!("write [{name}] and below it read = [\"localizer/**\"]"));
            return None;
        };
        self.unknown_keys(table, &format!("in [{name}]"), known);
        Some(NetworkRights {
            read: self.patterns(table, "read"),
            send: self.patterns(table, "send"),
            team: self.flag(table, "team"),
            router: self.flag(table, "router"),
        })
    }
}
