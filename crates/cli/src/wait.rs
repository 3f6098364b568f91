//! Waiting until a value is so.

use std::time::Duration;

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde_json::json;
use slate::control::{Reading, Watched};

use crate::clock::now;
use crate::condition::Condition;
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::value_text::in_a_line;
use crate::{complete, duration, output};

#[derive(Debug, Args)]
pub struct WaitOptions {
    /// Property or field, such as `/referee/verdict`
    #[arg(add = ArgValueCompleter::new(complete::of_properties))]
    url: String,

    /// Condition, such as `state == SUCCEEDED` or `> 0.5`
    condition: Condition,

    /// Maximum time to wait
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = duration::parse, allow_hyphen_values = true)]
    timeout: Duration,

    /// Time for which the condition must hold, of the agent's time
    #[arg(long = "for", value_name = "TIME", value_parser = duration::parse, allow_hyphen_values = true)]
    time: Option<Duration>,

    /// Print the value as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

/// Maximum duration of one waiting request to the agent.
const MAX_REQUEST_DURATION: Duration = Duration::from_millis(100);

/// Waits, and prints the value.
pub fn wait(options: &WaitOptions) -> Result<bool, Failure> {
    let mut client = options.agent.connect_for(&options.url)?;
    let until = now() + options.timeout;
    let mut of = [Watched { url: options.url.clone(), after: None }];
    let held = options.time.unwrap_or_default();
    // The first value of those that were so, and when it was looked.
    let mut since: Option<(u64, std::time::Instant)> = None;
    let mut newest: Option<Reading> = None;
    loop {
        let left = until.saturating_duration_since(now());
        let news = client.watch(&of, left.min(MAX_REQUEST_DURATION))?;
        for reading in news.into_iter().flat_map(|news| news.readings) {
            of[0].after = Some(reading.sequence);
            let holds = options.condition.holds(&reading.value);
            let holds = holds.map_err(|problem| Failure::Condition { url: options.url.clone(), problem })?;
            let begun = if holds { since.or(Some((reading.time, now()))) } else { None };
            let is_long =
                begun.is_some_and(|(begin, _)| reading.time.saturating_sub(begin) >= nanoseconds(held));
            since = begun;
            newest = Some(reading);
            if is_long {
                done(options, newest.as_ref());
                return Ok(true);
            }
        }
        // A property that is written on change may have no new value.
        if since.is_some_and(|(_, looked)| looked.elapsed() >= held) {
            done(options, newest.as_ref());
            return Ok(true);
        }
        if now() >= until {
            let last = newest
                .map_or("never written".into(), |reading| format!("it is {}", in_a_line(&reading.value)));
            let seconds = options.timeout.as_secs_f64();
            return Err(Failure::NoValue(format!(
                "{}: the condition did not hold within {seconds:.1} s: {last}",
                options.url
            )));
        }
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

fn done(options: &WaitOptions, reading: Option<&Reading>) {
    let Some(Reading { value, sequence, time }) = reading else { return };
    match options.json {
        true => {
            let (schema, url) = ("slate.wait/1", &options.url);
            output::json(
                &json!({"schema": schema, "url": url, "sequence": sequence, "time": time, "value": value}),
            );
        }
        false => output::line(in_a_line(value)),
    }
}
