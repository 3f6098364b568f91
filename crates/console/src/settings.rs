//! Table `[console]` of a configuration.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::path::PathBuf;

use slate_blackboard::Pattern;
use slate_runtime::Message;
use slate_runtime::configuration::{Configuration, Diagnostic, Report, Span, Spanned, Table, Value};
use slate_runtime::printable;
use slate_sorted::SortedMap;

use crate::{Role, TABLE};

/// Settings of an agent's console over HTTP.
///
/// ```
/// use slate_console::Settings;
/// use slate_runtime::configuration::{Configuration, Options};
///
/// let options = Options { extra_tables: vec!["console".into()], ..Options::default() };
/// let here = Configuration::from_text("a.toml", "[console]\nport = 7878", &options)?;
/// assert_eq!(Settings::of(&here)?.port, Some(7878));
/// let open = Configuration::from_text("a.toml", "[console]\naddresses = [\"0.0.0.0\"]", &options)?;
/// assert!(Settings::of(&open).is_err_and(|refusal| refusal.to_string().contains("TLS")));
/// # Ok::<(), slate_runtime::configuration::Report>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Console switch; `None` if the configuration does not set it.
    pub enabled: Option<bool>,
    /// Port; 0 for any free one, and without one 7878 or any free one.
    pub port: Option<u16>,
    /// Addresses on which it listens; by default those of this machine alone.
    pub addresses: Vec<IpAddr>,
    /// Parameters that an operator may set, such as `/r2/knowledge/params/goal_x`.
    /// Only a developer may set all others.
    pub operable: Vec<Pattern>,
    /// Host names for browsers, beside `localhost` and the addresses.
    pub names: Vec<String>,
    /// Pages of others that may open WebSockets, such as `https://app.foxglove.dev`.
    pub origins: Vec<String>,
    /// Files with the secrets of roles; without any, new secrets are made.
    pub tokens: SortedMap<Role, PathBuf>,
    /// Files with the certificate and its key, in PEM.
    pub certificate: Option<(PathBuf, PathBuf)>,
    /// Folder with the files of the page, instead of those that are built in.
    pub assets: Option<PathBuf>,
}

impl Default for Settings {
    /// Returns the settings of a console for this machine only.
    fn default() -> Self {
        Self {
            enabled: None,
            port: None,
            addresses: vec![Ipv4Addr::LOCALHOST.into(), Ipv6Addr::LOCALHOST.into()],
            operable: Vec::new(),
            names: Vec::new(),
            origins: Vec::new(),
            tokens: SortedMap::new(),
            certificate: None,
            assets: None,
        }
    }
}

const TABLE_KEYS: [&str; 10] = [
    "enabled",
    "port",
    "addresses",
    "names",
    "operable",
    "origins",
    "tokens",
    "certificate",
    "key",
    "assets",
];

impl Settings {
    /// Reads the table `[console]` of a configuration.
    /// The configuration must have been read with it as one of
    /// [`extra_tables`](slate_runtime::configuration::Options::extra_tables).
    ///
    /// # Errors
    /// Everything that is wrong with it, and addresses that others reach without TLS and tokens.
    pub fn of(configuration: &Configuration) -> Result<Self, Report> {
        let Some(root) = configuration.value(TABLE) else { return Ok(Self::default()) };
        let mut reader = SettingsReader { configuration, wrong: Vec::new() };
        let settings = reader.settings(root);
        if reader.wrong.is_empty() { Ok(settings) } else { Err(Report::from(reader.wrong)) }
    }
}

struct SettingsReader<'c> {
    configuration: &'c Configuration,
    wrong: Vec<Diagnostic>,
}

