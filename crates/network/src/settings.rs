//! Table `[network]` of a configuration.

mod reading;
mod security;

use slate_blackboard::Pattern;
use slate_runtime::Message;
use slate_runtime::configuration::{Configuration, Diagnostic, Report, Span, Spanned, Table, Value};
use slate_sorted::SortedMap;

use crate::endpoint::NetworkEndpoint;

pub use reading::{NetworkInput, NetworkOutput};
pub use security::{NetworkFile, NetworkRights, NetworkSecurity};

/// Name of the table.
pub const TABLE: &str = "network";

/// Scheme of links to keys of the network.
pub const SCHEME: &str = "zenoh";

/// Settings of an agent on a network of Zenoh.
///
/// ```
/// use slate_network::{NetworkMode, NetworkSettings};
/// use slate_runtime::configuration::{Configuration, Options};
///
/// let options = Options { extra_tables: vec!["network".into()], ..Options::default() };
/// let read = |text: &str| Configuration::from_text("arm.toml", text, &options);
/// let text = "[network]\nlisten = [\"tcp/127.0.0.1:7447\"]\npublish = [\"localizer/**\"]";
/// let settings = NetworkSettings::of(&read(text)?)?.unwrap_or_default();
/// assert_eq!(settings.mode, NetworkMode::Peer);
/// // In clear text to other machines: only where the file says so.
/// let open = read("[network]\nlisten = [\"tcp/0.0.0.0:7447\"]")?;
/// assert!(NetworkSettings::of(&open).is_err_and(|report| report.to_string().contains("clear text")));
/// # Ok::<(), slate_runtime::configuration::Report>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkSettings {
    /// Part in the network.
    pub mode: NetworkMode,
    /// Endpoints for incoming connections.
    pub listen: Vec<NetworkEndpoint>,
    /// Endpoints of outgoing connections.
    pub connect: Vec<NetworkEndpoint>,
    /// Discovery of peers in the local network by multicast.
    pub multicast: bool,
    /// Properties that others may read; `None` for all of them.
    pub publish: Option<Vec<Pattern>>,
    /// Properties that others set or send messages to; none unless said.
    pub set: Vec<Pattern>,
    /// Inputs that read from the network, by path.
    pub read: SortedMap<String, NetworkInput>,
    /// Properties that are published at keys which links name.
    pub write: Vec<NetworkOutput>,
    /// Place of the setting that shares team facts over the network.
    /// `None` if they are not shared.
    pub team: Option<Span>,
    /// Certificates, and the rights of others; `None` without `quic/`.
    pub security: Option<NetworkSecurity>,
}

/// Part of a session in its network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkMode {
    /// Speaks to the peers and routers that it is connected to.
    Peer,
    /// Speaks through one router.
    Client,
    /// Router, which forwards the messages of others.
    Router,
}

impl NetworkMode {
    /// Modes.
    pub const ALL: [Self; 3] = [Self::Peer, Self::Client, Self::Router];

    /// Returns the name in the configuration and in Zenoh.
    pub fn name(self) -> &'static str {
        match self {
            Self::Peer => "peer",
            Self::Client => "client",
            Self::Router => "router",
        }
    }
}

impl Default for NetworkSettings {
    /// Returns the settings of a peer without connections.
    /// It reads nothing, publishes everything and lets nothing be set.
    fn default() -> Self {
        Self {
            mode: NetworkMode::Peer,
            listen: Vec::new(),
            connect: Vec::new(),
            multicast: false,
            publish: None,
            set: Vec::new(),
            read: SortedMap::new(),
            write: Vec::new(),
            team: None,
            security: None,
        }
    }
}

const TABLE_KEYS: [&str; 9] =
    ["mode", "listen", "connect", "multicast", "publish", "set", "read", "team", "security"];

impl NetworkSettings {
    /// Returns whether others may read a property.
    pub fn is_published(&self, path: &str) -> bool {
        self.publish.as_ref().is_none_or(|patterns| patterns.iter().any(|pattern| pattern.matches(path)))
    }

