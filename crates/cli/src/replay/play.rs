//! Replay of a recording.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::json;
use slate::control::{ControlSurface, Server};
use slate::record::{Recorded, Recorder};
use slate::replay::{Difference, Plan, PlayedRun, Player, Recomputation};
use slate::runtime::recording::{Change, Recording};
use slate::runtime::{Agent, Mode, Options, printable};

use crate::examples;
use crate::failure::Failure;
use crate::output::{self, counted};
use crate::playback_console::open_playback;

/// Plays a recording; returns the exit code, 0 at the end of the recording.
pub fn play(file: &Path, plan: Plan, json: bool) -> Result<u8, Failure> {
    let plugins = examples::plugins();
    let is_paused = plan.is_paused;
    // A playback at maximum rate is over before a browser could open.
    let is_watched = plan.rate.is_some() || is_paused || plan.stays;
    let mut player = Player::open(file, &plugins, plan)?;
    print_deviations(&player);
    let database = player.configuration()?;
    let settings = database.current().record().clone();
    let recorder = settings.enabled.then(|| Recorder::new(&settings));
    let how = Options {
        mode: Mode::Staged,
        rate: player.rate(),
        armed: player.is_armed(),
        follows_files: false,
        log: recorder.iter().map(Recorder::log_target).collect(),
        recording: player.recording(recorder.clone().map(|recorder| Arc::new(recorder) as _)),
        playback: Some(player.playback()),
        calendar: player.date().map(|date| Arc::new(move || date) as _),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins, how)?;
    if let Some(recorder) = &recorder {
        let path = settings.file.as_ref().map(|file| file.value.clone());
        recorder.begin(&agent, &path.unwrap_or_else(|| PathBuf::from("recomputed.mcap")));
        // A run on replayed values can't be repeated from its configuration.
        recorder.changed(0, 0, &[Change::Other { what: format!("a playback of {}", printable(file)) }]);
    }
    agent.composer().control_playback(player.control());
    let stop = stop_on_interrupt();
    let surface = Arc::new(ControlSurface::new(&agent).map_err(|error| Failure::Unreachable(error.into()))?);
    let server = Server::open_on(Arc::clone(&surface));
    match &server {
        Ok(server) => announce(server, &player, is_paused),
        // It is played all the same.
        Err(error) => eprintln!("{error}"),
    }
    let console = is_watched.then(|| open_playback(surface, file)).flatten();
    let played = player.run(&mut agent, &stop)?;
    drop((server, console));
    let recorded = recorder.map(|recorder| recorder.end(&mut agent)).transpose()?;
    let outcome = player.outcome()?;
    match json {
        true => output::json(&document(&played, recorded.as_ref(), player.misses(), outcome.as_ref())),
        false => {
            show_played(&played, recorded.as_ref());
            if let Some(outcome) = &outcome {
                show(outcome, player.misses());
            }
        }
    }
    Ok(outcome.map_or(0, |outcome| code(&outcome, player.misses())))
}

