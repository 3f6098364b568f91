//! Trial of one module on a recording.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::Args;
use serde_json::{Value, json};
use slate::blackboard::interface;
use slate::blackboard::nearest_names;
use slate::module::Plugin;
use slate::replay::{Plan, PlayedRun, Player, Recomputation, recorded_modules};
use slate::runtime::{Agent, Mode, Options, plugin, printable};
use slate_sorted::{SortedMap, SortedSet};

use super::play;
use crate::examples;
use crate::failure::Failure;
use crate::output::{self, counted};
use crate::recording::parse_offset;

#[derive(Debug, Args)]
pub struct TryOptions {
    /// Recorded module, such as `r2/planner`,
    /// or a kind of module, such as `pass_position`
    module: String,

    /// Recording
    #[arg(long, value_name = "FILE")]
    bag: PathBuf,

    /// Library with the module's code
    #[arg(long, value_name = "FILE")]
    library: Option<PathBuf>,

    /// Link an input, such as `position=/simulator/r2/position`;
    /// repeatable [default: the recorded links]
    #[arg(long, value_name = "INPUT=URL", value_parser = parse_link)]
    link: Vec<(String, String)>,

    /// Run it even if some of its inputs are not recorded; the result says so
    #[arg(long)]
    partial: bool,

    /// Override a setting of the recorded configuration; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,

    /// Start, seconds after the first value
    #[arg(long, value_name = "SECONDS", value_parser = parse_offset)]
    start: Option<u64>,

    /// End, seconds after the first value
    #[arg(long, value_name = "SECONDS", value_parser = parse_offset)]
    end: Option<u64>,

    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

fn parse_link(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((input, url)) if !input.is_empty() && url.len() > 1 && url.starts_with('/') => {
            Ok((input.into(), url.into()))
        }
        _ => Err("expected an input and its source, such as scan=/r2/laser/scan".into()),
    }
}

/// Module to try.
struct Candidate {
    name: String,
    kind: String,
    /// Origin: true if it is a module of the recorded agent.
    is_recorded: bool,
}

/// Runs one module on a recording.
/// Returns the exit code: 0 if its output equals the recorded one or none is recorded, and no tick failed; 1 if not; 2
/// if that can't be decided.
pub fn try_module(options: &TryOptions) -> Result<u8, Failure> {
    let (plugins, library) = plugins(options.library.as_deref())?;
    let own = library.as_ref().map(|library| library.plugin.clone());
    let kinds: Vec<Plugin> = plugins.iter().cloned().chain(own).collect();
    let candidate = candidate(options, &kinds)?;
    let set = library.map(|library| library.set);
    let sets = set.into_iter().chain(settings(options, &candidate)).collect();
    let plan = Plan {
        start: options.start,
        end: options.end,
        modules: SortedSet::from([candidate.name.clone()]),
        is_partial: options.partial,
        sets,
        ..Plan::default()
    };
    let mut player = Player::open(&options.bag, &plugins, plan)?;
    play::print_deviations(&player);
    let how = Options {
        mode: Mode::Staged,
        rate: player.rate(),
        armed: player.is_armed(),
        follows_files: false,
        recording: player.recording(None),
        playback: Some(player.playback()),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&player.configuration()?, &plugins, how)?;
    let played = player.run(&mut agent, &AtomicBool::new(false))?;
    agent.publish_timing();
    let outcome = player.outcome()?.unwrap_or_default();
    let values = last_values(&agent, outcome.properties.iter().map(|own| own.url.as_str()));
    let trial = ModuleTrial {
        ticks: Ticks::of(&agent, &candidate.name),
        candidate,
        played,
        misses: player.misses(),
        outcome,
        values,
    };
    match options.json {
        true => output::json(&trial.document()),
        false => trial.show(&options.bag),
    }
    Ok(trial.code())
}

/// Plugin of a library, and the setting that loads it.
struct TriedPlugin {
    plugin: Plugin,
    set: String,
}

