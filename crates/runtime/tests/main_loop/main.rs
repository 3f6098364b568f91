//! The main loop: stages and their changes, late modules, warnings and measurements.
#![cfg(not(feature = "shuttle"))]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use crate::common;
mod faults;
mod lateness;
mod periods;
mod policy;
mod schedule;
mod threads;
mod timing;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use common::Number;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Control, End, Observer, Options, Rate, Schedule, ScheduledStage, Stage};

/// Ports of [`Witness`].
#[ports]
pub struct WitnessIo {
    place: Output<Number>,
}

/// Parameters of [`Witness`].
#[params]
pub struct WitnessParams {
    #[param(default = 0, doc = "sleeps for sleep_ms in that tick")]
    sleep_at: u64,
    #[param(default = 0, doc = "milliseconds")]
    sleep_ms: u64,
}

/// Writes how many ticks of witnesses there were before its own, so that the order of modules can be seen.
pub struct Witness;

static TICKS: AtomicU64 = AtomicU64::new(1);

#[module(stage = Think)]
impl Module for Witness {
    type Io = WitnessIo;
    type Params = WitnessParams;
    type State = ();

    fn tick(_: &mut (), io: &WitnessIo, params: &WitnessParams, now: &Tick) -> Outcome {
        if now.number() == params.sleep_at {
            std::thread::sleep(Duration::from_millis(params.sleep_ms));
        }
        io.place.set(Number { value: TICKS.fetch_add(1, Ordering::Relaxed) as f64 });
        Outcome::Ok
    }
}

fn load(text: &str, options: Options) -> Agent {
    common::load(text, &[Plugin::linked::<Witness>()], options).unwrap()
}

/// In lockstep, as fast as it goes.
fn lockstep(text: &str) -> Agent {
    let text = format!("time.source = \"clock\"\n{text}\n[modules.clock]\nkind = \"witness\"\n");
    load(&text, Options { rate: Rate::Max, ..Options::default() })
}

/// On the wall clock, with its log.
fn wall_clock(text: &str) -> (Agent, MemoryTarget) {
    let log = MemoryTarget::default();
    let options = Options { log: vec![Box::new(log.clone())], ..Options::default() };
    (load(text, options), log)
}

/// Witnesses of those names and stages.
fn witnesses(stages: &[(&str, &str)]) -> String {
    let module = |(name, stage)| format!("[modules.{name}]\nkind = \"witness\"\nstage = \"{stage}\"\n");
    stages.iter().copied().map(module).collect()
}

/// A loop of two stages.
fn sense_act() -> Schedule {
    let (sense, act) = Stage::ALL.split_at(5);
    let stage = |name: &str, members: &[Stage]| ScheduledStage {
        name: name.into(),
        members: members.into(),
        timeout: None,
    };
    Schedule::new(vec![stage("Sense", sense), stage("Act", act)]).unwrap()
}

/// Stops after that many cycles.
fn after(cycles: u64) -> Observer {
    let mut left = cycles;
    Box::new(move |_| {
        left -= 1;
        if left == 0 { Control::Stop } else { Control::Continue }
    })
}

fn run(agent: &mut Agent, cycles: u64) {
    assert_eq!(agent.run(after(cycles)).unwrap(), End::Stopped);
}

fn ticks(agent: &Agent, module: &str) -> u64 {
    agent.counts(module).unwrap().0
}

/// The modules in the order in which they ticked last.
fn order<'n>(agent: &Agent, names: &[&'n str]) -> Vec<&'n str> {
    let mut order = names.to_vec();
    order.sort_by(|a, b| {
        let place = |name| common::number(agent, &format!("{name}/place/value"));
        place(a).total_cmp(&place(b))
    });
    order
}

/// A field of a property that is a whole number.
fn whole(agent: &Agent, path: &str) -> u64 {
    let (value, _) = agent.board().read(path).unwrap().unwrap();
    value.as_f64().unwrap() as u64
}

/// The lines of a log that contain a text.
fn lines(log: &MemoryTarget, part: &str) -> Vec<String> {
    log.lines().into_iter().map(|line| line.text).filter(|text| text.contains(part)).collect()
}

/// Waits for what another thread does; false when it takes too long.
fn comes(mut condition: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while !condition() {
        if start.elapsed() > Duration::from_secs(30) {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    true
}

/// Something that an observer shares with its test.
type Collected<T> = Arc<Mutex<Vec<T>>>;
