//! Values as they come.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde_json::{Value, json};
use slate::bag::seconds;
use slate::control::{ClientError, Reading, Watched};
use slate::runtime::ErrorCode;

use crate::clock::now;
use crate::condition::Condition;
use crate::connection::AgentOption;
use crate::failure::{Failure, TIMED_OUT};
use crate::interrupt::{self, is_interrupted};
use crate::urls::expand;
use crate::value_text::{flatten, in_a_line};
use crate::{complete, duration, output};

#[derive(Debug, Args)]
pub struct WatchOptions {
    /// Properties, fields or patterns, such as `/simulator/r2/truth` or `/r2/*/state`
    #[arg(required = true, value_name = "URL", add = ArgValueCompleter::new(complete::of_properties))]
    urls: Vec<String>,

    /// Stop after this many values
    #[arg(long, short = 'n', value_name = "COUNT", value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,

    /// Stop after one value of each property
    #[arg(long, conflicts_with = "count")]
    once: bool,

    /// Stop after this time, such as `10s`
    #[arg(long = "for", value_name = "TIME", value_parser = duration::parse, allow_hyphen_values = true)]
    time: Option<Duration>,

    /// Maximum rate of each property, Hz of the agent's time
    #[arg(long, value_name = "RATE", value_parser = positive)]
    max_hz: Option<f64>,

    /// Print a value only if it differs from the one before
    #[arg(long)]
    changes: bool,

    /// Print only values for which a condition holds,
    /// such as `range < 0.5 and state == WORKING`
    #[arg(long = "where", value_name = "CONDITION")]
    condition: Option<Condition>,

    /// Print each value as a line of JSON
    #[arg(long, conflicts_with = "csv")]
    json: bool,

    /// Print the values of one property as comma-separated values
    #[arg(long)]
    csv: bool,

    #[command(flatten)]
    agent: AgentOption,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.trim_end_matches("Hz").trim().parse::<f64>() {
        Ok(rate) if rate.is_finite() && rate > 0.0 => Ok(rate),
        _ => Err("expected a positive number of Hz, such as 10".into()),
    }
}

/// Maximum duration of one waiting request to the agent.
/// After it, Ctrl-C is checked.
const REQUEST_TIMEOUT: Duration = Duration::from_millis(250);

/// Watched property.
struct WatchLine {
    url: String,
    shown: u64,
    last: Option<Reading>,
    /// Values that came and could not be shown, as they came too fast.
    missed: u64,
}

/// Prints values until the limit; returns the exit code.
pub fn watch(options: &WatchOptions) -> Result<u8, Failure> {
    let mut client = options.agent.connect_for(&options.urls[0])?;
    let urls = expand(&mut client, &options.urls)?;
    if options.csv && urls.len() > 1 {
        return Err(Failure::SeveralInTable { urls });
    }
    interrupt::catch();
    let width = urls.iter().map(|url| url.chars().count()).max().filter(|_| urls.len() > 1);
    let mut of: Vec<_> = urls.iter().map(|url| Watched { url: url.clone(), after: None }).collect();
    let new = |url| WatchLine { url, shown: 0, last: None, missed: 0 };
    let mut lines: Vec<WatchLine> = urls.into_iter().map(new).collect();
    let until = options.time.map(|time| now() + time);
    let (mut total, mut has_head, mut since) = (0, false, None);
    // Whether the run continued after the first values were read.
    let mut polls = 0;
    loop {
        let left = until
            .map_or(REQUEST_TIMEOUT, |until| until.saturating_duration_since(now()).min(REQUEST_TIMEOUT));
        let news = match client.watch(&of, left) {
            Ok(news) => news,
            // It has ended, and what it had to show was shown.
            Err(ClientError::Lost { .. }) if total > 0 => break,
            Err(error) if total > 0 && polls > 1 && is_run_over(&error) => {
                eprintln!("{error}");
                break;
            }
            Err(error) => return Err(error.into()),
        };
        polls += 1;
        for one in news {
            let (Some(line), Some(watched)) = (lines.get_mut(one.of), of.get_mut(one.of)) else { continue };
            line.missed += one.missed;
            for reading in one.readings {
                watched.after = Some(reading.sequence);
                if !wanted(options, line, &reading)? {
                    continue;
                }
                if options.csv && !std::mem::replace(&mut has_head, true) {
                    head(&reading);
                }
                show(options, line, &reading, one.missed, width);
                (line.shown, line.last) = (line.shown + 1, Some(reading));
                total += 1;
                since.get_or_insert_with(now);
                if options.count == Some(total) || output::is_unread() {
                    return Ok(0);
                }
            }
        }
        // A property of a pattern may have no value for long, such as the timing of a module that is off.
        let is_all = lines.iter().all(|line| line.shown > 0) || total > 0 && lines.len() > options.urls.len();
        let is_enough = options.once && is_all;
        if is_enough || output::is_unread() {
            return Ok(0);
        }
        if is_interrupted() || until.is_some_and(|until| now() >= until) {
            break;
        }
    }
    if total == 0 && !is_interrupted() {
        eprintln!("no value in that time");
        return Ok(TIMED_OUT);
    }
    if is_interrupted() && std::io::stderr().is_terminal() {
        let missed: u64 = lines.iter().map(|line| line.missed).sum();
        let seconds = since.map_or(0.0, |since: Instant| since.elapsed().as_secs_f64());
        eprintln!("{total} values in {seconds:.1} s, {missed} missed");
    }
    Ok(0)
}

