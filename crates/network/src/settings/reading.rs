//! The table `[network.read]`.

use std::collections::BTreeMap;

use slate_runtime::configuration::{Span, Spanned, Table, Value};

use super::NetworkSettingsReader;
use crate::key::InputSource;
use crate::options::{ReadMode, ReadOptions, ReadRate, ReadValues, duration};

/// What an input reads.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkInput {
    /// Where the values come from.
    pub source: InputSource,
    /// What is asked of them.
    pub options: ReadOptions,
    /// Where it is written in the configuration.
    pub place: Option<Span>,
}

const EXAMPLE: &str =
    "write read.\"follower/target\" = \"slate://base/mission/target\", or = \"zenoh:demo/target\"";

/// Keys of an input with options.
const KEYS: [&str; 5] = ["from", "rate", "interval", "mode", "values"];

impl NetworkSettingsReader<'_> {
    pub(super) fn readings(&mut self, table: &Table) -> BTreeMap<String, NetworkInput> {
        let mut readings = BTreeMap::new();
        let Some(value) = table.get("read") else { return readings };
        let Some(inputs) = value.as_table() else {
            self.add(value.span, format!("`read` is a table of inputs, found {}", value.describe()), EXAMPLE);
            return readings;
        };
        for (input, entry) in inputs.iter() {
            let path = match self.configuration.own_path(input) {
                Ok(path) => path,
                Err(report) => {
                    let first = report.diagnostics().first();
                    self.add(entry.key, first.map_or("", |first| first.message()).to_owned(), EXAMPLE);
                    continue;
                }
            };
            if let Some(reading) = self.reading(&entry.value) {
                readings.insert(path, reading);
            }
        }
        readings
    }

    fn reading(&mut self, value: &Spanned<Value>) -> Option<NetworkInput> {
        let (text, options) = match value.as_table() {
            Some(table) => {
                self.unknown_keys(table, "of an input", &KEYS);
                (table.get("from"), self.options(table)?)
            }
            None => (Some(value), ReadOptions::default()),
        };
        let Some(text) = text else {
            self.add(value.span, "an input lacks `from`", EXAMPLE);
            return None;
        };
        let source = match text.as_str().map(InputSource::parse) {
            Some(Ok(source)) => source,
            Some(Err(message)) => {
                self.add(text.span, message, EXAMPLE);
                return None;
            }
            None => {
                self.add(text.span, format!("an input reads a URL, found {}", text.describe()), EXAMPLE);
                return None;
            }
        };
        if matches!(source, InputSource::Key(_)) && options != ReadOptions::default() {
            let help = "leave the options out, or name a property of an agent, slate://AGENT/PATH";
            self.add(value.span, format!("`{source}` has no options: its writer is no agent"), help);
            return None;
        }
        Some(NetworkInput { source, options, place: Some(value.span) })
    }

    /// The options of an input; nothing after a mistake.
    fn options(&mut self, table: &Table) -> Option<ReadOptions> {
        let before = self.wrong.len();
        let mut options = ReadOptions::default();
        if let Some(mode) = self.word(
            table,
            "mode",
            &[("reliable", ReadMode::Reliable), ("best-effort", ReadMode::BestEffort)],
        ) {
            options.mode = mode;
        }
        if let Some(values) =
            self.word(table, "values", &[("newest", ReadValues::Newest), ("all", ReadValues::All)])
        {
            options.values = values;
        }
        let (rate, interval) = (self.time(table, "rate"), self.time(table, "interval"));
        match (rate, interval) {
            (Some(period), None) => options.rate = ReadRate::Every(period),
            (None, Some(interval)) => options.rate = ReadRate::OnChange { interval },
            (Some(_), Some(_)) => {
                let span = table.get("interval").map(|value| value.span);
                let help = "leave one out: a rate is how often the newest value comes, an interval is between values that come on change";
                if let Some(span) = span {
                    self.add(span, "an input has a `rate` or an `interval`", help);
                }
            }
            (None, None) => {}
        }
        let span = table.get("values").map(|value| value.span);
        if let (Err(message), Some(span)) = (options.check(), span) {
            self.add(span, message, "leave `values` out, or the other one");
        }
        (self.wrong.len() == before).then_some(options)
    }

    fn word<T: Copy>(&mut self, table: &Table, name: &str, known: &[(&str, T)]) -> Option<T> {
        let value = table.get(name)?;
        let found = known.iter().find(|(word, _)| value.as_str() == Some(word));
        if found.is_none() {
            let words: Vec<_> = known.iter().map(|(word, _)| format!("\"{word}\"")).collect();
            let message = format!("unknown `{name}`: {}", value.value);
            self.add(value.span, message, &format!("expected one of {}", words.join(", ")));
        }
        found.map(|(_, meaning)| *meaning)
    }

    /// A period or interval, ns, also as a frequency.
    fn time(&mut self, table: &Table, name: &str) -> Option<u64> {
        let value = table.get(name)?;
        let text = value.as_str().unwrap_or_default();
        let frequency = text.strip_suffix("Hz").and_then(|number| number.trim().parse::<f64>().ok());
        let time = match frequency {
            Some(frequency) if frequency > 0.0 => duration(&format!("{}ns", (1e9 / frequency).round())),
            _ => duration(text),
        };
        match time {
            Ok(time) => Some(time),
            Err(_) => {
                let message =
                    format!("`{name}` takes a time such as \"100ms\" or \"10Hz\", found {}", value.value);
                self.add(value.span, message, &format!("write {name} = \"100ms\""));
                None
            }
        }
    }
}