/// Returns the program's plugins that the library does not replace.
/// Also the library's plugin, with the setting that loads it.
fn plugins(library: Option<&Path>) -> Result<(Vec<Plugin>, Option<TriedPlugin>), Failure> {
    let mut plugins = examples::plugins();
    let Some(file) = library else { return Ok((plugins, None)) };
    let file = std::path::absolute(file).map_err(|source| Failure::File { path: file.into(), source })?;
    let (plugin, ..) = plugin::load(&file)?;
    plugins.retain(|other| other.name() != plugin.name());
    let set = format!("plugins.{}.file={}", quoted(plugin.name()), quoted(&file.to_string_lossy()));
    Ok((plugins, Some(TriedPlugin { plugin, set })))
}

/// Returns the settings of the module.
fn settings(options: &TryOptions, candidate: &Candidate) -> Vec<String> {
    let Candidate { name, kind, is_recorded } = candidate;
    let mut sets = Vec::new();
    if !is_recorded {
        sets.push(format!("modules.{}.kind={}", quoted(name), quoted(kind)));
    }
    // Each tick of a module with a deadline is timed; no tick takes that long.
    sets.push(format!("modules.{}.deadline=\"60s\"", quoted(name)));
    sets.extend(options.link.iter().map(|(input, url)| {
        let input = input.trim_start_matches('/');
        format!("links.{}={}", quoted(&format!("{name}/{input}")), quoted(url))
    }));
    sets.push("log.targets.console=false".into());
    sets.extend(options.set.iter().cloned());
    sets
}

/// Result of a run of one module on a recording.
struct ModuleTrial<'a> {
    candidate: Candidate,
    played: PlayedRun,
    ticks: Ticks,
    misses: &'a [String],
    outcome: Recomputation,
    /// Last value of each property, by URL.
    values: SortedMap<String, Value>,
}

impl ModuleTrial<'_> {
    fn code(&self) -> u8 {
        match self.candidate.is_recorded {
            _ if self.ticks.has_failed() => 1,
            false => 0,
            true => play::code(&self.outcome, self.misses),
        }
    }

    fn document(&self) -> Value {
        let Self { candidate: Candidate { name, kind, is_recorded }, played, ticks, outcome, .. } = self;
        json!({
            "schema": "slate.try/1",
            "module": name,
            "type": kind,
            "is_recorded": is_recorded,
            "cycles": played.cycles,
            "ticks": ticks.ticks,
            "timed": ticks.timing.iter().copied().collect::<SortedMap<_, _>>(),
            "panics": ticks.panics,
            "condition": ticks.condition,
            "misses": self.misses,
            "properties": outcome.properties,
            "values": self.values,
            "unseen": if *is_recorded { &outcome.unseen[..] } else { &[] },
            "silent": if *is_recorded { &outcome.silent[..] } else { &[] },
            "unheard": outcome.unheard,
            "has_threads": outcome.has_threads,
            "unrepeated": outcome.unrepeated,
            "fresh_from": outcome.fresh_from,
            "first": outcome.first.as_ref().filter(|_| *is_recorded).map(|own| play::first(own, "recomputed")),
        })
    }

    fn show(&self, bag: &Path) {
        let Self { candidate: Candidate { name, kind, is_recorded }, played, outcome, .. } = self;
        let (file, cycles) = (printable(bag), counted(played.cycles, "cycle", "cycles"));
        let seconds = played.time as f64 * 1e-9;
        output::line(format_args!("{name} ({kind}) on {file}: {cycles}, up to {seconds:.3} s"));
        output::line(&self.ticks);
        if *is_recorded {
            return play::show(outcome, self.misses);
        }
        for own in &outcome.properties {
            let last = self.values.get(&own.url).map(Value::to_string).unwrap_or_default();
            let values = counted(own.only_recomputed, "value", "values");
            output::line(format_args!("{}  {values}, at last {last}", own.url));
        }
        if outcome.properties.is_empty() {
            output::line("it wrote nothing");
        }
    }
}

