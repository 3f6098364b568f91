//! What the main loop and the threads of modules cost: `cargo bench -p slate-runtime`, or one of them with its name:
//! `cargo bench -p slate-runtime -- stages`. With `--long` the runs are as long as the promises that they check.
#![allow(missing_docs, clippy::unwrap_used, clippy::disallowed_methods, reason = "a benchmark")]

use std::fmt::Write;
use std::hint::black_box;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::{Agent, Control, Mode, Options, Rate};

/// A number.
#[interface]
pub struct Number {
    /// The number.
    pub value: f64,
}

/// A moment of the wall clock.
#[interface]
pub struct Moment {
    /// Since the start of the benchmark.
    #[unit("ns")]
    pub nanoseconds: u64,
}

#[ports]
pub struct LinkIo {
    input: Input<Number>,
    output: Output<Number>,
}

/// Passes a number on, plus one.
pub struct Segment;

#[module(stage = Think)]
impl Module for Segment {
    type Io = LinkIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &LinkIo, _: &(), _: &Tick) -> Outcome {
        io.output.set(Number { value: io.input.value + 1.0 });
        Outcome::Ok
    }
}

#[ports]
pub struct NoIo {}

/// Does nothing.
pub struct Idle;

#[module(stage = Think)]
impl Module for Idle {
    type Io = NoIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), _: &NoIo, _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[ports]
pub struct FaultyIo {
    #[safe(Number { value: -1.0 })]
    output: Output<Number>,
}

/// Fails in some ticks, in turn by an error, by a panic, and by taking longer than its stage may.
pub struct Faulty;

#[module(stage = Think)]
impl Module for Faulty {
    type Io = FaultyIo;
    type Params = ();
    type State = u64;

    fn tick(_: &mut u64, io: &FaultyIo, _: &(), now: &Tick) -> Outcome {
        // Each has its own phase, so that no two are late at a time.
        let phase = now.random(|random| random.uniform(0.0, 1.0));
        io.output.set(Number { value: phase });
        Outcome::Ok
    }
}

#[ports]
pub struct StimulusIo {
    moment: Output<Moment>,
}

/// Writes when it wrote.
pub struct Stimulus;

#[module(stage = SensorAcquire, every = "1ms")]
impl Module for Stimulus {
    type Io = StimulusIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &StimulusIo, _: &(), _: &Tick) -> Outcome {
        io.moment.set(Moment { nanoseconds: nanoseconds() });
        Outcome::Ok
    }
}

#[ports]
pub struct ReactionIo {
    moment: Input<Moment>,
}

/// Notes how long ago its input was written.
pub struct Reaction;

#[module(stage = Act, on = moment)]
impl Module for Reaction {
    type Io = ReactionIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &ReactionIo, _: &(), _: &Tick) -> Outcome {
        let now = nanoseconds();
        REACTIONS.lock().unwrap().push(now - io.moment.nanoseconds);
        Outcome::Ok
    }
}

static START: LazyLock<Instant> = LazyLock::new(Instant::now);
static REACTIONS: Mutex<Vec<u64>> = Mutex::new(Vec::new());

fn nanoseconds() -> u64 {
    START.elapsed().as_nanos() as u64
}

fn agent(text: &str, options: Options) -> Agent {
    let configuration =
        Configuration::from_text("bench.toml", text, &configuration::Options::default()).unwrap();
    let plugins = [Plugin::linked::<Segment>(), Plugin::linked::<Stimulus>(), Plugin::linked::<Reaction>()];
    Agent::load(&configuration, &plugins, options).unwrap()
}

/// Modules in a row, each reading the one before, and one that is never due and stands for the time source.
fn row(modules: usize) -> Agent {
    let mut text = String::from("time.source = \"reaction\"\n[modules.reaction]\n");
    for module in 0..modules {
        write!(text, "[modules.m{module:02}]\nplugin = \"segment\"\n").unwrap();
    }
    text.push_str("[links]\n");
    for module in 1..modules {
        writeln!(text, "\"m{module:02}/input\" = \"m{:02}/output\"", module - 1).unwrap();
    }
    agent(&text, Options { rate: Rate::Max, ..Options::default() })
}

