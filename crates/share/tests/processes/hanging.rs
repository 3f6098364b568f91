//! An agent in this process whose loop hangs again and again, and one in another process that reads its actuator.
//!
//! A command says at which moment it was made, by the machine's clock, which is the same in both. `SLATE_HANGS` sets how many
//! hangs are looked at, and `SLATE_BUSY` how many threads are busy beside.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::{Agent, Control, Options};
use slate_share::agent::AgentSharing;
use slate_share::peers::{Setup, WantedProperty};
use slate_share::session;

use crate::agents::process::Process;
use crate::agents::{self, Folder, Number};

/// How long a command holds, nanoseconds.
const TIME_TO_LIVE: u64 = 40_000_000;

/// How much longer it may be seen, milliseconds.
const LATENESS: f64 = 20.0;

/// The machine's clock, nanoseconds.
fn monotonic() -> u64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

#[ports]
pub struct StumblerIo {
    wheel: slate_module::prelude::Command<Number>,
}

/// Commands a wheel with the moment, and hangs in every tenth tick.
pub struct Stumbler;

#[module(stage = Act)]
impl Module for Stumbler {
    type Io = StumblerIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &StumblerIo, _: &(), now: &Tick) -> Outcome {
        if now.number().is_multiple_of(10) {
            std::thread::sleep(Duration::from_millis(150));
        }
        io.wheel.send(Number { value: monotonic() }, Priority::Plan);
        Outcome::Ok
    }
}

/// Reads the wheel of the agent at that endpoint, and prints for each command that was not renewed how much longer than its time
/// to live it was seen, milliseconds.
pub fn be_a_witness(setup: Setup, endpoint: &str) {
    let agent = agents::Agent::start(setup);
    agent.peers.connect("hub", endpoint).unwrap();
    agent.peers.subscribe("hub", WantedProperty::new("wheel/command", session::Options::default())).unwrap();
    let (mut command, mut seen) = (0, 0);
    // Otherwise the parent process has ended.
    while rustix::process::getppid().is_some_and(|parent| parent.as_raw_nonzero().get() != 1) {
        let at = monotonic();
        match agent.number("agents/hub/wheel/command").unwrap_or(0) {
            0 if command != 0 => {
                println!("{}", (seen as f64 - (command + TIME_TO_LIVE) as f64) / 1e6);
                command = 0;
            }
            0 => {}
            other => (command, seen) = (other, at),
        }
        std::thread::sleep(Duration::from_micros(200));
    }
}

fn setting(name: &str, default: usize) -> usize {
    std::env::var(name).map_or(default, |text| text.parse().unwrap())
}

pub fn time_to_live_holds_for_another_agent(way: &'static str) {
    // The way to others is not what this is about.
    if way != "local" {
        return;
    }
    let folder = Folder::new();
    let endpoint = folder.endpoint("hub");
    let text = format!(
        "[agent]\nname = \"hub\"\n[loop]\nperiod = \"5ms\"\nhang = \"3s\"\n[share]\nlisten = \"{endpoint}\"\n\
         [modules.stumbler]\n[actuators.wheel]\ncommand = \"stumbler/wheel\"\ntime_to_live = \"40ms\"\n"
    );
    let database = Database::from_text("hub.toml", &text, Reading::default()).unwrap();
    let mut sharing = AgentSharing::default();
    sharing.limits = agents::limits();
    let options = Options { armed: true, sharing: Some(Box::new(sharing)), ..Options::default() };
    let mut agent = Agent::load_with(&database, &[Plugin::linked::<Stumbler>()], options).unwrap();
    let stopper = agent.stopper();
    let running = std::thread::spawn(move || agent.run(Box::new(|_| Control::Continue)));
    let busy = Arc::new(AtomicBool::new(true));
    for _ in 0..setting("SLATE_BUSY", 0) {
        let busy = Arc::clone(&busy);
        std::thread::spawn(move || {
            while busy.load(Ordering::Relaxed) {
                std::hint::spin_loop();
            }
        });
    }

    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["witness", "other", &endpoint]).stdout(Stdio::piped());
    let mut witness = Process::start(&mut command);
    let lines = BufReader::new(witness.0.stdout.take().unwrap()).lines();
    let lags = lines.take(setting("SLATE_HANGS", 9)).map(|line| line.unwrap().parse::<f64>().unwrap());
    let mut lags: Vec<f64> = lags.collect();
    busy.store(false, Ordering::Relaxed);
    stopper.stop();
    running.join().unwrap().unwrap();

    lags.sort_by(f64::total_cmp);
    let at = |part: f64| lags[((lags.len() - 1) as f64 * part) as usize];
    let (count, p50, p99, max) = (lags.len(), at(0.5), at(0.99), at(1.0));
    println!(
        "another agent: safe after {p50:.1} ms (p50), {p99:.1} ms (p99), {max:.1} ms (max) of {count} hangs"
    );
    // A busy machine may delay some.
    assert!(p50 < LATENESS, "{lags:?}");
}
