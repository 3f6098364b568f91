//! Recordings that are played, and runs that are made again from them.

mod attached;
mod order;
mod play;
mod trial;
mod verify;
#[cfg(feature = "console")]
mod visit;

use std::path::PathBuf;

use clap::Args;
use slate::replay::{Choice, Plan};
use slate_sorted::{SortedMap, SortedSet};

use crate::failure::Failure;
use crate::recording::parse_offset;
use order::OrderVerb;
pub use trial::{TryOptions, try_module};
#[cfg(feature = "console")]
pub use visit::with_playback;

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct ReplayOptions {
    #[command(subcommand)]
    order: Option<OrderVerb>,

    /// Recording
    #[arg(required = true)]
    file: Option<PathBuf>,

    /// Repeat a lockstep run and compare every value with the recorded one
    #[arg(long, conflicts_with_all = ["rate", "start", "end", "repeat", "pause", "stay", "select", "exclude", "map", "recompute", "partial", "set"])]
    verify: bool,

    /// Replay rate: `realtime`, a factor, or `max`
    #[arg(long, value_parser = parse_factor, default_value = "realtime", allow_hyphen_values = true)]
    rate: ReplayRate,

    /// Start, seconds after the first value
    #[arg(long, value_name = "SECONDS", value_parser = parse_offset)]
    start: Option<u64>,

    /// End, seconds after the first value
    #[arg(long, value_name = "SECONDS", value_parser = parse_offset)]
    end: Option<u64>,

    /// Restart at the end
    #[arg(long = "loop", conflicts_with = "recompute")]
    repeat: bool,

    /// Start paused, until `slate replay resume` or `step`
    #[arg(long)]
    pause: bool,

    /// Keep the agent with the last values at the end, until Ctrl-C
    #[arg(long, conflicts_with = "repeat")]
    stay: bool,

    /// Replay only these topics or patterns, such as `/r2/*`
    #[arg(long, num_args = 1.., value_name = "TOPIC")]
    select: Vec<String>,

    /// Exclude topics or patterns
    #[arg(long, num_args = 1.., value_name = "TOPIC")]
    exclude: Vec<String>,

    /// Remap a topic to another path, such as `/scan=/r2/laser/scan`; repeatable
    #[arg(long, value_name = "TOPIC=URL", value_parser = parse_map)]
    map: Vec<(String, String)>,

    /// Run modules on the replayed inputs
    /// and compare their outputs with the recorded ones
    #[arg(long, value_name = "MODULE", value_delimiter = ',')]
    recompute: Vec<String>,

    /// Run them even if some of their inputs are not recorded; the result says so
    #[arg(long, requires = "recompute")]
    partial: bool,

    /// Override a setting of the recorded configuration; repeatable
    #[arg(long, value_name = "PATH=VALUE", requires = "recompute")]
    set: Vec<String>,

    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Replay rate, a factor; `None` for as fast as possible.
#[derive(Clone, Copy, Debug)]
pub struct ReplayRate(pub Option<f64>);

fn parse_factor(text: &str) -> Result<ReplayRate, String> {
    use slate::runtime::Rate;
    slate_run::parse_rate(text).map(|rate| match rate {
        Rate::Max => ReplayRate(None),
        Rate::Times(factor) => ReplayRate(Some(factor)),
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
            map: options.map.iter().cloned().collect::<SortedMap<_, _>>(),
        },
        start: options.start,
        end: options.end,
        repeats: options.repeat,
        is_paused: options.pause,
        stays: options.stay,
        rate: options.rate.0,
        modules: options
            .recompute
            .iter()
            .map(|name| name.trim_start_matches('/').to_owned())
            .collect::<SortedSet<_>>(),
        is_partial: options.partial,
        sets: options.set.clone(),
    };
    play::play(file, plan, options.json)
}
