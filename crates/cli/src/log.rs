use std::time::Duration;

use clap::Args;
use serde_json::Value;
use slate::control::{Client, ClientError, Reading};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

#[derive(Debug, Args)]
pub struct LogOptions {
    /// How many of the last lines; all that the agent keeps unless given.
    #[arg(long, short = 'n')]
    pub lines: Option<usize>,
    /// Goes on with the lines that come, until it is interrupted or the agent ends.
    #[arg(long, short)]
    pub follow: bool,
    /// Prints each line as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub agent: AgentOption,
}

/// How often new lines are asked for.
const PERIOD: Duration = Duration::from_millis(200);

/// Prints the last lines of the log.
pub fn log(options: &LogOptions) -> Result<bool, Failure> {
    let mut client = options.agent.connect()?;
    let mut kept = client.history("/log/tail")?;
    if let Some(lines) = options.lines {
        kept.drain(..kept.len().saturating_sub(lines));
    }
    let mut last = 0;
    loop {
        for reading in &kept {
            // What the agent no longer keeps was never asked for at the beginning.
            let lost = (reading.sequence - last).saturating_sub(1);
            if last != 0 && lost != 0 {
                eprintln!("{lost} lines came too fast to be shown; log.targets.file has them all");
            }
            last = reading.sequence;
            show(reading, options.json);
        }
        if !options.follow || output::is_unread() {
            return Ok(true);
        }
        std::thread::sleep(PERIOD);
        match news(&mut client, last) {
            Ok(news) => kept = news,
            // It has ended, and its log with it.
            Err(ClientError::Lost { .. }) => return Ok(true),
            Err(error) => return Err(error.into()),
        }
    }
}

fn news(client: &mut Client, last: u64) -> Result<Vec<Reading>, ClientError> {
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
