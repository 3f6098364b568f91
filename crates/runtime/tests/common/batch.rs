//! Many faults at a time: errors, panics and steps that do not return in time, over a hundred modules; and ten modules that
//! must not notice.
#![allow(dead_code, reason = "the test and the benchmark use different parts of it")]
#![allow(clippy::panic, reason = "it is there to panic")]

use std::fmt::Write;
use std::sync::Once;
use std::time::{Duration, Instant};

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::{Agent, Control, End, Options};

/// A sign of life.
#[interface]
pub struct Sign {
    /// The number of the tick.
    pub tick: u64,
}

/// Ports of [`Faulty`] and [`Steady`].
#[ports]
pub struct SignIo {
    #[safe(Sign { tick: 0 })]
    sign: Output<Sign>,
}

/// Parameters of [`Faulty`].
#[params]
pub struct FaultyParams {
    #[param(default = 0, doc = "tells it from the others")]
    number: u64,
}

/// Ticks from one fault to the next: more than those after which a panic is not the next one of a row.
const INTERVAL: u64 = 101;
/// How long a step may take, and how long one is that does not return in time.
const HANG: Duration = Duration::from_millis(50);
const LATE: Duration = Duration::from_millis(60);

/// Has a fault in some ticks: an error, a panic and a late step in turn.
pub struct Faulty;

#[module(stage = Think)]
impl Module for Faulty {
    type Io = SignIo;
    type Params = FaultyParams;
    type State = ();

    fn tick(_: &mut (), io: &SignIo, params: &FaultyParams, now: &Tick) -> Outcome {
        io.sign.set(Sign { tick: now.number() });
        // Each has its own phase.
        let phased = now.number() + params.number * 37;
        if phased.is_multiple_of(INTERVAL) {
            match (phased / INTERVAL + params.number) % 3 {
                0 => return Outcome::Failed,
                1 => panic!("injected"),
                _ => std::thread::sleep(LATE),
            }
        }
        Outcome::Ok
    }
}

/// Has no fault.
pub struct Steady;

#[module(stage = Act)]
impl Module for Steady {
    type Io = SignIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SignIo, _: &(), now: &Tick) -> Outcome {
        io.sign.set(Sign { tick: now.number() });
        Outcome::Ok
    }
}

/// What came of it.
#[derive(Debug)]
pub struct Batch {
    pub end: End,
    pub cycles: u64,
    /// Panics, and late steps that were given up.
    pub panics: u64,
    pub late: u64,
    /// Cycles that the steady modules missed, all together.
    pub missed: u64,
    /// Ticks of the faulty ones in the last cycles, at least.
    pub alive: bool,
    /// Growth from a quarter of the run to its end: memory in bytes, and threads.
    pub memory: i64,
    pub threads: i64,
}

/// Runs so many cycles; about one in each is at fault.
pub fn run(cycles: u64) -> Batch {
    silence();
    let mut text = format!("[loop]\nperiod = \"1ms\"\nhang = \"{}ms\"\n", HANG.as_millis());
    for number in 0..100 {
        write!(text, "[modules.f{number:02}]\nkind = \"faulty\"\nparams.number = {number}\n").unwrap();
    }
    for (number, stage) in ["SensorAcquire", "PostLoop"].into_iter().cycle().take(10).enumerate() {
        write!(text, "[modules.s{number}]\nkind = \"steady\"\nstage = \"{stage}\"\n").unwrap();
    }
    let configuration =
        Configuration::from_text("batch.toml", &text, &configuration::Options::default()).unwrap();
    let plugins = [Plugin::linked::<Faulty>(), Plugin::linked::<Steady>()];
    let mut agent = Agent::load(&configuration, &plugins, Options::default()).unwrap();
    let composer = agent.composer();
    let mut before = (0, 0);
    let (mut late, mut was_late) = (0, Vec::new());
    let (sender, receiver) = std::sync::mpsc::channel();
    let end = agent.run(Box::new(move |cycle| {
        let modules = composer.modules();
        let is_late = modules.iter().map(|module| module.condition == "LATE");
        late += is_late
            .clone()
            .zip(was_late.iter().chain([false].iter().cycle()))
            .filter(|(is, was)| *is && !**was)
            .count() as u64;
        was_late = is_late.collect();
        if cycle.number == cycles / 4 {
            before = footprint();
        }
        if cycle.number < cycles {
            return Control::Continue;
        }
        sender.send((before, late)).unwrap();
        Control::Stop
    }));
    let (before, late) = receiver.recv().unwrap_or_default();
    // Threads that were late return, and those that are too many end.
    let start = Instant::now();
    while footprint().1 > before.1 && start.elapsed() < Duration::from_secs(5) {
        std::thread::sleep(Duration::from_millis(10));
    }
    let after = footprint();
    let counts = |name: &str| agent.counts(name).unwrap();
    let steady = (0..10).map(|number| counts(&format!("s{number}")).0);
    let faulty: Vec<_> = (0..100).map(|number| counts(&format!("f{number:02}"))).collect();
    let fewest = faulty.iter().map(|counts| counts.0).min().unwrap_or(0);
    Batch {
        end: end.unwrap(),
        cycles,
        panics: faulty.iter().map(|counts| counts.2).sum(),
        late,
        missed: steady.map(|ticks| cycles - ticks).sum(),
        alive: fewest * 10 > cycles * 5,
        memory: after.0 - before.0,
        threads: after.1 - before.1,
    }
}

/// The resident memory of this process in bytes, and its threads.
fn footprint() -> (i64, i64) {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let field = |name: &str| {
        let line = status.lines().find(|line| line.starts_with(name))?;
        line.split_whitespace().nth(1)?.parse::<i64>().ok()
    };
    (field("VmRSS:").unwrap_or(0) * 1024, field("Threads:").unwrap_or(0))
}

/// Panics that are meant are not printed.
fn silence() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let print = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if info.payload().downcast_ref::<&str>() != Some(&"injected") {
                print(info);
            }
        }));
    });
}
