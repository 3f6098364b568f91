//! Live table of a running agent's modules.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use clap::{Args, ValueEnum};
use crossterm::cursor::{Hide, MoveTo, Show};
use crossterm::style::Print;
use crossterm::terminal::{Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen, size};
use crossterm::{execute, queue};
use serde::Serialize;
use serde_json::{Value, json};
use slate::control::{Client, ClientError, Watched};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::gates::HeldActuators;
use crate::interrupt::{self, is_interrupted};
use crate::process::ProcessInfo;
use crate::{duration, output};

#[derive(Debug, Args)]
pub struct TopOptions {
    /// Print the table once and exit
    #[arg(long)]
    once: bool,

    /// Refresh interval, at most one minute
    #[arg(long, value_name = "TIME", default_value = "1s", value_parser = period, allow_hyphen_values = true)]
    interval: Duration,

    /// Sort key
    #[arg(long, value_enum, default_value_t = SortKey::Load)]
    sort: SortKey,

    /// Print the table once as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SortKey {
    /// Share of the period that ticks take
    Load,
    /// Name
    Name,
    /// Longest tick
    Max,
    /// Deviation of the period
    Jitter,
}

/// Line of the table; times in nanoseconds.
#[derive(Debug, Serialize)]
struct ModuleRow {
    module: String,
    condition: String,
    ticks: u64,
    period: Option<u64>,
    jitter: Option<u64>,
    p50: Option<u64>,
    p99: Option<u64>,
    max: Option<u64>,
    /// Part of a period that a tick takes on average.
    load: Option<f64>,
    overruns: u64,
    restarts: u64,
}

/// Maximum time between two polls.
/// A remote agent closes the connection of a silent client.
const MAX_PERIOD: Duration = Duration::from_secs(60);

fn period(text: &str) -> Result<Duration, String> {
    match duration::parse(text)? {
        period if period > MAX_PERIOD => Err("expected a minute at most, such as `10s`".into()),
        period => Ok(period),
    }
}

/// Polling period for Ctrl-C.
const INTERRUPT_POLL_PERIOD: Duration = Duration::from_millis(50);

/// Shows the table.
pub fn top(options: &TopOptions) -> Result<bool, Failure> {
    let mut client = options.agent.connect()?;
    let is_live = !options.once && !options.json && std::io::stdout().is_terminal();
    if !is_live {
        let look = TimingTable::at(&mut client, options.sort)?;
        match options.json {
            true => output::json(&look.json()),
            false => look.lines().iter().for_each(output::line),
        }
        return Ok(true);
    }
    interrupt::catch();
    let mut screen = std::io::stdout();
    let _ = execute!(screen, EnterAlternateScreen, Hide);
    let shown = live(options, &mut client, &mut screen);
    let _ = execute!(screen, Show, LeaveAlternateScreen);
    match shown {
        // The agent has ended.
        Err(Failure::Agent(ClientError::Lost { name, .. })) => {
            eprintln!("agent `{name}` has ended");
            Ok(true)
        }
        shown => shown.map(|()| true),
    }
}

fn live(options: &TopOptions, client: &mut Client, screen: &mut impl Write) -> Result<(), Failure> {
    while !is_interrupted() {
        let (width, height) = size().unwrap_or((80, 24));
        let lines = TimingTable::at(client, options.sort)?.lines();
        for (row, line) in lines.iter().take(height.into()).enumerate() {
            let line: String = output::harmless(line).chars().take(width.into()).collect();
            // Not all at once, as that flickers.
            let _ = queue!(screen, MoveTo(0, row as u16), Print(line), Clear(ClearType::UntilNewLine));
        }
        let _ = queue!(screen, Clear(ClearType::FromCursorDown));
        let _ = screen.flush();
        let mut left = options.interval.max(INTERRUPT_POLL_PERIOD);
        while !left.is_zero() && !is_interrupted() {
            std::thread::sleep(left.min(INTERRUPT_POLL_PERIOD));
            left = left.saturating_sub(INTERRUPT_POLL_PERIOD);
        }
    }
    Ok(())
}

/// Timing of an agent at one time.
struct TimingTable {
    agent: String,
    process: Option<ProcessInfo>,
    state: Value,
    cycle: Value,
    held: HeldActuators,
    rows: Vec<ModuleRow>,
}

