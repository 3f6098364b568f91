//! Recordings that are played, and runs that are made again from them.

mod attached;
mod order;
mod play;
mod trial;
mod verify;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use clap::Args;
use slate::record::replay::{Choice, Plan};

use crate::bag::nanoseconds;
use crate::failure::Failure;
use order::OrderVerb;
pub use trial::{TryOptions, try_module};

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct ReplayOptions {
    #[command(subcommand)]
    order: Option<OrderVerb>,

    /// A recording.
    #[arg(required = true)]
    file: Option<PathBuf>,

    /// Makes a run in lockstep again and compares every value that it writes with the recorded one.
    #[arg(long, conflicts_with_all = ["rate", "start", "end", "repeat", "pause", "select", "exclude", "map", "recompute", "partial", "set"])]
    verify: bool,

    /// How fast: `realtime`, a factor, or `max`.
    #[arg(long, value_parser = parse_factor, default_value = "realtime", allow_hyphen_values = true)]
    rate: Factor,

    /// Where it begins, seconds after the first value.
    #[arg(long, value_name = "SECONDS", value_parser = nanoseconds)]
    start: Option<u64>,

    /// Where it ends, seconds after the first value.
    #[arg(long, value_name = "SECONDS", value_parser = nanoseconds)]
    end: Option<u64>,

    /// Begins again at the end.
    #[arg(long = "loop", conflicts_with = "recompute")]
    repeat: bool,

    /// Stands still at the beginning, until `slate replay resume` or `step`.
    #[arg(long)]
    pause: bool,

    /// Topics that are played, or patterns such as `/r2/*`; all unless given.
    #[arg(long, num_args = 1.., value_name = "TOPIC")]
    select: Vec<String>,

    /// Topics that are not.
    #[arg(long, num_args = 1.., value_name = "TOPIC")]
    exclude: Vec<String>,

    /// Plays a topic at another path, such as `/scan=/r2/laser/scan`; may be given several times.
    #[arg(long, value_name = "TOPIC=URL", value_parser = parse_map)]
    map: Vec<(String, String)>,

    /// Modules of the recorded agent that run on what is played; what they write is compared with what is recorded.
    #[arg(long, value_name = "MODULE", value_delimiter = ',')]
    recompute: Vec<String>,

    /// Runs them also when not all is recorded that they read then; what came of it says so.
    #[arg(long, requires = "recompute")]
    partial: bool,

    /// Sets a value of the recorded configuration; may be given several times.
    #[arg(long, value_name = "PATH=VALUE", requires = "recompute")]
    set: Vec<String>,

    /// Prints what came of it as JSON.
    #[arg(long)]
    json: bool,
}

/// A factor; nothing for as fast as it goes.
#[derive(Clone, Copy, Debug)]
pub struct Factor(pub Option<f64>);

fn parse_factor(text: &str) -> Result<Factor, String> {
    use slate::runtime::Rate;
    crate::arguments::parse_rate(text).map(|rate| match rate {
        Rate::Max => Factor(None),
        Rate::Times(factor) => Factor(Some(factor)),
    })
}

fn parse_map(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((topic, url)) if !topic.is_empty() && url.len() > 1 && url.starts_with('/') => {
            Ok((topic.into(), url.into()))
        }
        _ => Err("expected a topic and a path, such as /scan=/r2/laser/scan".into()),
    }
}

/// Plays a recording, controls one that is played, or makes its run again.
pub fn replay(options: &ReplayOptions) -> Result<u8, Failure> {
    if let Some(order) = &options.order {
        return order::order(order).map(|()| 0);
    }
    let Some(file) = &options.file else { return Ok(2) };
    if options.verify {
        return verify::verify(file, options.json);
    }
    let plan = Plan {
        choice: Choice {
            select: options.select.clone(),
            exclude: options.exclude.clone(),
            map: options.map.iter().cloned().collect::<BTreeMap<_, _>>(),
        },
        start: options.start,
        end: options.end,
        repeats: options.repeat,
        is_paused: options.pause,
        rate: options.rate.0,
        modules: options
            .recompute
            .iter()
            .map(|name| name.trim_start_matches('/').to_owned())
            .collect::<BTreeSet<_>>(),
        is_partial: options.partial,
        sets: options.set.clone(),
    };
    play::play(file, plan, options.json)
}
