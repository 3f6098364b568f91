//! Teams of simulated robots in a bad network: however they are partitioned, restarted and robbed of their disks, all
//! come to hold the same bytes, and what they hold is what was said.
//!
//! Usage: `team [--first SEED] [--seeds N]`, where N is the number of runs of 100 robots. A run that fails prints its seed.
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and says how long it took"
)]

mod network;
mod random;
mod simulation;
mod truth;

use std::time::Instant;

use network::Weather;
use simulation::{Scenario, Simulation};
use slate_share::knowledge::Limits;

const BAD: Weather = Weather { loss: 300, duplication: 100, delay: 100 };

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let after = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1)?.parse::<u64>().ok()
    };
    let first = after("--first").unwrap_or(0);
    let seeds = after("--seeds").unwrap_or(20);

    let team = Scenario {
        robots: 100,
        acquaintances: 3,
        weather: BAD,
        limits: Limits::default(),
        trouble: 9,
        talk: 150,
        words: 1,
        restarts: 10,
        rounds: 25,
    };
    // Small messages and few facts: lives come in parts, retractions are forgotten and earlier lives closed.
    let tight = Limits { facts: 16, key: 8, value: 8, message: 320, stages: 4, ..Limits::default() };
    let tight =
        Scenario { robots: 12, limits: tight, trouble: 120, talk: 500, words: 16, rounds: 200, ..team };
    let crowd = Scenario { robots: 1000, trouble: 8, talk: 50, restarts: 5, rounds: 40, ..team };

    let mut failures = 0;
    failures += campaign("100 robots", team, first, seeds);
    failures += campaign("12 robots with little room", tight, first, (seeds / 20).max(20));
    failures += campaign("1000 robots", crowd, first, seeds.div_ceil(1000));
    assert_eq!(failures, 0, "see above");
}

/// Runs a scenario with many seeds, and says how it went.
fn campaign(name: &str, scenario: Scenario, first: u64, seeds: u64) -> u64 {
    let begin = Instant::now();
    let (mut rounds, mut failures, mut messages, mut bytes) = (Vec::new(), 0, 0, 0);
    let (mut memory, mut restarts) = (0, 0);
    let runs = std::thread::scope(|scope| {
        let of = |worker| {
            (first + worker..first + seeds)
                .step_by(2)
                .map(move |seed| (seed, Simulation::new(scenario, seed).run()))
        };
        let workers = [0, 1].map(|worker| scope.spawn(move || of(worker).collect::<Vec<_>>()));
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect::<Vec<_>>()
    });
    for (seed, outcome) in runs {
        match outcome {
            Ok(outcome) => {
                rounds.push(outcome.rounds);
                messages += outcome.messages;
                bytes += outcome.bytes;
                memory = memory.max(outcome.memory);
                restarts += outcome.restarts;
            }
            Err(reason) => {
                failures += 1;
                println!("{name}, seed {seed}: {reason}");
            }
        }
    }
    rounds.sort_unstable();
    let (median, most) = (rounds.get(rounds.len() / 2), rounds.last());
    println!(
        "{name}: {seeds} seeds, {failures} failures, identical after {} rounds (median), {} at most; per run {} restarts, \
         {} messages of {} bytes; memory of a replica {} KiB at most; {:.1} s",
        median.unwrap_or(&0),
        most.unwrap_or(&0),
        restarts / seeds,
        messages / seeds,
        bytes / messages.max(1),
        memory / 1024,
        begin.elapsed().as_secs_f64(),
    );
    failures
}
