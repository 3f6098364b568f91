//! Benchmark of a robot's two routes.
//! Latency of a reflex from the sensor's write to the command after the gate, and the number of actions per second
//! through Execute. `cargo bench -p slate-robotics --bench routes`
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::disallowed_methods,
    missing_docs,
    reason = "a bench"
)]

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use slate::blackboard::channel::Latest;
use slate::interfaces::{Clearance, WheelSpeeds};
use slate::module::Plugin;
use slate::prelude::*;
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Control, Mode, Options, Rate};

#[ports]
struct SensorIo {
    range: Output<Clearance>,
}

/// Range sensor that reports an approaching obstacle, a hundred times a second.
struct RangeSensor;

#[module(stage = SensorAcquire, every = "10ms")]
impl Module for RangeSensor {
    type Io = SensorIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SensorIo, _: &(), _: &Tick) -> Outcome {
        io.range.set(Clearance { distance: 0.1 });
        Outcome::Ok
    }
}

#[ports]
struct Near {
    range: Input<Clearance>,
}

struct Avoid;

impl ReactiveModel for Avoid {
    const NAME: &'static str = "avoid";
    type Sensors = Near;
    type Params = ();
    type State = ();

    fn run(_: &mut (), sensors: &Near, _: &(), _: &Tick) -> Option<ActionRequest> {
        (sensors.range.updated()?.distance < 0.3).then(|| Evade::request(()))
    }
}

#[ports]
struct Body {
    wheels: Command<WheelSpeeds>,
}

/// Turns away for a moment.
#[derive(Serialize, Deserialize)]
struct Evade {
    done: bool,
}

impl ActionKind for Evade {
    const KIND: &'static str = "Evade";
    type Arguments = ();

    fn start((): ()) -> Self {
        Self { done: false }
    }
}

impl Action<Body> for Evade {
    fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
        if std::mem::replace(&mut self.done, true) {
            return Step::Done;
        }
        acting.body.wheels.send(WheelSpeeds { left: -1.0, right: 1.0 }, acting.priority);
        Step::Running
    }
}

/// Action that is done at once.
#[derive(Serialize, Deserialize)]
struct Nothing {}

impl ActionKind for Nothing {
    const KIND: &'static str = "Nothing";
    type Arguments = ();

    fn start((): ()) -> Self {
        Self {}
    }
}

impl Action<Body> for Nothing {
    fn act(&mut self, _: &Acting<'_, Body>) -> Step {
        Step::Done
    }
}

repertoire! {
    enum Actions for Body { Evade, Nothing }
}

#[ports]
struct NoNotice {}

/// Plans as many actions as Execute takes in a cycle.
struct Busy;

impl Plan for Busy {
    const NAME: &'static str = "busy";
    type Noticed = NoNotice;
    type Params = ();
    type State = ();

    fn run(_: &mut (), _: &NoNotice, _: &Situation<'_>, _: &(), _: &Tick, plan: &mut Agenda<'_>) {
        for _ in 0..32 {
            plan.append(Nothing::request(()));
        }
    }
}

fn agent(text: &str, mode: Mode, rate: Rate) -> Agent {
    let configuration =
        Configuration::from_text("bench.toml", text, &configuration::Options::default()).unwrap();
    let plugins: Vec<Plugin> = vec![
        Plugin::linked::<RangeSensor>(),
        slate::mapek::reactive::<Avoid>().into(),
        slate::mapek::execute::<Actions>().into(),
        slate::mapek::plan::<Busy>().into(),
    ];
    Agent::load(&configuration, &plugins, Options { mode, rate, armed: true, ..Options::default() }).unwrap()
}

fn print(what: &str, mut nanoseconds: Vec<u64>) -> f64 {
    nanoseconds.sort_unstable();
    let at = |part: f64| nanoseconds[((nanoseconds.len() - 1) as f64 * part) as usize] as f64 / 1000.0;
    println!(
        "{what:58} p50 {:8.1} us  p99 {:8.1} us  max {:8.1} us  ({} samples)",
        at(0.5),
        at(0.99),
        at(1.0),
        nanoseconds.len()
    );
    at(0.5)
}

