use std::fmt::{self, Write};
use std::sync::Arc;

use serde::ser::{Serialize, SerializeMap, Serializer};
use slate_module::Level;

use slate_configuration::printable_text;

/// Separator before each field of a message: ASCII's unit separator.
const SEPARATOR: char = '\u{1f}';

/// Line of the log.
///
/// Its [`Display`](fmt::Display) is one line for people. As JSON it is an object of `time` (nanoseconds), `level`,
/// `module` and `text`, with `fields` and `dropped` where there are any.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// Agent's time, ns.
    pub time: u64,
    /// Severity.
    pub level: Level,
    /// Module that logs, or `agent`.
    pub module: Arc<str>,
    /// Message.
    pub text: String,
    /// Values that belong to it, by key, in the order of the message.
    pub fields: Vec<(String, String)>,
    /// Number of lines of the same module dropped right before this one.
    pub dropped: u64,
}

impl Record {
    /// Returns a line without fields.
    pub fn new(time: u64, level: Level, module: &Arc<str>, text: impl Into<String>) -> Self {
        let module = Arc::clone(module);
        Self { time, level, module, text: text.into(), fields: Vec::new(), dropped: 0 }
    }

    /// Parses a module's message: the text, then `key=value` after each separator.
    /// The separator is the unit separator (0x1f).
    pub fn from_message(time: u64, level: Level, module: &Arc<str>, message: &str) -> Self {
        let mut parts = message.split(SEPARATOR);
        let mut record = Self::new(time, level, module, parts.next().unwrap_or_default());
        let field = |part: &str| {
            let (key, value) = part.split_once('=').unwrap_or((part, ""));
            (key.to_owned(), value.to_owned())
        };
        record.fields = parts.filter(|part| !part.is_empty()).map(field).collect();
        record
    }

    /// Formats the text with its fields, without time, level and module, on one line.
    pub fn message(&self) -> String {
        let mut message = printable_text(&self.text).into_owned();
        for (key, value) in &self.fields {
            // Writing to a String can't fail.
            let _ = write!(message, " {}={}", printable_text(key), printable_text(value));
        }
        match self.dropped {
            0 => {}
            1 => message.push_str(" (1 line before this was dropped)"),
            count => {
                let _ = write!(message, " ({count} lines before this were dropped)");
            }
        }
        message
    }
}

impl fmt::Display for Record {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (time, level) = (self.time as f64 * 1e-9, level_name(self.level));
        write!(f, "{time:10.3} {level:5} {}: {}", self.module, self.message())
    }
}

impl Serialize for Record {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("time", &self.time)?;
        map.serialize_entry("level", level_name(self.level))?;
        map.serialize_entry("module", &*self.module)?;
        map.serialize_entry("text", &self.text)?;
        if !self.fields.is_empty() {
            map.serialize_entry("fields", &Fields(&self.fields))?;
        }
        if self.dropped > 0 {
            map.serialize_entry("dropped", &self.dropped)?;
        }
        map.end()
    }
}

/// Fields as a JSON object, in the order of the message.
struct Fields<'a>(&'a [(String, String)]);

impl Serialize for Fields<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, value)| (key, value)))
    }
}

/// Returns the name of a level in a configuration.
pub(super) fn level_name(level: Level) -> &'static str {
    match level {
        Level::Error => "error",
        Level::Warn => "warn",
        Level::Info => "info",
        Level::Debug => "debug",
        Level::Trace => "trace",
    }
}