    /// Returns whether others may set a property, or send messages to it.
    pub fn is_settable(&self, path: &str) -> bool {
        self.set.iter().any(|pattern| pattern.matches(path))
    }

    /// Returns whether an agent is in the team, directly or through a router.
    pub fn is_team_peer(&self, agent: &str) -> bool {
        let may = |security: &NetworkSecurity| security.rights(agent).is_some_and(|rights| rights.team);
        self.team.is_some() && self.security.as_ref().is_none_or(may)
    }

    /// Reads the table `[network]` of a configuration; `None` without the table.
    /// It must be read with the table as one of [`extra_tables`](slate_runtime::configuration::Options::extra_tables).
    /// Links with `zenoh:` belong to the settings, too.
    ///
    /// # Errors
    /// Everything that is wrong with it, a link without the table, and endpoints in clear text to other machines that are not trusted.
    pub fn of(configuration: &Configuration) -> Result<Option<Self>, Report> {
        let mut reader = NetworkSettingsReader { configuration, wrong: Vec::new() };
        let Some(root) = configuration.value(TABLE) else {
            let link = configuration.links_of_scheme(SCHEME).next();
            return link.map_or(Ok(None), |link| Err(reader.without_table(link)));
        };
        let settings = reader.settings(root);
        if reader.wrong.is_empty() { Ok(Some(settings)) } else { Err(Report::from(reader.wrong)) }
    }
}

struct NetworkSettingsReader<'c> {
    configuration: &'c Configuration,
    wrong: Vec<Diagnostic>,
}