fn is_run_over(error: &ClientError) -> bool {
    matches!(error, ClientError::Refused(refusal) if refusal.code.as_deref() == Some(ErrorCode::RunOver.code()))
}

/// Returns whether a value is to be shown.
fn wanted(options: &WatchOptions, line: &WatchLine, reading: &Reading) -> Result<bool, Failure> {
    if options.once && line.shown > 0 {
        return Ok(false);
    }
    if let Some(last) = &line.last {
        let is_soon = options.max_hz.is_some_and(|rate| {
            (reading.time.saturating_sub(last.time) as f64) < 1e9 / rate && reading.time >= last.time
        });
        if is_soon || options.changes && last.value == reading.value {
            return Ok(false);
        }
    }
    let Some(condition) = &options.condition else { return Ok(true) };
    let holds = condition.holds(&reading.value);
    holds.map_err(|problem| Failure::Condition { url: line.url.clone(), problem })
}

fn show(options: &WatchOptions, line: &WatchLine, reading: &Reading, missed: u64, width: Option<usize>) {
    let Reading { value, sequence, time } = reading;
    if options.json {
        let (url, schema) = (&line.url, "slate.watch/1");
        let text = json!({"schema": schema, "url": url, "sequence": sequence, "time": time, "missed": missed, "value": value});
        return output::json(&text);
    }
    if options.csv {
        let mut rows = Vec::new();
        columns(String::new(), value, &mut rows);
        let cells = rows.iter().map(|[_, cell]| cell.as_str());
        let cells = cells.map(quoted).collect::<Vec<_>>().join(",");
        return output::line(format_args!("{},{sequence},{cells}", seconds(*time)));
    }
    let time = *time as f64 * 1e-9;
    match width {
        Some(width) => {
            let url = &line.url;
            output::line(format_args!("{time:12.3}  {url:width$}  {}", in_a_line(value)));
        }
        None => output::line(format_args!("{time:12.3}  {}", in_a_line(value))),
    }
}

fn head(reading: &Reading) {
    let mut rows = Vec::new();
    columns(String::new(), &reading.value, &mut rows);
    let names = rows.iter().map(|[name, _]| if name.is_empty() { "value" } else { name.as_str() });
    let names = names.map(quoted).collect::<Vec<_>>().join(",");
    output::line(format_args!("time,sequence,{names}"));
}

/// Appends the cells of a value with the names of their columns.
/// A list is one cell, as JSON: its length differs between rows, and all rows have the columns of the head.
fn columns(path: String, value: &Value, rows: &mut Vec<[String; 2]>) {
    match value {
        Value::Object(fields) if !fields.is_empty() => {
            let below = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") };
            fields.iter().for_each(|(name, value)| columns(below(name), value, rows));
        }
        Value::Array(_) => rows.push([path, value.to_string()]),
        other => flatten(path, other, rows),
    }
}

/// Returns a cell, in quotes when it has a separator of cells.
fn quoted(cell: &str) -> String {
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.into(),
    }
}
