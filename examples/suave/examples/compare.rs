//! Comparison of all managers with the same seeds, by the exemplar's metrics.
//!
//! `cargo run --release -p slate-suave --example compare -- [runs] [--only controller] [setting ...]`

use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use slate::blackboard::interface::Value;
use slate::runtime::configuration::{Database, Options as ConfigurationOptions, Table};
use slate::runtime::{Agent, Options, Rate};
use slate_suave::statistics::mann_whitney_less;

/// Metrics by name, and whether less is better.
const METRICS: [(&str, bool); 7] = [
    ("search_time", true),
    ("distance_inspected", false),
    ("reaction_time", true),
    ("visibility_reaction_time", true),
    ("thruster_reaction_time", true),
    ("inspection_reaction_time", true),
    ("answered_share", false),
];

/// Values of each metric, in the order of the seeds.
/// Values that do not apply to a run are left out.
type Figures = [Vec<f64>; METRICS.len()];

fn database(sets: Vec<String>) -> Result<Database, String> {
    let options = ConfigurationOptions { sets, extra_tables: vec!["report".into()], ..Default::default() };
    Database::from_text("suave.toml", slate_suave::CONFIGURATION, options).map_err(|error| error.to_string())
}

/// Runs a seed to its end; returns its metrics.
fn run(controller: &str, settings: &[String], seed: u64) -> Result<[f64; METRICS.len()], String> {
    let own = [format!("controller={controller}"), format!("agent.seed={seed}")];
    let database = database([own.as_slice(), settings].concat())?;
    let options = Options { rate: Rate::Max, armed: true, follows_files: false, ..Options::default() };
    let mut agent = Agent::load_with(&database, &[slate_suave::plugin()], options)
        .map_err(|error| format!("{error:?}"))?;
    let text = |agent: &Agent, path: &str| {
        let value = agent.board().read(path).ok().flatten().map(|(value, _)| value);
        value.as_ref().and_then(Value::as_str).unwrap_or_default().to_owned()
    };
    while !["SUCCEEDED", "FAILED"].contains(&&*text(&agent, "referee/verdict/state")) {
        if !agent.step() {
            return Err(format!("seed {seed}: the agent stopped"));
        }
    }
    let number = |name: &str| {
        let value = agent.board().read(&format!("referee/metrics/{name}")).ok().flatten();
        value.and_then(|(value, _)| value.as_f64()).unwrap_or(f64::NAN)
    };
    Ok(METRICS.map(|(name, _)| match name {
        "answered_share" => number("disturbances_answered") / number("disturbances"),
        name => number(name),
    }))
}

/// Runs all seeds of a controller on all cores.
fn runs(controller: &str, settings: &[String], count: usize) -> Result<Figures, String> {
    let (next, results) = (AtomicUsize::new(0), Mutex::new(vec![None; count]));
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, std::num::NonZero::get) {
            scope.spawn(|| {
                loop {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    if place >= count {
                        return;
                    }
                    let result = run(controller, settings, place as u64 + 1);
                    if let Ok(mut results) = results.lock() {
                        results[place] = Some(result);
                    }
                }
            });
        }
    });
    let results = results.into_inner().map_err(|error| error.to_string())?;
    let mut figures = Figures::default();
    for result in results.into_iter().flatten() {
        for (values, value) in figures.iter_mut().zip(result?) {
            if value.is_finite() {
                values.push(value);
            }
        }
    }
    Ok(figures)
}

fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (count - 1.0);
    (mean, variance.sqrt())
}

fn compare(count: usize, only: Option<&str>, settings: &[String]) -> Result<(), String> {
    let configuration = database(Vec::new())?.current();
    let controllers = configuration.value("choices.controller").and_then(|all| all.value.as_table());
    let known: Vec<_> = controllers.into_iter().flat_map(Table::iter).map(|(name, _)| name).collect();
    let chosen = known.iter().filter(|name| only.is_none_or(|only| only == **name));
    let mut all = Vec::new();
    for &name in chosen {
        all.push((name, runs(name, settings, count)?));
    }
    if all.is_empty() {
        return Err(format!("unknown controller; known: {}", known.join(", ")));
    }
    for (at, (metric, is_less_better)) in METRICS.iter().enumerate() {
        println!("\n{metric}, seeds 1 to {count}");
        for (name, figures) in &all {
            let (mean, deviation) = mean_and_deviation(&figures[at]);
            print!("  {name:16} {mean:8.2} +- {deviation:6.2}  n {:4}", figures[at].len());
            for (other, others) in all.iter().filter(|(other, _)| other != name) {
                let (own, others) = (&figures[at], &others[at]);
                let p = if *is_less_better {
                    mann_whitney_less(own, others)
                } else {
                    mann_whitney_less(others, own)
                };
                print!("  {other} {p:.2e}");
            }
            println!();
        }
    }
    for (name, figures) in &all {
        println!("\n{name}: search time (s), distance inspected (m)");
        for (time, distance) in figures[0].iter().zip(&figures[1]) {
            print!("  {time:.0}/{distance:.1}");
        }
        println!();
    }
    Ok(())
}

fn main() -> ExitCode {
    let (mut count, mut only, mut settings) = (100, None, Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.parse() {
            Ok(number) => count = number,
            Err(_) if argument == "--only" => only = arguments.next(),
            Err(_) => settings.push(argument),
        }
    }
    match compare(count, only.as_deref(), &settings) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
