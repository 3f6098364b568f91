//! Table `[network.read]`.

use slate_runtime::configuration::{ExternalDirection, ExternalLink, Report, Span, Spanned, Table, Value};
use slate_sorted::SortedMap;

use super::{NetworkSettings, NetworkSettingsReader};
use crate::key::{InputSource, check_key};
use crate::options::{ReadMode, ReadOptions, ReadRate, ReadValues, duration};

/// Network source of an input.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkInput {
    /// Source of the values.
    pub source: InputSource,
    /// Options of the values.
    pub options: ReadOptions,
    /// Place in the configuration.
    pub place: Option<Span>,
}

/// Property that is published at a key of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkOutput {
    /// Key.
    pub key: String,
    /// Path of the property.
    pub property: String,
    /// Place in the configuration.
    pub place: Option<Span>,
}

/// Beginning of the keys of agents.
const AGENT_PREFIX: &str = "slate/";

const LINK_HELP: &str = "write \"climate/outside\" = \"zenoh:demo/temperature\" or \"zenoh:demo/speed\" = \"r2/wheels/command\" in [links]";
const READ_HELP: &str =
    "write read.\"follower/target\" = \"slate://base/mission/target\", or = \"zenoh:demo/target\"";

/// Keys of an input with options.
const INPUT_KEYS: [&str; 5] = ["from", "rate", "interval", "mode", "values"];

impl NetworkSettingsReader<'_> {
    pub(super) fn readings(&mut self, table: &Table) -> SortedMap<String, NetworkInput> {
        let mut readings = SortedMap::new();
        let Some(value) = table.get("read") else { return readings };
        let Some(inputs) = value.as_table() else {
            self.add(
                value.span,
                format!("`read` is a table of inputs, found {}", value.describe()),
                READ_HELP,
            );
            return readings;
        };
        for (input, entry) in inputs.iter() {
            let path = match self.configuration.own_path(input) {
                Ok(path) => path,
                Err(report) => {
                    let first = report.diagnostics().first();
                    self.add(entry.key, first.map_or("", |first| first.message()).to_owned(), READ_HELP);
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
                self.unknown_keys(table, "of an input", &INPUT_KEYS);
                (table.get("from"), self.options(table)?)
            }
            None => (Some(value), ReadOptions::default()),
        };
        let Some(text) = text else {
            self.add(value.span, "an input lacks `from`", READ_HELP);
            return None;
        };
        let source = match text.as_str().map(InputSource::parse) {
            Some(Ok(source)) => source,
            Some(Err(message)) => {
                self.add(text.span, message, READ_HELP);
                return None;
            }
            None => {
                self.add(text.span, format!("an input reads a URL, found {}", text.describe()), READ_HELP);
                return None;
            }
        };
        self.input(source, options, value.span)
    }

    fn input(&mut self, source: InputSource, options: ReadOptions, place: Span) -> Option<NetworkInput> {
        if matches!(source, InputSource::Key(_)) && options.mode == ReadMode::BestEffort {
            let message =
                format!("`{source}` has no mode \"best-effort\": its writer is not an agent, and decides");
            let help = "leave `mode` out, or name a property of an agent, slate://AGENT/PATH";
            self.add(place, message, help);
            return None;
        }
        Some(NetworkInput { source, options, place: Some(place) })
    }

    /// Adds the key that a link names.
    pub(super) fn link(&mut self, link: &ExternalLink, settings: &mut NetworkSettings) {
        let (path, span) = (&link.path.value, link.other.span);
        let key = link.other.value.address.clone();
        let known = if link.direction == ExternalDirection::In { &INPUT_KEYS[1..] } else { &[] };
        self.unknown_keys(&link.options, "of a link to the network", known);
        if let Some(reason) = check_key(&key) {
            return self.add(span, format!("`{key}` is not a key of Zenoh: {reason}"), LINK_HELP);
        }
        match link.direction {
            ExternalDirection::In => {
                let Some(options) = self.options(&link.options) else { return };
                let Some(input) = self.input(InputSource::Key(key), options, span) else { return };
                if let Some(other) = settings.read.insert(path.clone(), input) {
                    let message = format!("/{path} reads two sources, and the other is `{}`", other.source);
                    self.add(link.path.span, message, "an input has one source: take one away");
                }
            }
            ExternalDirection::Out if key.starts_with(AGENT_PREFIX) => {
                let message = format!("`{key}` is a key of an agent, which publishes there itself");
                self.add(
                    span,
                    message,
                    "name another key, or link the input in the configuration of that agent",
                );
            }
            ExternalDirection::Out => {
                settings.write.push(NetworkOutput {
                    key,
                    property: path.clone(),
                    place: Some(link.path.span),
                });
            }
        }
    }

    /// Returns the error of a link to a network that no table describes.
    pub(super) fn without_table(&self, link: &ExternalLink) -> Report {
        let message =
            format!("`{}` needs a network, and the configuration has no [network]", link.other.value);
        let help = "add [network] with `listen` or `connect`, such as connect = [\"tcp/127.0.0.1:7447\"]";
        Report::from(self.configuration.diagnostic(link.other.span, message, Some(help.into())))
    }

    /// Reads the options of an input; `None` after an error.
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
                let help = "leave one out: `rate` is for sampling, `interval` for values sent on change";
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

    /// Reads a period or interval, ns, also as a frequency.
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
