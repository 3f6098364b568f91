//! A recording that is played.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::json;
use slate::control::Server;
use slate::record::Recorder;
use slate::record::replay::{Difference, Plan, Player, Recomputation};
use slate::runtime::recording::{Change, Recording};
use slate::runtime::{Agent, Mode, Options, printable};

use crate::console::open_playback;
use crate::examples;
use crate::failure::Failure;
use crate::output::{self, counted};

/// Plays it: 0 at its end.
pub fn play(file: &Path, plan: Plan, json: bool) -> Result<u8, Failure> {
    let plugins = examples::plugins();
    // What goes as fast as it can is over before anybody looks.
    let is_paused = plan.is_paused;
    let is_watched = plan.rate.is_some() || is_paused || plan.stays;
    let mut player = Player::open(file, &plugins, plan)?;
    tell(&player);
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
        let path = settings
            .file
            .as_ref()
            .map_or_else(|| PathBuf::from("recomputed.mcap"), |file| file.value.clone());
        recorder.begin(&agent, &path);
        // A run on values of another one can't be made again from its configuration.
        let what = format!("a playback of {}", printable(file));
        recorder.changed(0, 0, &Change::Other { what });
    }
    agent.composer().control_playback(player.control());
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    // The first Ctrl-C ends it in good order, the second one the process.
    let handled = ctrlc::set_handler(move || {
        if asked.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    if let Err(error) = handled {
        eprintln!("Ctrl-C will end the process at once: {error}");
    }
    let server = Server::open(&agent);
    match &server {
        Ok(server) => {
            let (properties, time) = player.extent();
            let seconds = time as f64 * 1e-9;
            eprintln!("agent {} plays {properties} properties, {seconds:.3} s", server.name());
            if is_paused {
                eprintln!("it stands still until `slate replay resume` or `slate replay step`");
            }
        }
        // It is played all the same.
        Err(error) => eprintln!("{error}"),
    }
    let console = is_watched.then(|| open_playback(&agent, file)).flatten();
    let played = player.run(&mut agent, &stop)?;
    drop((server, console));
    let recorded = recorder.map(|recorder| recorder.end(&mut agent)).transpose()?;
    let outcome = player.outcome()?;
    match json {
        true => output::json(&json!({
            "schema": "slate.replay/1",
            "values": played.values,
            "cycles": played.cycles,
            "time": played.time,
            "ended": played.is_whole,
            "recording": recorded.as_ref().map(|recorded| &recorded.file),
            "misses": player.misses(),
            "properties": outcome.as_ref().map(|outcome| &outcome.properties),
            "unseen": outcome.as_ref().map(|outcome| &outcome.unseen),
            "silent": outcome.as_ref().map(|outcome| &outcome.silent),
            "unheard": outcome.as_ref().map(|outcome| &outcome.unheard),
            "has_threads": outcome.as_ref().map(|outcome| outcome.has_threads),
            "unrepeated": outcome.as_ref().map(|outcome| &outcome.unrepeated),
            "fresh_from": outcome.as_ref().and_then(|outcome| outcome.fresh_from),
            "first": outcome.as_ref().and_then(|outcome| outcome.first.as_ref()).map(|own| first(own, "recomputed")),
        })),
        false => {
            let (values, cycles) =
                (counted(played.values, "value", "values"), counted(played.cycles, "cycle", "cycles"));
            let (seconds, end) = (played.time as f64 * 1e-9, if played.is_whole { "" } else { ", stopped" });
            output::line(format_args!("{values} in {cycles}, up to {seconds:.3} s{end}"));
            if let Some(recorded) = &recorded {
                let values = counted(recorded.values, "value", "values");
                output::line(format_args!("recording: {} ({values})", printable(&recorded.file)));
            }
            if let Some(outcome) = &outcome {
                show(outcome, player.misses());
            }
        }
    }
    Ok(outcome.map_or(0, |outcome| code(&outcome, player.misses())))
}

/// 0 when what was recomputed is what is recorded, 1 when it is not, and 2 when that says nothing, as the modules had not all
/// that they had then, ran on threads, something was done that can't be made again, or nothing of them is recorded.
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

/// Says how what was recomputed compares.
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
                    "modules of this run had threads of their own: which values a tick saw is not recorded, and may be all that \
                     differs",
                );
            }
            for what in &outcome.unrepeated {
                output::line(format_args!("{what}, which can't be made again, and may be all that differs"));
            }
            if let Some(fresh) = &fresh {
                output::line(format_args!(
                    "the modules began {fresh}: what they remembered then is not recorded, and may be all that differs"
                ));
            }
        }
        None if outcome.has_compared() => {
            let fresh = fresh.map_or(String::new(), |fresh| format!(", {fresh}"));
            let from = if misses.is_empty() { "" } else { ", from less than they had then" };
            let but =
                if outcome.unheard.is_empty() { "" } else { ", but for messages that were not compared" };
            output::line(format_args!("identical{fresh}{from}{but}"));
        }
        None => {}
    }
    if !outcome.silent.is_empty() {
        output::line(format_args!("{} wrote nothing, neither then nor now", outcome.silent.join(", ")));
    }
    for (from, to) in &outcome.unheard {
        output::line(format_args!("not compared: messages of /{from} to /{to}"));
    }
    if !outcome.unseen.is_empty() {
        output::line(format_args!(
            "nothing of {} was recorded to compare: messages are compared when all who send to the same mailbox run",
            outcome.unseen.join(", ")
        ));
    }
}

/// The first difference, for JSON; `other` is what the value is called that is not recorded.
pub fn first(first: &Difference, other: &str) -> serde_json::Value {
    let Difference { time, url, field, recorded, replayed } = first;
    json!({ "time": time, "url": url, "field": field, "recorded": recorded, other: replayed })
}

/// Says what is not played as it was.
pub fn tell(player: &Player) {
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
