//! A recording that is played.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::json;
use slate::record::replay::{Plan, Player};
use slate::runtime::remote::Server;
use slate::runtime::{Agent, Mode, Options};

use crate::examples;
use crate::failure::Failure;
use crate::output;

/// Plays it: 0 at its end.
pub fn play(file: &Path, plan: Plan, json: bool) -> Result<u8, Failure> {
    let plugins = examples::plugins();
    let mut player = Player::open(file, &plugins, plan)?;
    tell(&player);
    let database = player.configuration()?;
    let how = Options {
        mode: Mode::Staged,
        rate: player.rate(),
        armed: player.is_armed(),
        follows_files: false,
        playback: Some(player.playback()),
        calendar: player.date().map(|date| Arc::new(move || date) as _),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins, how)?;
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
        }
        // It is played all the same.
        Err(error) => eprintln!("{error}"),
    }
    let played = player.run(&mut agent, &stop)?;
    drop(server);
    let seconds = played.time as f64 * 1e-9;
    let end = if played.is_whole { "" } else { ", stopped" };
    match json {
        true => output::json(&json!({
            "values": played.values,
            "cycles": played.cycles,
            "time": played.time,
            "ended": played.is_whole,
        })),
        false => output::line(format_args!(
            "{} values in {} cycles, up to {seconds:.3} s{end}",
            played.values, played.cycles
        )),
    }
    Ok(0)
}

/// Says what is not played as it was.
pub fn tell(player: &Player) {
    for (topic, why) in player.left_out() {
        eprintln!("{}", output::harmless(format_args!("not played: {topic}: {why}")));
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
