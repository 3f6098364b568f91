//! `[record]`: recording of the agent.

use std::path::PathBuf;

use slate_blackboard::Pattern;

use super::problems::Problems;
use super::source::{Sources, Spanned};
use super::value::{Table, Value};
use crate::error_code::ErrorCode;

const KNOWN: [&str; 9] =
    ["enabled", "file", "select", "exclude", "rules", "chunk", "within", "buffer", "flight"];

/// Recording of the agent.
#[derive(Clone, Debug)]
pub struct Record {
    /// True if it records from the start.
    pub enabled: bool,
    /// File; the default is `run.mcap` beside the report.
    pub file: Option<Spanned<PathBuf>>,
    /// Recorded values.
    pub selection: RecordSelection,
    /// Size at which a chunk of the file is closed, with its checksum, bytes.
    pub chunk: u64,
    /// Wall-clock time after which a smaller chunk is closed, ns.
    pub within: u64,
    /// Largest backlog of each writing thread, bytes.
    /// For large values the limit may be sixteen times as large, up to 32 MiB.
    pub buffer: u64,
    /// Flight recorder.
    pub flight: Flight,
}

impl Default for Record {
    /// All values of all properties, on request only.
    fn default() -> Self {
        Self {
            enabled: false,
            file: None,
            selection: RecordSelection::default(),
            chunk: 64 << 10,
            within: 100_000_000,
            buffer: 4 << 20,
            flight: Flight::default(),
        }
    }
}

/// Selection of the recorded properties and values.
#[derive(Clone, Debug)]
pub struct RecordSelection {
    /// The properties.
    pub select: Vec<Pattern>,
    /// Excluded properties among them.
    pub exclude: Vec<Pattern>,
    /// Rules for properties of which not every value is recorded.
    /// The first rule for a property counts.
    pub rules: Vec<RecordRule>,
}

impl Default for RecordSelection {
    /// Returns the selection of every value of every property.
    fn default() -> Self {
        Self { select: Pattern::parse("/**").into_iter().collect(), exclude: Vec::new(), rules: Vec::new() }
    }
}

/// Rule on the recorded values of some properties.
#[derive(Clone, Debug)]
pub struct RecordRule {
    /// The properties.
    pub select: Vec<Pattern>,
    /// Minimum time between two values, ns of the agent's time; 0 for each value.
    pub period: u64,
    /// True to record only values that differ from the last recorded one.
    pub on_change: bool,
}

/// Flight recorder: the last seconds in memory, saved after an event.
#[derive(Clone, Debug)]
pub struct Flight {
    /// True if the last seconds are kept.
    pub enabled: bool,
    /// Longest time span in memory, ns of the agent's time.
    pub keep: u64,
    /// Memory limit, bytes.
    pub memory: u64,
    /// Largest values kept; properties with larger ones are excluded, bytes.
    pub largest: u64,
    /// Events that save it.
    pub triggers: Vec<FlightTrigger>,
    /// Minimum time between two saves by a trigger, ns of the agent's time.
    pub every: u64,
    /// Number of files kept of a trigger; the oldest one is deleted.
    pub files: u64,
}

impl Default for Flight {
    /// Last seconds in memory, saved on request only.
    fn default() -> Self {
        Self {
            enabled: true,
            keep: 60_000_000_000,
            memory: 64 << 20,
            largest: 64 << 10,
            triggers: Vec::new(),
            every: 10_000_000_000,
            files: 4,
        }
    }
}

/// Event that saves the flight recorder's last seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FlightTrigger {
    /// A module panicked, does not return, or has failed for good.
    Fault,
    /// An actuator was stopped.
    Stop,
    /// A reflex took over.
    Reflex,
}

impl FlightTrigger {
    /// All events, by their names in a configuration.
    pub const NAMES: [(&str, Self); 3] =
        [("fault", Self::Fault), ("stop", Self::Stop), ("reflex", Self::Reflex)];

    /// Name.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }
}

/// Reader of `[record]`.
pub(super) struct RecordReader<'a> {
    pub(super) sources: &'a Sources,
    pub(super) problems: &'a mut Problems,
}