impl SettingsReader<'_> {
    fn add(&mut self, span: Span, message: impl Into<Message>, help: &str) {
        self.wrong.push(self.configuration.diagnostic(span, message, Some(help.into())));
    }

    fn settings(&mut self, root: &Spanned<Value>) -> Settings {
        let mut settings = Settings::default();
        let Some(table) = root.as_table() else {
            self.add(
                root.span,
                format!("`{TABLE}` is a table, found {}", root.describe()),
                "write [console]",
            );
            return settings;
        };
        self.wrong.extend(self.configuration.unknown_keys(table, "in [console]", &TABLE_KEYS));
        if let Some(value) = table.get("enabled") {
            settings.enabled = value.as_bool();
            if settings.enabled.is_none() {
                self.add(value.span, "`enabled` takes true or false", "write enabled = false");
            }
        }
        if let Some(value) = table.get("port") {
            settings.port = value.as_integer().and_then(|port| u16::try_from(port).ok());
            if settings.port.is_none() {
                let help = "write port = 7878; port 0 is any that is free";
                self.add(value.span, "`port` takes a number from 0 to 65535", help);
            }
        }
        self.addresses(table, &mut settings);
        settings.names =
            self.texts(table, "names", "robot.local").into_iter().map(|(name, _)| name).collect();
        for (text, span) in self.texts(table, "operable", "/r2/knowledge/params/goal_x") {
            match Pattern::parse(&text) {
                Ok(pattern) => settings.operable.push(pattern),
                Err(error) => self.add(span, error.to_string(), "such as /r2/knowledge/params/goal_x"),
            }
        }
        settings.origins = self.origins(table);
        if let Some(value) = table.get("tokens") {
            settings.tokens = self.tokens(value);
        }
        let mut file = |name: &str| self.file(table, name);
        settings.certificate = file("certificate").zip(file("key"));
        settings.assets = file("assets");
        self.check_files(table, &settings);
        self.check_exposure(table, &settings);
        settings
    }

    fn addresses(&mut self, table: &Table, settings: &mut Settings) {
        let Some(value) = table.get("addresses") else { return };
        settings.addresses.clear();
        for (address, span) in self.texts(table, "addresses", "0.0.0.0") {
            match address.parse() {
                Ok(address) => settings.addresses.push(address),
                Err(_) => self.add(span, format!("`{address}` is no IP address"), "such as 192.168.0.7"),
            }
        }
        if settings.addresses.is_empty() && value.as_list().is_some_and(<[_]>::is_empty) {
            self.add(value.span, "`addresses` names none", "take it away, or write enabled = false");
        }
    }

    fn origins(&mut self, table: &Table) -> Vec<String> {
        let texts = self.texts(table, "origins", "https://app.foxglove.dev");
        for (origin, span) in &texts {
            let rest = origin.strip_prefix("https://").or(origin.strip_prefix("http://"));
            if rest.is_none_or(|rest| rest.is_empty() || rest.contains('/')) {
                let help =
                    "an origin is a scheme, a host and perhaps a port, such as https://app.foxglove.dev";
                self.add(*span, format!("`{origin}` is no origin"), help);
            }
        }
        texts.into_iter().map(|(origin, _)| origin).collect()
    }

    /// Checks that a page is in its folder, and that a certificate has its key.
    fn check_files(&mut self, table: &Table, settings: &Settings) {
        if let (Some(assets), Some(value)) = (&settings.assets, table.get("assets"))
            && !assets.join("index.html").is_file()
        {
            let message = format!("{} has no index.html", printable(assets));
            let help = "name a folder such as crates/console/web, from where the agent is started";
            self.add(value.span, message, help);
        }
        for (one, other) in [("certificate", "key"), ("key", "certificate")] {
            if let (Some(value), None) = (table.get(one), table.get(other)) {
                let message = format!("[console] has `{one}` and no `{other}`");
                self.add(value.span, message, "they belong together");
            }
        }
    }

    /// Checks that an exposed console has both TLS and tokens.
    fn check_exposure(&mut self, table: &Table, settings: &Settings) {
        let Some(value) = table.get("addresses") else { return };
        let Some(open) = settings.addresses.iter().find(|address| !address.is_loopback()) else { return };
        let lacks = match (settings.certificate.is_some(), settings.tokens.is_empty()) {
            (true, false) => return,
            (true, true) => "has no tokens",
            (false, false) => "has no TLS",
            (false, true) => "has neither TLS nor tokens",
        };
        let help = "give `certificate`, `key` and a table `tokens` with a file for each role; or leave the addresses \
                    away, and reach this machine by `ssh -L 7878:localhost:7878`";
        self.add(value.span, format!("others reach {open}, and the console {lacks}"), help);
    }

    fn tokens(&mut self, value: &Spanned<Value>) -> SortedMap<Role, PathBuf> {
        let Some(table) = value.as_table() else {
            self.add(value.span, "`tokens` is a table", "write tokens.operator = \"operator.token\"");
            return SortedMap::new();
        };
        let known = Role::ALL.map(Role::name);
        self.wrong.extend(self.configuration.unknown_keys(table, "in [console.tokens]", &known));
        if known.iter().all(|name| table.get(name).is_none()) {
            self.add(value.span, "`tokens` names no file", "write tokens.operator = \"operator.token\"");
        }
        Role::ALL.into_iter().filter_map(|role| Some((role, self.file(table, role.name())?))).collect()
    }

    fn file(&mut self, table: &Table, name: &str) -> Option<PathBuf> {
        let value = table.get(name)?;
        let path = value.as_str();
        if path.is_none() {
            self.add(value.span, format!("`{name}` takes the path of a file"), "such as \"console.pem\"");
        }
        path.map(|path| self.configuration.folder_of(value.span).join(path))
    }

    fn texts(&mut self, table: &Table, name: &str, example: &str) -> Vec<(String, Span)> {
        let Some(value) = table.get(name) else { return Vec::new() };
        let mut texts = Vec::new();
        let items = value.as_list();
        if items.is_none() {
            let help = format!("write {name} = [\"{example}\"]");
            self.add(
                value.span,
                format!("`{name}` takes a list of texts, found {}", value.describe()),
                &help,
            );
        }
        for item in items.unwrap_or_default() {
            match item.as_str() {
                Some(text) => texts.push((text.to_owned(), item.span)),
                None => {
                    self.add(item.span, format!("`{name}` takes texts"), &format!("such as \"{example}\""))
                }
            }
        }
        texts
    }
}
