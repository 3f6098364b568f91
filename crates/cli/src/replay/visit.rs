//! Playback that is only looked at.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use slate::control::{Client, ControlSurface, Server};
use slate::replay::{Plan, Player};
use slate::runtime::{Agent, Mode, Options};

use crate::examples;
use crate::failure::Failure;
use crate::playback_console::add_world;

/// Opens a recording as a paused playback, and calls a function with a client.
pub fn with_playback<T: Send>(
    file: &Path,
    look: impl FnOnce(&mut Client) -> Result<T, Failure> + Send,
) -> Result<T, Failure> {
    let plugins = examples::plugins();
    let plan = Plan { is_paused: true, stays: true, ..Plan::default() };
    let mut player = Player::open(file, &plugins, plan)?;
    let database = player.configuration()?;
    let how = Options {
        mode: Mode::Staged,
        follows_files: false,
        recording: player.recording(None),
        playback: Some(player.playback()),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins, how)?;
    agent.composer().control_playback(player.control());
    let surface = Arc::new(ControlSurface::new(&agent).map_err(|error| Failure::Unreachable(error.into()))?);
    add_world(&surface, file);
    let server = Server::open_on(surface).map_err(Failure::Unreachable)?;
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let looking = scope.spawn(|| {
            let seen = Client::connect(server.name())
                .map_err(Failure::from)
                .and_then(|mut client| look(&mut client));
            stop.store(true, Ordering::Relaxed);
            seen
        });
        let played = player.run(&mut agent, &stop);
        let seen = looking.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        played?;
        seen
    })
}