/// Measures the lower bound: a chain of two wake-ups of sleeping threads.
fn two_wakes(rounds: usize) -> Vec<u64> {
    let (sent, got) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
    let start = Instant::now();
    let (last_sent, last_got) = (Arc::clone(&sent), Arc::clone(&got));
    let last = thread::spawn(move || {
        let mut times = Vec::new();
        while times.len() < rounds {
            thread::park();
            let at = last_sent.swap(0, Ordering::AcqRel);
            if at != 0 {
                times.push(start.elapsed().as_nanos() as u64 - at);
                last_got.fetch_add(1, Ordering::Release);
            }
        }
        times
    });
    let third = last.thread().clone();
    let middle_got = Arc::clone(&got);
    let middle = thread::spawn(move || {
        while (middle_got.load(Ordering::Acquire) as usize) < rounds {
            thread::park();
            third.unpark();
        }
    });
    for _ in 0..rounds {
        thread::sleep(Duration::from_millis(10));
        let before = got.load(Ordering::Acquire);
        sent.store(start.elapsed().as_nanos() as u64, Ordering::Release);
        middle.thread().unpark();
        while got.load(Ordering::Acquire) == before {
            thread::sleep(Duration::from_millis(1));
        }
    }
    middle.thread().unpark();
    let times = last.join().unwrap();
    middle.join().unwrap();
    times
}

const ROBOT: &str = r#"
[loop]
period = "5ms"
[modules.range_sensor]
[modules.avoid]
[modules.execute]
[links]
"avoid/range" = "range_sensor/range"
"execute/reflexes" = "avoid/reflex"
[actuators.wheels]
command = "execute/wheels"
"#;

/// Measures reflex latencies on the agent's clock, ns.
/// From the stamp of the sensor's value to the stamp of the command that passed the gate.
fn reflex(samples: usize) -> Vec<u64> {
    let mut agent = agent(ROBOT, Mode::Threaded, Rate::REALTIME);
    let reader = |path: &str| agent.board().find(path).unwrap().0.channel().unwrap().latest().unwrap();
    let (mut range, mut command) = (reader("range_sensor/range"), reader("wheels/command"));
    let stopper = agent.stopper();
    let times = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&times);
    // Looks from the side, as a tool would, and so does not take part in what is measured.
    let watcher = thread::spawn(move || {
        let is_turning =
            |command: &Latest| command.value().is_some_and(|loan| loan.bytes().iter().any(|byte| *byte != 0));
        let mut last = 0;
        while seen.lock().unwrap().len() < samples {
            thread::sleep(Duration::from_micros(500));
            range.refresh();
            command.refresh();
            let Some(sensed) = range.value().map(|loan| loan.stamp()) else { continue };
            let given = command.value().map_or(0, |loan| loan.stamp().time);
            // The first command after a new value.
            if sensed.sequence != last && is_turning(&command) && given >= sensed.time {
                last = sensed.sequence;
                seen.lock().unwrap().push(given - sensed.time);
            }
        }
        stopper.stop();
    });
    agent.run(Box::new(|_| Control::Continue)).unwrap();
    watcher.join().unwrap();
    Arc::try_unwrap(times).unwrap().into_inner().unwrap()
}

fn actions_per_second() -> f64 {
    let text = "time.source = \"execute\"\n[modules.busy]\n[modules.execute]\n[links]\n\"execute/plan\" = \"busy/plan\"\n\"busy/situation\" = \"execute/status\"\n[actuators.wheels]\ncommand = \"execute/wheels\"\n";
    let mut agent = agent(text, Mode::Staged, Rate::Max);
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(1) {
        for _ in 0..100 {
            agent.step();
        }
    }
    let (value, _) = agent.board().read("execute/status/completed").unwrap().unwrap();
    value.as_f64().unwrap() / start.elapsed().as_secs_f64()
}

fn main() {
    // Cargo passes `--bench`; anything else is of no use here.
    let mut ratios = Vec::new();
    for round in 1..=3 {
        println!("round {round}");
        let floor = print("two bare wake-ups, each of a sleeping thread", two_wakes(300));
        let reflex = print("reflex: sensor written to command passed, threaded", reflex(300));
        ratios.push(reflex / floor);
        println!("ratio of the medians {:.2}", reflex / floor);
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "ratio, median of the rounds {:.2} (RoCS, measured: 74 to 92 ms, three polls of 50 ms)",
        ratios[1]
    );
    println!("actions through the pipeline {:.0} per second (RoCS, measured: 21)", actions_per_second());
}
