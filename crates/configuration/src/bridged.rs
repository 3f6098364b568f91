//! Ports that a bridge to other programs reads or fills.
//! The table of the bridge names them.

use crate::{Configuration, Spanned, Table, Value};

/// Tables of `[ros2]` whose keys are inputs.
const FILLED: [&str; 2] = ["read", "frames"];

/// Tables of `[ros2]` whose entries name ports, with the keys for them.
const NAMED: [(&str, &[&str]); 3] = [
    ("write", &["from"]),
    ("serve", &["to", "result", "feedback", "cancel"]),
    ("call", &["from", "response", "result", "feedback", "cancel"]),
];

/// Tables of bridges.
const BRIDGES: [&str; 3] = ["dds", "ros1", "ros2"];

/// Ports of a configuration that a bridge reads or fills.
pub struct BridgedPorts<'c>(pub &'c Configuration);

impl<'c> BridgedPorts<'c> {
    /// Returns true if the messages of an outbox leave the agent over a bridge.
    pub fn is_outgoing(&self, outbox: &str) -> bool {
        self.is_named(outbox, "call", &["from", "cancel"])
    }

    /// Returns true if a bridge reads or fills a port.
    pub fn has(&self, port: &str) -> bool {
        FILLED.iter().any(|table| self.entries(table).any(|(key, _)| self.is_path(key, port)))
            || NAMED.iter().any(|(table, keys)| self.is_named(port, table, keys))
    }

    fn is_named(&self, port: &str, table: &str, keys: &[&str]) -> bool {
        let names = |entry: &Spanned<Value>| match entry.as_table() {
            Some(own) => keys.iter().any(|key| own.get(key).is_some_and(|name| self.is_text(name, port))),
            None => self.is_text(entry, port),
        };
        self.entries(table).any(|(_, entry)| names(entry))
    }

    fn entries(&self, table: &str) -> impl Iterator<Item = (&str, &Spanned<Value>)> {
        let bridges = BRIDGES.iter().filter_map(|name| self.0.table(name)?.get(table)?.as_table());
        bridges.flat_map(Table::iter).map(|(key, entry)| (key, &entry.value))
    }

    fn is_text(&self, name: &Spanned<Value>, port: &str) -> bool {
        let name = match name.as_table() {
            // A port with options of its own.
            Some(own) => own.get("to").and_then(|name| name.as_str()),
            None => name.as_str(),
        };
        name.is_some_and(|name| self.is_path(name, port))
    }

    fn is_path(&self, name: &str, port: &str) -> bool {
        self.0.own_path(name).is_ok_and(|path| path == port)
    }
}
