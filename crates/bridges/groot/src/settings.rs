//! Table `[groot]` of a configuration.

use std::net::{IpAddr, Ipv4Addr};

use slate_runtime::configuration::{Configuration, Diagnostic, Report, Span, Spanned, Table, Value};

/// Name of the table.
pub const TABLE: &str = "groot";

/// Port that Groot2 asks unless told another one.
const PORT: u16 = 1667;

const KNOWN: [&str; 4] = ["port", "ports", "address", "trusted"];

/// Settings of the behavior trees for monitors, and their addresses.
///
/// ```
/// use slate_groot::{GrootSettings, ServedTrees};
/// use slate_runtime::configuration::{Configuration, Options};
///
/// let options = Options { extra_tables: vec!["groot".into()], ..Options::default() };
/// let read = |text: &str| Configuration::from_text("r2.toml", text, &options);
/// let settings = GrootSettings::of(&read("[groot]\nport = 1700")?)?.ok_or("no table")?;
/// assert_eq!(settings.trees, ServedTrees::Only(1700));
/// let open = read("[groot]\naddress = \"0.0.0.0\"")?;
/// assert!(GrootSettings::of(&open).is_err_and(|report| report.to_string().contains("trusted")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct GrootSettings {
    /// Address that it listens at; that of this machine alone unless told.
    pub address: IpAddr,
    /// Trees that are shown.
    pub trees: ServedTrees,
}

/// Trees that monitors see.
#[derive(Clone, Debug, PartialEq)]
pub enum ServedTrees {
    /// Tree of the only Plan with one, at this port; 0 for any free port.
    Only(u16),
    /// Trees of these Plans: path of the module, port, place in the configuration.
    Each(Vec<(String, u16, Span)>),
}

impl GrootSettings {
    /// Reads the table `[groot]`, which the configuration has as one of
    /// [`extra_tables`](slate_runtime::configuration::Options::extra_tables); `None` without it.
    ///
    /// # Errors
    /// Everything that is wrong with it, and addresses that others reach unless the network is trusted.
    pub fn of(configuration: &Configuration) -> Result<Option<Self>, Report> {
        let Some(root) = configuration.value(TABLE) else { return Ok(None) };
        let mut reader = GrootReader { configuration, errors: Vec::new() };
        let settings = reader.settings(root);
        if reader.errors.is_empty() { Ok(Some(settings)) } else { Err(Report::from(reader.errors)) }
    }
}

struct GrootReader<'c> {
    configuration: &'c Configuration,
    errors: Vec<Diagnostic>,
}

impl GrootReader<'_> {
    fn add(&mut self, span: Span, message: impl Into<String>, help: &str) {
        self.errors.push(self.configuration.diagnostic(span, message.into(), Some(help.into())));
    }

    fn settings(&mut self, root: &Spanned<Value>) -> GrootSettings {
        let mut settings =
            GrootSettings { address: Ipv4Addr::LOCALHOST.into(), trees: ServedTrees::Only(PORT) };
        let Some(table) = root.as_table() else {
            let message = format!("`{TABLE}` is a table, found {}", root.describe());
            self.add(root.span, message, "write [groot]");
            return settings;
        };
        self.errors.extend(self.configuration.unknown_keys(table, "in [groot]", &KNOWN));
        self.address(table, &mut settings);
        if let Some(value) = table.get("port")
            && let Some(port) = self.port(value)
        {
            settings.trees = ServedTrees::Only(port);
        }
        if let Some(value) = table.get("ports") {
            if table.get("port").is_some() {
                let help = "take `port` away: `ports` has a port for each Plan";
                self.add(value.span, "`port` and `ports` exclude each other", help);
            }
            settings.trees = ServedTrees::Each(self.ports(value));
        }
        settings
    }

    fn address(&mut self, table: &Table, settings: &mut GrootSettings) {
        let trusted = table.get("trusted");
        if let Some(value) = trusted.filter(|value| value.as_bool().is_none()) {
            let message = format!("`trusted` takes true or false, found {}", value.describe());
            self.add(value.span, message, "write trusted = true");
        }
        let Some(value) = table.get("address") else { return };
        let Some(address) = value.as_str().and_then(|text| text.parse().ok()) else {
            let help = "write address = \"0.0.0.0\" for all addresses of this machine";
            return self.add(value.span, "`address` takes an address such as \"127.0.0.1\"", help);
        };
        settings.address = address;
        let is_trusted = trusted.and_then(|value| value.as_bool()) == Some(true);
        if !settings.address.is_loopback() && !is_trusted {
            let message = "others reach this address, and monitors need no token: they see the tree and its blackboards";
            self.add(value.span, message, "write trusted = true if that is right; or take `address` away");
        }
    }

    fn port(&mut self, value: &Spanned<Value>) -> Option<u16> {
        let port = value.as_integer().and_then(|port| u16::try_from(port).ok());
        if port.is_none() {
            let help = "write port = 1667; port 0 is any that is free";
            self.add(value.span, "a port is a number from 0 to 65535", help);
        }
        port
    }

    fn ports(&mut self, value: &Spanned<Value>) -> Vec<(String, u16, Span)> {
        const HELP: &str = "write ports = { \"r2/planner\" = 1667, \"r3/planner\" = 1669 }";
        let Some(entries) = value.as_table().filter(|table| table.iter().next().is_some()) else {
            self.add(value.span, "`ports` is a table of Plans with their ports", HELP);
            return Vec::new();
        };
        let mut ports: Vec<(String, u16, Span)> = Vec::new();
        for (name, entry) in entries.iter() {
            let Some(port) = self.port(&entry.value) else { continue };
            if port != 0 && ports.iter().any(|(_, other, _)| *other == port) {
                let message = format!("two Plans have the port {port}");
                self.add(entry.value.span, message, HELP);
            }
            match self.configuration.own_path(name) {
                Ok(path) => ports.push((path, port, entry.key)),
                Err(_) => self.add(entry.key, format!("`{name}` is not a path of a module"), HELP),
            }
        }
        ports
    }
}
