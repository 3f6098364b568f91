use std::time::Duration;

use clap::{Args, ValueEnum};
use serde_json::Value;
use slate::blackboard::{Pattern, is_within};
use slate::control::{Client, ClientError, Reading};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::module::names;
use crate::{number, output};

#[derive(Debug, Args)]
pub struct LogOptions {
    /// Show the last LINES selected lines [default: all that the agent keeps]
    #[arg(long, short = 'n', value_parser = number::whole::<usize>(0, u64::MAX))]
    pub lines: Option<usize>,
    /// Show lines of at least this severity
    #[arg(long, value_enum, value_name = "LEVEL")]
    pub level: Option<LeastLevel>,
    /// Show lines of a module or pattern, such as `r2/planner` or 'r2/*'; repeatable
    #[arg(long, value_name = "MODULE", value_parser = module)]
    pub module: Vec<Of>,
    /// Show lines that contain this text, ignoring case
    #[arg(long, value_name = "TEXT")]
    pub text: Option<String>,
    /// Follow the log until Ctrl-C or the end of the agent
    #[arg(long, short)]
    pub follow: bool,
    /// Print each line as JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub agent: AgentOption,
}

/// Minimum severity of log lines; the most severe comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum LeastLevel {
    Error,
    Warn,
    Info,
    Debug,
}

/// Modules of a name or a pattern.
#[derive(Clone, Debug)]
pub struct Of {
    name: String,
    pattern: Pattern,
}

impl Of {
    /// Returns whether a module is one of the selected ones.
    fn has(&self, name: &str) -> bool {
        is_within(name, &self.name) || self.pattern.matches(name)
    }
}

fn module(text: &str) -> Result<Of, String> {
    let name = text.trim_start_matches('/').to_owned();
    let pattern = Pattern::parse(&name).map_err(|error| error.to_string())?;
    Ok(Of { name, pattern })
}

impl LogOptions {
    /// Returns whether a line is selected.
    fn wants(&self, reading: &Reading) -> bool {
        let text = |name: &str| reading.value.get(name).and_then(Value::as_str).unwrap_or_default();
        let level = LeastLevel::from_str(text("level"), true).unwrap_or(LeastLevel::Debug);
        let own = text("module");
        let of_module = |of: &Of| of.has(own);
        let has = |wanted: &String| text("text").to_lowercase().contains(&wanted.to_lowercase());
        self.level.is_none_or(|least| level <= least)
            && (self.module.is_empty() || self.module.iter().any(of_module))
            && self.text.as_ref().is_none_or(has)
    }
}

/// Polling period of new lines.
const POLL_PERIOD: Duration = Duration::from_millis(200);

/// Prints the last lines of the log.
pub fn log(options: &LogOptions) -> Result<bool, Failure> {
    let mut client = options.agent.connect()?;
    let mut kept = client.history("/log/tail")?;
    check(&mut client, &options.module, &kept)?;
    let mut last = 0;
    if let Some(lines) = options.lines {
        let wanted: Vec<_> = (0..kept.len()).filter(|place| options.wants(&kept[*place])).collect();
        let first = wanted.len().checked_sub(lines).map_or(Some(0), |before| wanted.get(before).copied());
        let mut skipped = kept.drain(..first.unwrap_or(kept.len()));
        last = skipped.next_back().map_or(0, |reading| reading.sequence);
    }
    loop {
        for reading in &kept {
            // Lines that the agent no longer keeps are not requested at the beginning.
            let lost = (reading.sequence - last).saturating_sub(1);
            if last != 0 && lost != 0 {
                eprintln!("{lost} lines were skipped; the log file contains them (log.targets.file)");
            }
            last = reading.sequence;
            if options.wants(reading) {
                show(reading, options.json);
            }
        }
        if !options.follow || output::is_unread() {
            return Ok(true);
        }
        std::thread::sleep(POLL_PERIOD);
        match new_lines(&mut client, last) {
            Ok(new_lines) => kept = new_lines,
            // It has ended, and its log with it.
            Err(ClientError::Lost { .. }) => return Ok(true),
            Err(error) => return Err(error.into()),
        }
    }
}

/// Checks that each asked module exists, or has written a line.
fn check(client: &mut Client, selection: &[Of], kept: &[Reading]) -> Result<(), Failure> {
    if selection.is_empty() {
        return Ok(());
    }
    let known = names(client)?;
    let author = |reading: &Reading| Some(reading.value.get("module")?.as_str()?.to_owned());
    let authors: Vec<_> = kept.iter().filter_map(author).collect();
    let exists = |of: &&Of| known.iter().chain(&authors).any(|name| of.has(name));
    match selection.iter().find(|of| !exists(of)) {
        Some(of) => Err(Failure::UnknownModule { name: of.name.clone(), known }),
        None => Ok(()),
    }
}

fn new_lines(client: &mut Client, last: u64) -> Result<Vec<Reading>, ClientError> {
    let mut kept = client.history("/log/tail")?;
    kept.retain(|reading| reading.sequence > last);
    Ok(kept)
}

fn show(reading: &Reading, json: bool) {
    if json {
        let mut line = reading.value.clone();
        // Padding of the interface.
        line.as_object_mut().map(|fields| fields.remove("reserved"));
        output::document("slate.log/1", &line);
        return;
    }
    let text = |name: &str| reading.value.get(name).and_then(Value::as_str).unwrap_or_default();
    let time = reading.time as f64 * 1e-9;
    output::line(format_args!(
        "{time:10.3} {:5} {}: {}",
        text("level").to_lowercase(),
        text("module"),
        text("text")
    ));
}
