use slate_blackboard::Url;

use super::external::{ExternalDirection, ExternalLink, ExternalUrl};
use super::model::{Compression, Filter, Link, LinkMode, LinkPolicy, LinkRate, Transport, Wiring};
use super::path::absolute;
use super::problems::Problems;
use super::senders::{UNNAMED, is_of_senders};
use super::source::{Span, Spanned};
use super::value::{Table, TableEntry, Value};
use crate::error_code::ErrorCode;

/// Options of a link.
const KEYS: [&str; 12] = [
    "from",
    "previous",
    "stale",
    "every",
    "when",
    "policy",
    "window",
    "carrier",
    "mode",
    "rate",
    "interval",
    "compression",
];

/// Links of the table `[links]`.
#[derive(Default)]
pub(super) struct WrittenLinks {
    /// Links by destination.
    pub(super) links: Vec<Link>,
    /// Links to and from external programs, which are not agents.
    pub(super) external: Vec<ExternalLink>,
}

impl WrittenLinks {
    /// Returns the place of the link of a whole input.
    pub(super) fn place_of(&self, input: &str) -> Option<Span> {
        let link = self.links.iter().find(|link| link.to.value == input).map(|link| link.to.span);
        let is_it = |link: &&ExternalLink| link.fills(input) && link.path.value == input;
        link.or_else(|| self.external.iter().find(is_it).map(|link| link.path.span))
    }

    /// Removes the link of an input.
    pub(super) fn remove(&mut self, input: &str) {
        self.links.retain(|link| link.to.value != input);
        self.external.retain(|link| !(link.fills(input) && link.path.value == input));
    }
}

/// Reader of `[links]`.
pub(super) struct LinkReader<'a> {
    problems: &'a mut Problems,
    agent: &'a str,
    external: Vec<ExternalLink>,
}

impl<'a> LinkReader<'a> {
    pub(super) fn new(problems: &'a mut Problems, agent: &'a str) -> Self {
        Self { problems, agent, external: Vec::new() }
    }

    pub(super) fn links(mut self, root: &Table) -> WrittenLinks {
        let table = self.problems.table(root, "links");
        let mut links = Vec::new();
        for (to, entry) in table.into_iter().flat_map(Table::iter) {
            match &entry.value.value {
                _ if ExternalUrl::parse(to).is_some() => self.leaving(to, entry),
                Value::Table(senders) if is_of_senders(senders) => {
                    let senders = senders.iter();
                    links.extend(
                        senders.filter_map(|(from, sender)| self.sender(to, entry.key, from, sender)),
                    );
                }
                // No senders.
                Value::List(list) if list.is_empty() => {}
                _ => links.extend(self.link(to, entry)),
            }
        }
        WrittenLinks { links, external: self.external }
    }

    /// Reads a link from a property to an external program.
    fn leaving(&mut self, to: &str, entry: &TableEntry) {
        let Some(other) = ExternalUrl::parse(to).map(|url| Spanned::new(url, entry.key)) else { return };
        let (from, options) = match &entry.value.value {
            // Removes the link of an earlier layer.
            Value::Bool(false) => return,
            Value::Text(text) => (Spanned::new(text.clone(), entry.value.span), Table::default()),
            Value::Table(table) if !is_of_senders(table) && table.get("from").is_some() => {
                let Some(from) = self.problems.text(table, "from", "module/property") else { return };
                (from, without_source(table))
            }
            _ => {
                let message = format!("`{to}` receives the values of one property");
                let help =
                    format!("write \"{to}\" = \"module/property\", or = {{ from = \"module/property\" }}");
                return self.problems.add(entry.value.span, message, help);
            }
        };
        if ExternalUrl::parse(&from).is_some() {
            let message = ErrorCode::Ends.of(format!("neither `{to}` nor `{}` is of this agent", from.value));
            return self.problems.add(from.span, message, "name a property of this agent: module/property");
        }
        let Some(url) = self.source(&from) else { return };
        if let Some(agent) = url.value.agent() {
            let message =
                format!("`{to}` receives values of this agent, and `{}` is of `{agent}`", url.value);
            let help = format!("write the link in the configuration of `{agent}`");
            return self.problems.add(from.span, ErrorCode::OtherAgent.of(message), help);
        }
        let path = Spanned::new(url.value.path_in(""), from.span);
        self.external.push(ExternalLink { path, other, direction: ExternalDirection::Out, options });
    }