impl TimingTable {
    fn at(client: &mut Client, order: SortKey) -> Result<Self, Failure> {
        let modules = client.modules()?;
        let urls = modules
            .iter()
            .flat_map(|module| ["timing", "histogram"].map(|name| format!("/{}/{name}", module.name)));
        let urls: Vec<_> = urls.chain(["/loop/state".into(), "/loop/histogram".into()]).collect();
        let values = newest(client, &urls)?;
        let row = |(index, module): (usize, &slate::control::ModuleEntry)| {
            let (timing, histogram) = (&values[2 * index], &values[2 * index + 1]);
            let number = |value: &Value, name: &str| value.get(name).and_then(Value::as_u64);
            let period = number(timing, "period").filter(|period| *period > 0);
            let mean = number(histogram, "mean");
            ModuleRow {
                module: module.name.clone(),
                condition: module.condition.clone(),
                ticks: module.ticks,
                period,
                jitter: number(timing, "jitter"),
                p50: number(histogram, "p50"),
                p99: number(histogram, "p99"),
                max: number(histogram, "max"),
                load: mean.zip(period).map(|(mean, period)| mean as f64 / period as f64),
                overruns: module.misses,
                restarts: module.panics,
            }
        };
        let mut rows: Vec<_> = modules.iter().enumerate().map(row).collect();
        match order {
            SortKey::Name => {}
            SortKey::Load => rows.sort_by(|a, b| b.load.unwrap_or(0.0).total_cmp(&a.load.unwrap_or(0.0))),
            SortKey::Max => rows.sort_by_key(|row| std::cmp::Reverse(row.max)),
            SortKey::Jitter => rows.sort_by_key(|row| std::cmp::Reverse(row.jitter)),
        }
        let held = HeldActuators::of(client)?;
        let (agent, count) = (client.name().to_owned(), values.len());
        // Another computer's processes are not seen here.
        let process = Some(&agent).filter(|_| client.is_local()).and_then(|agent| ProcessInfo::of(agent));
        Ok(Self {
            agent,
            process,
            state: values[count - 2].clone(),
            cycle: values[count - 1].clone(),
            held,
            rows,
        })
    }

    fn json(&self) -> Value {
        let Self { agent, process, state, cycle, held, rows } = self;
        json!({
            "schema": "slate.top/1", "agent": agent, "process": process, "loop": state, "cycle": cycle, "modules": rows,
            "stopped": held.stopped, "disarmed": held.disarmed,
        })
    }

    fn lines(&self) -> Vec<String> {
        let time = |value: &Value, name: &str| {
            value.get(name).and_then(Value::as_u64).map_or("-".into(), |time| duration::show(time as f64))
        };
        let cycles =
            self.state.get("cycles").or(self.cycle.get("count")).and_then(Value::as_u64).unwrap_or(0);
        let process = self.process.as_ref().map_or(String::new(), |process| format!(", {process}"));
        let held = self.held.words().map_or(String::new(), |words| format!("actuators {words}\n"));
        let head = format!(
            "{}{process}\n{held}{cycles} cycles: p50 {}, p99 {}, max {}\n",
            self.agent,
            time(&self.cycle, "p50"),
            time(&self.cycle, "p99"),
            time(&self.cycle, "max")
        );
        let names = [
            "module",
            "condition",
            "ticks",
            "period",
            "jitter",
            "p50",
            "p99",
            "max",
            "load",
            "overruns",
            "restarts",
        ];
        let nanoseconds = |time: Option<u64>| time.map_or("-".into(), |time| duration::show(time as f64));
        let rows = self.rows.iter().map(|row| {
            [
                row.module.clone(),
                row.condition.clone(),
                row.ticks.to_string(),
                nanoseconds(row.period),
                nanoseconds(row.jitter),
                nanoseconds(row.p50),
                nanoseconds(row.p99),
                nanoseconds(row.max),
                row.load.map_or("-".into(), |load| format!("{:.2}%", load * 100.0)),
                row.overruns.to_string(),
                row.restarts.to_string(),
            ]
        });
        let table = output::aligned([names.map(String::from)].into_iter().chain(rows));
        head.lines().map(str::to_owned).chain(table).collect()
    }
}

/// Returns the newest values of properties; null for missing ones.
fn newest(client: &mut Client, urls: &[String]) -> Result<Vec<Value>, Failure> {
    let of: Vec<_> = urls.iter().map(|url| Watched { url: url.clone(), after: None }).collect();
    let mut values = vec![Value::Null; urls.len()];
    match client.watch(&of, Duration::ZERO) {
        Ok(news) => {
            for one in news {
                values[one.of] =
                    one.readings.into_iter().next_back().map(|one| one.value).unwrap_or_default();
            }
        }
        // A module has gone since the list, or has no such property: then they are queried one by one.
        Err(ClientError::Refused(_)) => {
            for (value, url) in values.iter_mut().zip(urls) {
                *value = match client.read(url) {
                    Ok(reading) => reading.map(|reading| reading.value).unwrap_or_default(),
                    Err(ClientError::Refused(_)) => Value::Null,
                    Err(error) => return Err(error.into()),
                };
            }
        }
        Err(error) => return Err(error.into()),
    }
    Ok(values)
}
