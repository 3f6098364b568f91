//! Rates of values, measured in the agent.

use std::time::Duration;

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde_json::json;
use slate::control::{MAX_CALL_DURATION, RateMeasurement};

use crate::connection::AgentOption;
use crate::failure::{ASSERTION_FALSE, Failure};
use crate::urls::expand;
use crate::{complete, duration, number, output};

#[derive(Debug, Args)]
pub struct StatOptions {
    /// Properties or patterns, such as `/simulator/r2/sonar` or `/r2/*/percept`
    #[arg(required = true, value_name = "URL", add = ArgValueCompleter::new(complete::of_properties))]
    urls: Vec<String>,

    /// Duration of the measurement, at most 50s
    #[arg(long = "for", value_name = "TIME", default_value = "2s", value_parser = within, allow_hyphen_values = true)]
    time: Duration,

    /// Minimum rate of each property, Hz; exit code 7 if it is lower
    #[arg(long, value_name = "HZ", value_parser = number::hertz, allow_negative_numbers = true)]
    min: Option<f64>,

    /// Maximum rate of each property, Hz; exit code 7 if it is higher
    #[arg(long, value_name = "HZ", value_parser = number::hertz, allow_negative_numbers = true)]
    max: Option<f64>,

    /// Print the measurements as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

fn within(text: &str) -> Result<Duration, String> {
    match duration::parse(text)? {
        time if time > MAX_CALL_DURATION => {
            Err(format!("expected at most {} s", MAX_CALL_DURATION.as_secs()))
        }
        time if time.is_zero() => Err("expected more than 0 s".into()),
        time => Ok(time),
    }
}

/// Measures, and returns the exit code.
pub fn stat(options: &StatOptions) -> Result<u8, Failure> {
    let mut client = options.agent.connect_for(&options.urls[0])?;
    let urls = expand(&mut client, &options.urls)?;
    let measured = client.measure(&urls, options.time)?;
    if options.json {
        output::json(
            &json!({"schema": "slate.stat/1", "seconds": options.time.as_secs_f64(), "properties": measured}),
        );
    } else {
        let head = [
            "property",
            "rate",
            "interval p50",
            "p99",
            "max",
            "jitter",
            "size",
            "bandwidth",
            "age",
            "readers",
            "lost",
        ];
        output::columns([head.map(String::from)].into_iter().chain(measured.iter().map(row)));
        measured.iter().for_each(note);
    }
    let mut holds = true;
    for one in &measured {
        let rate = one.rate.unwrap_or(0.0);
        if options.min.is_some_and(|min| rate < min) || options.max.is_some_and(|max| rate > max) {
            let between = |limit: Option<f64>, word| limit.map(|limit| format!("{word} {limit} Hz"));
            let limits: Vec<_> = [between(options.min, "at least"), between(options.max, "at most")]
                .into_iter()
                .flatten()
                .collect();
            eprintln!("{} has {rate:.2} Hz; expected {}", one.url, limits.join(" and "));
            holds = false;
        }
    }
    Ok(if holds { 0 } else { ASSERTION_FALSE })
}

fn row(one: &RateMeasurement) -> [String; 11] {
    let dash = || "-".to_owned();
    let of = |pick: fn(&slate::control::Spread) -> f64| {
        one.interval.as_ref().map_or_else(dash, |interval| duration::show(pick(interval)))
    };
    [
        one.url.clone(),
        one.rate.map_or_else(dash, |rate| format!("{rate:.2} Hz")),
        of(|interval| interval.p50 as f64),
        of(|interval| interval.p99 as f64),
        of(|interval| interval.max as f64),
        of(|interval| interval.deviation),
        one.size.map_or_else(dash, duration::bytes),
        one.bandwidth.map_or_else(dash, |bytes| format!("{}/s", duration::bytes(bytes))),
        one.age.map_or_else(dash, |age| duration::show(age as f64)),
        one.readers.to_string(),
        one.lost.to_string(),
    ]
}

/// Prints remarks on a measurement.
fn note(one: &RateMeasurement) {
    let url = &one.url;
    if !one.has_writer {
        output::line(format_args!("{url}: no writer at present"));
    } else if one.rate.is_none() {
        let age = one.age.map_or("never written".into(), |age| {
            format!("the last one is {} old", duration::show(age as f64))
        });
        output::line(format_args!("{url}: no new value came; {age}"));
    }
    if one.unseen > 0 {
        output::line(format_args!(
            "{url}: {} of {} values were overwritten before they were sampled; the rate counts them, the intervals don't",
            one.unseen, one.count
        ));
    }
}