/// Statistics of its ticks.
struct Ticks {
    ticks: u64,
    panics: u64,
    condition: &'static str,
    /// Durations in nanoseconds.
    timing: Vec<(&'static str, u64)>,
}

impl Ticks {
    fn of(agent: &Agent, name: &str) -> Self {
        let (ticks, _, panics) = agent.counts(name).unwrap_or_default();
        let modules = agent.composer().modules();
        let condition =
            modules.iter().find(|module| module.name == name).map_or("", |module| module.condition);
        let figure = |field: &'static str| {
            let (value, _) = agent.board().read(&format!("{name}/histogram/{field}")).ok()??;
            Some((field, u64::try_from(value.as_integer()?).ok()?))
        };
        let timing = ["p50", "p99", "max"].into_iter().filter_map(figure).collect();
        Self { ticks, panics, condition, timing }
    }

    /// Returns whether a tick has failed.
    fn has_failed(&self) -> bool {
        self.panics > 0 || self.condition == "FAULTED"
    }
}

impl std::fmt::Display for Ticks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", counted(self.ticks, "tick", "ticks"))?;
        for (name, duration) in &self.timing {
            write!(f, ", {name} {:.1} us", *duration as f64 * 1e-3)?;
        }
        match self.panics {
            0 if self.has_failed() => write!(f, ", it has failed"),
            0 => write!(f, ", no fault"),
            1 => write!(f, ", one panic"),
            panics => write!(f, ", {panics} panics"),
        }
    }
}

/// Returns the last value of each property.
fn last_values<'a>(agent: &Agent, urls: impl Iterator<Item = &'a str>) -> SortedMap<String, Value> {
    let read = |url: &str| {
        let (value, _): (interface::Value, _) = agent.board().read(url.trim_start_matches('/')).ok()??;
        Some((url.to_owned(), serde_json::to_value(value).ok()?))
    };
    urls.filter_map(read).collect()
}

/// Returns the candidate module.
fn candidate(options: &TryOptions, plugins: &[Plugin]) -> Result<Candidate, Failure> {
    let wanted = options.module.trim_start_matches('/');
    let recorded = recorded_modules(&options.bag)?;
    if let Some(kind) = recorded.get(wanted) {
        return Ok(Candidate { name: wanted.into(), kind: kind.clone(), is_recorded: true });
    }
    let of_kind: Vec<&String> =
        recorded.iter().filter(|(_, kind)| *kind == wanted).map(|(name, _)| name).collect();
    match of_kind[..] {
        [] => {}
        // With links of its own it differs from the recorded ones.
        _ if !options.link.is_empty() => {}
        [name] => return Ok(Candidate { name: name.clone(), kind: wanted.into(), is_recorded: true }),
        _ => {
            let names: Vec<_> = of_kind.into_iter().map(String::as_str).collect();
            return Err(Failure::NoModule {
                module: wanted.into(),
                help: format!("several recorded modules are of that type, name one: {}", names.join(", ")),
            });
        }
    }
    let kinds = || plugins.iter().flat_map(Plugin::kinds).map(slate::module::ModuleKind::name);
    if kinds().any(|kind| kind == wanted) {
        return Ok(Candidate { name: wanted.into(), kind: wanted.into(), is_recorded: false });
    }
    let names: Vec<&str> = recorded.keys().map(String::as_str).chain(kinds()).collect();
    let near = nearest_names(wanted, names.iter().copied());
    let help = match near.is_empty() {
        true => {
            format!("the recorded modules are: {}", recorded.keys().cloned().collect::<Vec<_>>().join(", "))
        }
        false => format!("did you mean {}?", near.join(" or ")),
    };
    Err(Failure::NoModule { module: wanted.into(), help })
}

fn quoted(text: &str) -> String {
    // A text of TOML that has no line ends is one of JSON.
    Value::from(text).to_string()
}