    /// Reads a link from an external program; false for another source.
    fn arriving(&mut self, to: &Spanned<String>, from: &Spanned<String>, table: &Table) -> bool {
        let Some(url) = ExternalUrl::parse(from) else { return false };
        if to.value.starts_with("slate://") {
            let message = ErrorCode::OtherAgent
                .of(format!("neither `{}` nor `{}` is of this agent", to.value, from.value));
            let help = "write the link in the configuration of the agent that has the input";
            self.problems.add(from.span, message, help);
            return true;
        }
        let (path, other) = (to.clone(), Spanned::new(url, from.span));
        let options = without_source(table);
        self.external.push(ExternalLink { path, other, direction: ExternalDirection::In, options });
        true
    }

    /// Reads one of several senders.
    fn sender(&mut self, to: &str, key: Span, from: &str, entry: &TableEntry) -> Option<Link> {
        let empty = Table::default();
        let table = match entry.value.as_bool() {
            Some(false) => return None,
            // Others than those that are named.
            Some(true) if from == UNNAMED => return None,
            Some(true) => &empty,
            None => self.problems.as_table(from, entry)?,
        };
        let (to, from) = (destination(to, key, self.agent), Spanned::new(from.into(), entry.key));
        if self.arriving(&to, &from, table) {
            return None;
        }
        let from = self.source(&from)?;
        Some(self.with_options(to, from, table))
    }

    fn link(&mut self, to: &str, entry: &TableEntry) -> Option<Link> {
        let to = destination(to, entry.key, self.agent);
        match entry.value.as_bool() {
            // Removes the link of an earlier layer.
            Some(false) => return None,
            Some(true) => {
                let help = "write the property that it reads, or `false` for no link";
                self.problems.add(entry.value.span, format!("link `{}` has no source", to.value), help);
                return None;
            }
            None => {}
        }
        let Some(table) = entry.value.as_table() else {
            let from =
                self.problems.as_text(&format!("\"{}\"", to.value), &entry.value, "module/property")?;
            if self.arriving(&to, &from, &Table::default()) {
                return None;
            }
            let from = self.source(&from)?;
            return Some(self.with_options(to, from, &Table::default()));
        };
        if table.get("from").is_none() {
            let help = "write { from = \"module/property\" }";
            self.problems.add(entry.value.span, format!("link `{}` has no `from`", to.value), help);
        }
        let from = self.problems.text(table, "from", "module/property");
        if from.as_ref().is_some_and(|from| self.arriving(&to, from, table)) {
            return None;
        }
        let Some(from) = from.and_then(|from| self.source(&from)) else {
            self.problems.unknown_keys(table, &format!("in link `{}`", to.value), &KEYS);
            return None;
        };
        Some(self.with_options(to, from, table))
    }

    /// Makes a link with the options of its table.
    fn with_options(&mut self, to: Spanned<String>, from: Spanned<Url>, table: &Table) -> Link {
        self.problems.unknown_keys(table, &format!("in link `{}`", to.value), &KEYS);
        Link {
            from,
            previous: self.problems.flag(table, "previous").is_some_and(|flag| flag.value),
            stale: self.problems.duration(table, "stale"),
            filter: Filter {
                every: self.problems.count_from_one(table, "every", u64::MAX),
                when: self.problems.text(table, "when", "range < 0.5"),
            },
            policy: table.get("policy").and_then(|value| {
                let choices = [("skip", LinkPolicy::Skip), ("evict", LinkPolicy::Evict)];
                self.problems.choice("policy", value, &choices)
            }),
            window: self
                .problems
                .count_from_one(table, "window", WINDOW_LIMIT)
                .map(|window| Spanned::new(window.value as u16, window.span)),
            transport: self.transport(table),
            wiring: Wiring::Written,
            to,
        }
    }