fn report(name: &str, unit: &str, mut times: Vec<f64>) {
    times.sort_by(f64::total_cmp);
    let at = |part: f64| times[((times.len() - 1) as f64 * part) as usize];
    println!(
        "{name:<44} p50 {:9.1} {unit}  p99 {:9.1} {unit}  max {:9.1} {unit}  ({} samples)",
        at(0.5),
        at(0.99),
        at(1.0),
        times.len()
    );
}

/// The time of one step of the main loop, in nanoseconds; reading the clock itself is measured beside it.
fn steps(name: &str, modules: usize) {
    let mut agent = row(modules);
    (0..10_000).for_each(|_| assert!(agent.step()));
    let times = (0..200_000)
        .map(|_| {
            let start = Instant::now();
            black_box(agent.step());
            start.elapsed().as_nanos() as f64
        })
        .collect();
    report(name, "ns", times);
}

fn clock() {
    let times = (0..200_000).map(|_| Instant::now().elapsed().as_nanos() as f64).collect();
    report("reading the clock twice (part of the others)", "ns", times);
}

/// From a value that one module writes to the tick of another that waits for it on a thread of its own.
fn reaction() {
    let text = "loop.period = \"10ms\"\n[modules.stimulus]\n[modules.reaction]\n[links]\n\
                \"reaction/moment\" = \"stimulus/moment\"\n";
    let mut agent = agent(text, Options { mode: Mode::Threaded, ..Options::default() });
    REACTIONS.lock().unwrap().reserve(10_000);
    agent.run(Box::new(|cycle| if cycle.number < 300 { Control::Continue } else { Control::Stop })).unwrap();
    let times = std::mem::take(&mut *REACTIONS.lock().unwrap());
    report(
        "a module waiting on a value, threaded",
        "us",
        times.iter().map(|time| *time as f64 * 1e-3).collect(),
    );
}

/// Two bare wake-ups: a thread is unparked and unparks the first one.
fn wakes() {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::new(AtomicU64::new(0));
    let answered = Arc::new(AtomicU64::new(0));
    let here: Thread = thread::current();
    let other = thread::spawn({
        let (stop, asked, answered) = (Arc::clone(&stop), Arc::clone(&asked), Arc::clone(&answered));
        move || {
            while !stop.load(Ordering::Acquire) {
                let number = asked.load(Ordering::Acquire);
                if answered.load(Ordering::Relaxed) == number {
                    thread::park();
                    continue;
                }
                answered.store(number, Ordering::Release);
                here.unpark();
            }
        }
    });
    let mut times = Vec::new();
    for number in 1..=3000 {
        thread::sleep(Duration::from_millis(1));
        let start = Instant::now();
        asked.store(number, Ordering::Release);
        other.thread().unpark();
        while answered.load(Ordering::Acquire) != number {
            thread::park();
        }
        times.push(start.elapsed().as_nanos() as f64 * 1e-3);
    }
    stop.store(true, Ordering::Release);
    other.thread().unpark();
    other.join().unwrap();
    report("two bare wake-ups, there and back", "us", times);
}

fn main() {
    // Under `cargo test` benches are only built and started.
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let wanted = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let wanted = |name: &str| wanted.as_ref().is_none_or(|wanted| name.contains(wanted.as_str()));
    if wanted("clock") {
        clock();
    }
    if wanted("cycle") {
        steps("an empty cycle", 0);
        steps("a cycle with one module", 1);
    }
    if wanted("row") {
        steps("a cycle with 17 modules in a row, 16 links", 17);
    }
    if wanted("wake") {
        wakes();
        reaction();
    }
}