impl RecordReader<'_> {
    pub(super) fn record(&mut self, root: &Table) -> Record {
        let mut record = Record::default();
        let Some(table) = self.problems.table(root, "record") else { return record };
        self.problems.unknown_keys(table, "in [record]", &KNOWN);
        record.enabled = self.problems.flag(table, "enabled").is_some_and(|flag| flag.value);
        let file = self.problems.text(table, "file", "run.mcap");
        record.file = file.map(|file| self.sources.beside(&file));
        if let Some(select) = self.patterns(table, "select") {
            record.selection.select = select;
        }
        record.selection.exclude = self.patterns(table, "exclude").unwrap_or_default();
        record.selection.rules = self.rules(table);
        self.limited_size(table, "chunk", &mut record.chunk);
        self.limited_size(table, "buffer", &mut record.buffer);
        record.within = self.problems.duration(table, "within").map_or(record.within, |within| within.value);
        self.flight(table, &mut record);
        record
    }

    fn limited_size(&mut self, table: &Table, name: &str, place: &mut u64) {
        let Some(value) = table.get(name) else { return };
        let size = self.problems.size(name, value).unwrap_or(*place);
        if size > LARGEST {
            let help = format!("write a size such as {name} = \"4MiB\"");
            self.problems.add(
                value.span,
                ErrorCode::Value.of(format!("`{name}` can't be more than 256 MiB")),
                help,
            );
        }
        *place = size;
    }

    fn rules(&mut self, table: &Table) -> Vec<RecordRule> {
        let Some(value) = table.get("rules") else { return Vec::new() };
        let items = value.as_list().unwrap_or(std::slice::from_ref(value));
        items.iter().filter_map(|item| self.rule(item)).collect()
    }

    fn rule(&mut self, item: &Spanned<Value>) -> Option<RecordRule> {
        let Some(rule) = item.as_table() else {
            self.problems.wrong_type("rules", item, "a table", RULE);
            return None;
        };
        self.problems.unknown_keys(rule, "in [[record.rules]]", &["select", "rate", "on_change"]);
        let select = self.patterns(rule, "select").unwrap_or_default();
        if rule.get("select").is_none() {
            self.problems.add(item.span, "a rule of [record] has no `select`", RULE);
        }
        let on_change = self.problems.flag(rule, "on_change").is_some_and(|flag| flag.value);
        let rate = rule.get("rate");
        if rate.is_none() && !on_change {
            self.problems.add(item.span, "a rule of [record] has neither `rate` nor `on_change`", RULE);
        }
        let number = rate.and_then(|rate| Some((rate.span, self.problems.number("rate", rate)?)));
        let period = number.map(|(span, rate)| {
            period(rate).unwrap_or_else(|| {
                self.problems.add(span, RATE, "write values a second, such as rate = 5.0");
                0
            })
        });
        Some(RecordRule { select, period: period.unwrap_or(0), on_change })
    }

    fn flight(&mut self, table: &Table, record: &mut Record) {
        let Some(table) = self.problems.table(table, "flight") else { return };
        let known = ["enabled", "keep", "memory", "largest", "trigger", "every", "files"];
        self.problems.unknown_keys(table, "in [record.flight]", &known);
        let flight = &mut record.flight;
        // A section enables it, with files of faults and stops.
        flight.enabled = self.problems.flag(table, "enabled").is_none_or(|flag| flag.value);
        flight.triggers = vec![FlightTrigger::Fault, FlightTrigger::Stop];
        flight.keep = self.problems.duration(table, "keep").map_or(flight.keep, |keep| keep.value);
        flight.every = self.problems.duration(table, "every").map_or(flight.every, |every| every.value);
        if let Some(value) = table.get("memory") {
            let size = self.problems.size("memory", value).unwrap_or(flight.memory);
            if !(LEAST_MEMORY..=MOST_MEMORY).contains(&size) {
                let help = "write a size such as memory = \"64MiB\"";
                self.problems.add(value.span, "`memory` is from 1 MiB to 16 GiB", help);
            }
            flight.memory = size;
        }
        self.limited_size(table, "largest", &mut flight.largest);
        if let Some(value) = table.get("trigger") {
            let items = value.as_list().unwrap_or(std::slice::from_ref(value));
            let choice = |item| Some(self.problems.choice("trigger", item, &FlightTrigger::NAMES)?.value);
            flight.triggers = items.iter().filter_map(choice).collect();
            flight.triggers.sort_unstable();
            flight.triggers.dedup();
        }
        if let Some(value) = table.get("files") {
            match value.as_integer().and_then(|files| u64::try_from(files).ok()).filter(|files| *files > 0) {
                Some(files) => flight.files = files,
                None => self.problems.add(value.span, "`files` is a whole number from 1", "write files = 4"),
            }
        }
    }

    fn patterns(&mut self, table: &Table, name: &str) -> Option<Vec<Pattern>> {
        let texts = self.problems.texts(name, table.get(name)?, "/r2/**");
        let pattern = |text: Spanned<String>| {
            let wrong = |error: slate_blackboard::PatternError| {
                self.problems.add(text.span, error.to_string(), format!("write {name} = [\"/r2/**\"]"));
            };
            Pattern::parse(&text.value).map_err(wrong).ok()
        };
        Some(texts.into_iter().filter_map(pattern).collect())
    }
}

const RULE: &str = "write [[record.rules]] with select = \"/**/scan\", and rate = 5.0 or on_change = true";

/// Rule on rates, for messages.
pub const RATE: &str = "`rate` is from 0.001 to 1e9 values a second";

/// Returns the period of a rate in values per second, ns.
/// `None` for rates that no agent has.
pub fn period(rate: f64) -> Option<u64> {
    (0.001..=1e9).contains(&rate).then(|| (1e9 / rate).round() as u64)
}

/// Largest chunk that readers of such files accept, bytes.
const LARGEST: u64 = 256 << 20;

/// Limits of the flight recorder's memory, bytes.
const LEAST_MEMORY: u64 = 1 << 20;
const MOST_MEMORY: u64 = 16 << 30;