    fn source(&mut self, from: &Spanned<String>) -> Option<Spanned<Url>> {
        let url = self.problems.url(from, from.span)?;
        Some(Spanned::new(absolute(&url, self.agent), from.span))
    }

    fn transport(&mut self, table: &Table) -> Transport {
        let modes = [("reliable", LinkMode::Reliable), ("best-effort", LinkMode::BestEffort)];
        let (rate, interval) = (self.rate(table), self.problems.duration(table, "interval"));
        if let (Some(rate), Some(interval)) = (&rate, &interval)
            && matches!(rate.value, LinkRate::Every(_))
        {
            let help = "leave `interval` or `rate` out: `rate` samples the newest value, `interval` is the \
                        shortest time between values that are sent on change";
            self.problems.add(
                interval.span,
                "`interval` is for values that are sent on change, and `rate` gives a period",
                help,
            );
        }
        Transport {
            carrier: self.problems.text(table, "carrier", "local"),
            mode: table.get("mode").and_then(|value| self.problems.choice("mode", value, &modes)),
            rate,
            interval,
            compression: self.compression(table),
        }
    }

    /// Reads a compression: none, lossless, or JPEG of a quality.
    fn compression(&mut self, table: &Table) -> Option<Spanned<Compression>> {
        let text = self.problems.text(table, "compression", "lossless")?;
        let compression = match text.value.as_str() {
            "none" => Some(Compression::None),
            "lossless" => Some(Compression::Lossless),
            other => other
                .strip_prefix("jpeg:")
                .and_then(|quality| quality.parse().ok())
                .filter(|quality| (1..=100).contains(quality))
                .map(Compression::Jpeg),
        };
        if compression.is_none() {
            let help = "write \"none\", \"lossless\", or \"jpeg:80\" for images with losses: the quality is from 1 to 100";
            self.problems.add(text.span, format!("unknown compression `{}`", text.value), help);
        }
        compression.map(|compression| Spanned::new(compression, text.span))
    }

    /// Reads a rate: a frequency, a period, or `on-change`.
    fn rate(&mut self, table: &Table) -> Option<Spanned<LinkRate>> {
        let text = self.problems.text(table, "rate", "10Hz")?;
        let rate = match text.strip_suffix("Hz").map(|number| number.trim().parse::<f64>()) {
            Some(Ok(frequency)) if frequency > 1e-9 && frequency <= 1e9 => {
                Some(LinkRate::Every((1e9 / frequency).round() as u64))
            }
            Some(_) => None,
            None if text.value == "on-change" => Some(LinkRate::OnChange),
            None => slate_module::parse_duration(&text).filter(|period| *period > 0).map(LinkRate::Every),
        };
        if rate.is_none() {
            let help =
                "write a frequency, a period or on-change: rate = \"10Hz\", \"100ms\" or \"on-change\"";
            self.problems.add(
                text.span,
                ErrorCode::Value.of(format!("`{}` is not a rate", text.value)),
                help,
            );
        }
        rate.map(|rate| Spanned::new(rate, text.span))
    }
}

/// Returns the options of a link's table, without the source.
fn without_source(table: &Table) -> Table {
    let mut options = table.clone();
    options.entries.remove("from");
    options
}

/// Returns the path of a link's destination.
/// A destination in this agent may be written with the agent's name.
fn destination(to: &str, span: Span, agent: &str) -> Spanned<String> {
    let own = to.strip_prefix("slate://").and_then(|rest| rest.strip_prefix(agent)?.strip_prefix('/'));
    Spanned::new(own.unwrap_or(to).into(), span)
}

impl Link {
    /// Returns the destination as an absolute URL.
    /// It has an agent if it is the inbox of another one.
    pub fn destination(&self) -> Option<Url> {
        let is_url = self.to.value.starts_with("slate://");
        Url::parse(&if is_url { self.to.value.clone() } else { format!("/{}", self.to.value) }).ok()
    }
}

/// Largest window of a queue input, in values.
/// A larger one would only waste memory.
const WINDOW_LIMIT: u64 = 4096;
