//! Modules that hang or panic, and defects of the predecessors: each agent continues with the rest, or
//! ends in order and says why.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use crate::common;
mod ends;
mod hangs;
mod modules;
mod panics;
mod predecessors;

use slate_module::Plugin;
use slate_runtime::{Agent, Control, Cycle, Observer, Options};

use common::load;
use modules::{Bomb, Player, Poster, Sleeper, Slow, Watcher};

fn agent(text: &str, options: Options) -> Agent {
    let more = [
        Plugin::linked::<Watcher>(),
        Plugin::linked::<Slow>(),
        Plugin::linked::<Sleeper>(),
        Plugin::linked::<Player>(),
        Plugin::linked::<Bomb>(),
        Plugin::linked::<Poster>(),
    ];
    load(text, &more, options).unwrap()
}

fn value(cycle: &Cycle<'_>, path: &str) -> Option<f64> {
    cycle.board.read(path).unwrap().and_then(|(value, _)| value.as_f64())
}

/// Stops after that many cycles.
fn after(cycles: u64) -> Observer {
    let mut left = cycles;
    Box::new(move |_| {
        left -= 1;
        if left == 0 { Control::Stop } else { Control::Continue }
    })
}

fn count(agent: &Agent, module: &str) -> u64 {
    agent.counts(module).unwrap().0
}