impl NetworkSettingsReader<'_> {
    fn unknown_keys(&mut self, table: &Table, place: &str, known: &[&str]) {
        self.wrong.extend(self.configuration.unknown_keys(table, place, known));
    }

    fn add(&mut self, span: Span, message: impl Into<Message>, help: &str) {
        self.wrong.push(self.configuration.diagnostic(span, message, Some(help.into())));
    }

    fn settings(&mut self, root: &Spanned<Value>) -> NetworkSettings {
        let mut settings = NetworkSettings::default();
        let Some(table) = root.as_table() else {
            let message = format!("`{TABLE}` is a table, found {}", root.describe());
            self.add(root.span, message, "write [network]");
            return settings;
        };
        self.unknown_keys(table, "in [network]", &TABLE_KEYS);
        settings.mode = self.mode(table);
        settings.listen = self.endpoints(table, "listen");
        settings.connect = self.endpoints(table, "connect");
        settings.multicast = self.multicast(table);
        if table.get("publish").is_some() {
            settings.publish = Some(self.patterns(table, "publish"));
        }
        settings.set = self.patterns(table, "set");
        settings.read = self.readings(table);
        for link in self.configuration.links_of_scheme(SCHEME) {
            self.link(link, &mut settings);
        }
        settings.team = self.team(root.span, table);
        settings.security = self.security(table);
        self.check_mode(root.span, table, &settings);
        self.check_security(table, &settings);
        settings
    }

    /// Checks that the endpoints suit the certificates and rights.
    fn check_security(&mut self, table: &Table, settings: &NetworkSettings) {
        let mut endpoints = settings.listen.iter().chain(&settings.connect);
        let encrypted = endpoints.clone().find(|endpoint| endpoint.is_encrypted());
        let clear = endpoints.find(|endpoint| !endpoint.is_encrypted());
        let Some(security) = &settings.security else {
            let place = encrypted.and_then(|endpoint| Some((endpoint, endpoint.place?)));
            if let (Some((endpoint, place)), None) = (place, table.get("security")) {
                let message =
                    format!("`{endpoint}` needs `certificate`, `key` and `authority` in [network.security]");
                self.add(place, message, "add them, and [network.security.allow.NAME] for each other agent");
            }
            return;
        };
        let place = table.get("security").map(|security| security.span);
        let Some(place) = place.filter(|_| self.wrong.is_empty()) else { return };
        if settings.team.is_none() && security.allow.values().any(|rights| rights.team) {
            let message =
                "agents of [network.security.allow] belong to the team, and [network] has no `team`";
            self.add(place, message, "add team = true to [network], or take `team` of the agents away");
        }
        if settings.mode == NetworkMode::Router {
            let help =
                "let a router of Zenoh forward discovery, as the book describes, or write mode = \"peer\"";
            self.add(place, "an agent with [network.security] passes on nothing of others", help);
        }
        if encrypted.is_none() {
            let help = "name an endpoint such as \"quic/192.168.1.5:7447\", or take [network.security] away";
            self.add(place, "[network.security] protects nothing: no endpoint is `quic/`", help);
        }
        let clear = clear.map(|endpoint| (endpoint.text.as_str(), endpoint.place));
        let clear = clear.or_else(|| settings.multicast.then_some(("multicast", None)));
        if let (Some((endpoint, at)), None) = (clear, &security.unauthenticated) {
            let message = format!("others at `{endpoint}` have no name, and no rule gives their rights");
            let help = "add the rule: unauthenticated = { read = [\"**\"], send = [] } in [network.security]; or use `quic/`";
            self.add(at.unwrap_or(place), message, help);
        }
    }

    /// Returns the place of the flag that shares team facts over the network.
    fn team(&mut self, place: Span, table: &Table) -> Option<Span> {
        let place = table.get("team").map_or(place, |flag| flag.span);
        let is_wanted = self.flag(table, "team");
        if is_wanted && self.configuration.share().is_none_or(|share| share.knowledge.is_none()) {
            let message =
                "facts of the team can't travel over the network: the agent takes no part in a team";
            self.add(place, message, "add [share.knowledge], or take `team` away");
        }
        is_wanted.then_some(place)
    }

    /// Reads a flag, which is false where it is missing.
    fn flag(&mut self, table: &Table, name: &str) -> bool {
        let Some(value) = table.get(name) else { return false };
        if value.as_bool().is_none() {
            let message = format!("`{name}` takes true or false, found {}", value.describe());
            self.add(value.span, message, &format!("write {name} = true"));
        }
        value.as_bool().unwrap_or_default()
    }

    fn mode(&mut self, table: &Table) -> NetworkMode {
        let Some(value) = table.get("mode") else { return NetworkMode::Peer };
        let found = NetworkMode::ALL.into_iter().find(|mode| value.as_str() == Some(mode.name()));
        if found.is_none() {
            let message = format!("`mode` is `peer`, `client` or `router`, found {}", value.value);
            self.add(value.span, message, "write mode = \"peer\", or leave it out");
        }
        found.unwrap_or(NetworkMode::Peer)
    }

    /// Checks that the endpoints suit the mode.
    fn check_mode(&mut self, place: Span, table: &Table, settings: &NetworkSettings) {
        let span = table.get("mode").map_or(place, |value| value.span);
        let is_alone = settings.listen.is_empty() && settings.connect.is_empty() && !settings.multicast;
        match settings.mode {
            _ if !self.wrong.is_empty() => {}
            NetworkMode::Client if settings.connect.is_empty() => {
                self.add(
                    span,
                    "a client connects to a router, and none is named",
                    "add connect = [\"tcp/127.0.0.1:7447\"]",
                );
            }
            NetworkMode::Client if !settings.listen.is_empty() => {
                self.add(span, "a client does not listen", "take `listen` away, or write mode = \"peer\"");
            }
            NetworkMode::Router if settings.listen.is_empty() => {
                self.add(
                    span,
                    "a router listens, and no endpoint is named",
                    "add listen = [\"tcp/127.0.0.1:7447\"]",
                );
            }
            _ if is_alone => {
                let help = "add listen = [\"tcp/127.0.0.1:7447\"], or `connect`, or take [network] away";
                self.add(span, "[network] reaches no other program: it names no endpoint", help);
            }
            _ => {}
        }
    }

    fn endpoints(&mut self, table: &Table, name: &str) -> Vec<NetworkEndpoint> {
        let mut endpoints = Vec::new();
        for item in self.items(table, name, "tcp/127.0.0.1:7447") {
            let (text, trusted) = match &item.value {
                Value::Table(entries) => (self.endpoint_text(entries, &item), self.is_trusted(entries)),
                _ => (item.as_str().map(ToOwned::to_owned), false),
            };
            let Some(text) = text else {
                let help = format!("write {name} = [\"tcp/127.0.0.1:7447\"]");
                self.add(item.span, format!("`{name}` takes endpoints, found {}", item.describe()), &help);
                continue;
            };
            match NetworkEndpoint::parse(&text) {
                Err((message, help)) => self.add(item.span, message, help),
                Ok(endpoint) if !endpoint.is_encrypted() && !endpoint.is_loopback() && !trusted => {
                    let message = format!(
                        "`{text}` speaks to other machines in clear text, where others read and forge values"
                    );
                    let help = format!(
                        "use `quic/` with certificates; or if the network is trusted: {{ endpoint = \"{text}\", \
                         trusted = true }}; or stay on this machine: tcp/127.0.0.1"
                    );
                    self.add(item.span, message, &help);
                }
                Ok(endpoint) => endpoints.push(NetworkEndpoint { place: Some(item.span), ..endpoint }),
            }
        }
        endpoints
    }

    /// Returns the endpoint of `{ endpoint = "tcp/…", trusted = true }`.
    fn endpoint_text(&mut self, table: &Table, item: &Spanned<Value>) -> Option<String> {
        self.unknown_keys(table, "of an endpoint", &["endpoint", "trusted"]);
        let text = table.get("endpoint").and_then(|value| value.as_str()).map(ToOwned::to_owned);
        if text.is_none() {
            self.add(
                item.span,
                "an endpoint lacks `endpoint`",
                "write { endpoint = \"tcp/10.0.0.7:7447\", trusted = true }",
            );
        }
        Some(text.unwrap_or_else(|| "tcp/127.0.0.1:7447".into()))
    }

    fn is_trusted(&mut self, table: &Table) -> bool {
        let Some(value) = table.get("trusted") else { return false };
        if value.as_bool().is_none() {
            self.add(
                value.span,
                format!("`trusted` takes true or false, found {}", value.describe()),
                "write trusted = true",
            );
        }
        // An invalid setting needs no second message.
        value.as_bool().unwrap_or(true)
    }

    /// Reads the flag `multicast`.
    /// `true` is refused, as it connects to machines that the file does not name.
    fn multicast(&mut self, table: &Table) -> bool {
        let Some(value) = table.get("multicast") else { return false };
        let trusted = match &value.value {
            Value::Table(entries) => {
                self.unknown_keys(entries, "in [network.multicast]", &["trusted"]);
                self.is_trusted(entries)
            }
            Value::Bool(false) => return false,
            Value::Bool(true) => false,
            _ => {
                let message = format!("`multicast` takes true or false, found {}", value.describe());
                self.add(value.span, message, "write multicast = false");
                return false;
            }
        };
        if !trusted {
            let message = "multicast connects in clear text to machines that the file does not name";
            let help =
                "if the network is trusted: multicast = { trusted = true }; or name endpoints in `connect`";
            self.add(value.span, message, help);
        }
        trusted
    }

    fn patterns(&mut self, table: &Table, name: &str) -> Vec<Pattern> {
        let mut patterns = Vec::new();
        for item in self.items(table, name, "localizer/**") {
            match item.as_str().map(Pattern::parse) {
                Some(Ok(pattern)) => patterns.push(pattern),
                Some(Err(error)) => self.add(item.span, error.to_string(), "such as \"localizer/**\""),
                None => {
                    let message = format!("`{name}` takes patterns of properties, found {}", item.describe());
                    self.add(item.span, message, "such as \"localizer/**\"");
                }
            }
        }
        patterns
    }

    fn items(&mut self, table: &Table, name: &str, example: &str) -> Vec<Spanned<Value>> {
        let Some(value) = table.get(name) else { return Vec::new() };
        let items = value.as_list().map(<[_]>::to_vec);
        if items.is_none() {
            let message = format!("`{name}` takes a list, found {}", value.describe());
            self.add(value.span, message, &format!("write {name} = [\"{example}\"]"));
        }
        items.unwrap_or_default()
    }
}