/// Returns a flag that the first Ctrl-C sets; the second one ends the process.
fn stop_on_interrupt() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let is_stopping = Arc::clone(&stop);
    let handled = ctrlc::set_handler(move || {
        if is_stopping.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    if let Err(error) = handled {
        eprintln!("Ctrl-C will end the process at once: {error}");
    }
    stop
}

/// Prints the replayed recording, and the agent that replays it.
fn announce(server: &Server, player: &Player, is_paused: bool) {
    let (properties, time) = player.extent();
    let seconds = time as f64 * 1e-9;
    eprintln!("agent {} plays {properties} properties, {seconds:.3} s", server.name());
    if is_paused {
        eprintln!("paused: `slate replay resume` or `slate replay step` starts it");
    }
}

fn document(
    played: &PlayedRun,
    recorded: Option<&Recorded>,
    misses: &[String],
    outcome: Option<&Recomputation>,
) -> serde_json::Value {
    json!({
        "schema": "slate.replay/1",
        "values": played.values,
        "cycles": played.cycles,
        "time": played.time,
        "ended": played.is_whole,
        "recording": recorded.map(|recorded| &recorded.file),
        "misses": misses,
        "properties": outcome.map(|outcome| &outcome.properties),
        "unseen": outcome.map(|outcome| &outcome.unseen),
        "silent": outcome.map(|outcome| &outcome.silent),
        "unheard": outcome.map(|outcome| &outcome.unheard),
        "has_threads": outcome.map(|outcome| outcome.has_threads),
        "unrepeated": outcome.map(|outcome| &outcome.unrepeated),
        "fresh_from": outcome.and_then(|outcome| outcome.fresh_from),
        "first": outcome.and_then(|outcome| outcome.first.as_ref()).map(|own| first(own, "recomputed")),
    })
}

fn show_played(played: &PlayedRun, recorded: Option<&Recorded>) {
    let values = counted(played.values, "value", "values");
    let cycles = counted(played.cycles, "cycle", "cycles");
    let (seconds, end) = (played.time as f64 * 1e-9, if played.is_whole { "" } else { ", stopped" });
    output::line(format_args!("{values} in {cycles}, up to {seconds:.3} s{end}"));
    if let Some(recorded) = recorded {
        let values = counted(recorded.values, "value", "values");
        output::line(format_args!("recording: {} ({values})", printable(&recorded.file)));
    }
}

/// Returns the exit code: 0 if the recomputed values match, 1 if not, else 2.
/// Undecided: the modules lacked inputs that they had then, ran on threads, depended on an action that can't be
/// repeated, or have no recorded values.
pub fn code(outcome: &Recomputation, misses: &[String]) -> u8 {
    let is_all_as_then = misses.is_empty()
        && outcome.unrepeated.is_empty()
        && outcome.fresh_from.is_none()
        && !outcome.has_threads;
    match outcome.first {
        None if outcome.has_compared() => 0,
        None => 2,
        Some(_) if is_all_as_then => 1,
        Some(_) => 2,
    }
}

/// Prints the comparison of the recomputed values.
pub fn show(outcome: &Recomputation, misses: &[String]) {
    let count = |count: u64, what: &str| if count > 0 { format!("{count} {what}") } else { String::new() };
    let rows = outcome.properties.iter().map(|own| {
        let cells = [
            count(own.same, "the same"),
            count(own.different, "different"),
            count(own.only_recorded, "only recorded"),
            count(own.only_recomputed, "only recomputed"),
        ];
        let cells: Vec<_> = cells.into_iter().filter(|cell| !cell.is_empty()).collect();
        [own.url.clone(), cells.join(", ")]
    });
    output::columns(rows);
    let fresh = outcome.fresh_from.map(|time| format!("from fresh state at {:.3} s", time as f64 * 1e-9));
    match &outcome.first {
        Some(first) => {
            output::line(first);
            if outcome.has_threads {
                output::line(
                    "modules of this run had threads of their own: the values that a tick saw are not recorded, which may \
                     explain the difference",
                );
            }
            for what in &outcome.unrepeated {
                output::line(format_args!("{what}, which can't be repeated and may explain the difference"));
            }
            if let Some(fresh) = &fresh {
                output::line(format_args!(
                    "the modules began {fresh}: their recorded state is unknown, which may explain the difference"
                ));
            }
        }
        None if outcome.has_compared() => {
            let fresh = fresh.map_or(String::new(), |fresh| format!(", {fresh}"));
            let from = if misses.is_empty() { "" } else { ", with incomplete inputs" };
            let but =
                if outcome.unheard.is_empty() { "" } else { ", except messages that were not compared" };
            output::line(format_args!("identical{fresh}{from}{but}"));
        }
        None => {}
    }
    if !outcome.silent.is_empty() {
        output::line(format_args!("{} wrote nothing in either run", outcome.silent.join(", ")));
    }
    for (from, to) in &outcome.unheard {
        output::line(format_args!("not compared: messages of /{from} to /{to}"));
    }
    if !outcome.unseen.is_empty() {
        output::line(format_args!(
            "nothing of {} was recorded to compare: messages are compared when all senders to the same inbox run",
            outcome.unseen.join(", ")
        ));
    }
}

/// Returns the first difference as JSON.
/// `other` is the name of the value that is not recorded.
pub fn first(first: &Difference, other: &str) -> serde_json::Value {
    let Difference { time, url, field, recorded, replayed } = first;
    json!({ "time": time, "url": url, "field": field, "recorded": recorded, other: replayed })
}

/// Prints deviations of the replay from the recorded run.
pub fn print_deviations(player: &Player) {
    for miss in player.misses() {
        eprintln!("{}", output::harmless(format_args!("not as it was: {miss}")));
    }
    for (topic, why) in player.left_out() {
        eprintln!("{}", output::harmless(format_args!("not played: {topic}: {why}")));
    }
    for (topic, remark) in player.remarks() {
        eprintln!("{}", output::harmless(format_args!("{topic}: {remark}")));
    }
    for (topic, count) in player.backwards() {
        let what = if count == 1 { "one value has a time" } else { "values have times" };
        eprintln!(
            "{}",
            output::harmless(format_args!(
                "{topic}: {count} {what} before that of the one before; they are played at that one's time"
            ))
        );
    }
}
