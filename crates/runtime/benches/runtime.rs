//! Benchmarks of the main loop and of module threads.
//! Run all with `cargo bench -p slate-runtime`, or one by its name: `cargo bench -p slate-runtime -- stages`. With
//! `--long` the runs are as long as the promises that they check.
#![allow(missing_docs, clippy::unwrap_used, clippy::disallowed_methods, reason = "a benchmark")]

#[path = "../tests/common/batch.rs"]
mod batch;

use std::fmt::Write;
use std::hint::black_box;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::synchronization::{Count, Synchronization};
use slate_runtime::{Agent, Control, Cycle, Mode, Options, Rate, Stage};

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
        io.output.set(Number { value: io.input.get().map_or(0.0, |input| input.value) + 1.0 });
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

/// Takes longer than it may in one of a hundred ticks.
pub struct Sleeper;

#[module(stage = Act)]
impl Module for Sleeper {
    type Io = NoIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), _: &NoIo, _: &(), now: &Tick) -> Outcome {
        if now.number().is_multiple_of(100) {
            thread::sleep(Duration::from_millis(30));
        }
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
    moment: Required<Moment>,
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
    let plugins = [
        Plugin::linked::<Segment>(),
        Plugin::linked::<Stimulus>(),
        Plugin::linked::<Reaction>(),
        Plugin::linked::<Idle>(),
        Plugin::linked::<Sleeper>(),
    ];
    Agent::load(&configuration, &plugins, options).unwrap()
}

/// Chain of modules, each reading the one before.
/// A further module is never due and stands for the time source.
fn row(modules: usize) -> Agent {
    let mut text = String::from("time.source = \"reaction\"\n[modules.reaction]\n");
    for module in 0..modules {
        write!(text, "[modules.m{module:02}]\nkind = \"segment\"\n").unwrap();
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

/// Measures the time of one step of the main loop, ns.
/// The cost of reading the clock itself is measured beside it.
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

/// Measures the latency from a module's write to the tick of its reader.
/// The reader waits for the value on a thread of its own.
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

/// Measures cycles of ten stages of three modules, as fast as possible.
/// Each module reads the one before; the clock is the wall clock.
fn stages(workers: usize, cycles: u64) {
    let mut text = String::new();
    for (number, stage) in Stage::ALL.iter().flat_map(|stage| [stage; 3]).enumerate() {
        let stage = stage.name();
        write!(text, "[modules.m{number:02}]\nkind = \"segment\"\nstage = \"{stage}\"\n").unwrap();
    }
    text.push_str("[links]\n");
    for module in 1..30 {
        // With workers, those of a stage do not depend on each other.
        let before = if workers == 0 { module - 1 } else { module / 3 * 3 };
        if before < module && (workers == 0 || module % 3 == 0) {
            writeln!(text, "\"m{module:02}/input\" = \"m{:02}/output\"", module - 1).unwrap();
        }
    }
    let mut agent =
        agent(&text, Options { rate: Rate::Max, workers, always_help: workers > 0, ..Options::default() });
    let mut times = Vec::with_capacity(cycles as usize);
    let mut last = None;
    let observer = move |cycle: &Cycle<'_>| {
        let now = nanoseconds();
        if let Some(last) = last.replace(now) {
            times.push((now - last) as f64 * 1e-3);
        }
        if cycle.number < cycles {
            return Control::Continue;
        }
        // A lost wake-up is found after 10 ms at the latest.
        let stalled = times.iter().filter(|time| **time > 9000.0).count();
        report(&format!("ten stages of three modules, {workers} workers"), "us", std::mem::take(&mut times));
        println!("{:<44} {stalled} of {cycles} cycles took longer than 9 ms", "");
        Control::Stop
    };
    agent.run(Box::new(observer)).unwrap();
}

/// Measures a thousand modules that do nothing.
/// First at 1 kHz, so that other programs may use the caches in between, then cycle after cycle without a pause.
fn thousand(duration: Duration) {
    for (name, rate) in [("a thousand modules, each millisecond", Rate::REALTIME), ("in a row", Rate::Max)] {
        let mut text = String::from("loop.period = \"1ms\"\n");
        for module in 0..1000 {
            write!(text, "[modules.m{module:03}]\nkind = \"idle\"\n").unwrap();
        }
        let mut agent = agent(&text, Options { rate, ..Options::default() });
        let start = Instant::now();
        let more = move || start.elapsed() < duration;
        agent.run(Box::new(move |_| if more() { Control::Continue } else { Control::Stop })).unwrap();
        let of = |path: &str| agent.board().read(path).unwrap().unwrap().0.as_f64().unwrap();
        let cycle = |part: &str| of(&format!("loop/histogram/{part}")) * 1e-3;
        println!(
            "{name:<44} p50 {:9.1} us  p99 {:9.1} us  max {:9.1} us  ({} samples), {} overruns",
            cycle("p50"),
            cycle("p99"),
            cycle("max"),
            of("loop/histogram/count"),
            of("loop/state/overruns")
        );
    }
    floor(duration, Duration::from_micros(100));
}

/// Measures the overruns of a bare thread with a period of 1 ms.
/// The thread works for `work` in each period. This is the lower bound of any framework on this machine.
fn floor(duration: Duration, work: Duration) {
    let period = Duration::from_millis(1);
    let start = Instant::now();
    let (mut next, mut overruns, mut times) = (start, 0, Vec::new());
    while start.elapsed() < duration {
        thread::sleep(next.saturating_duration_since(Instant::now()));
        let began = Instant::now();
        while began.elapsed() < work {
            std::hint::spin_loop();
        }
        times.push(began.elapsed().as_nanos() as f64 * 1e-3);
        next += period;
        if Instant::now() > next {
            overruns += 1;
            while next < Instant::now() {
                next += period;
            }
        }
    }
    report("a bare thread that works for 100 us each", "us", times);
    println!("{:<44} {overruns} overruns", "");
}

/// Measures the latency from a point's emit to the waiting thread.
/// A bare futex is measured in turn with it. Both threads sleep for a while before, and run on other cores.
fn notify(rounds: u64) {
    let synchronization = Synchronization::default();
    let emitter = synchronization.emitter("/stage/Act/start", "bench").unwrap();
    let point = synchronization.point("/stage/Act/start").unwrap();
    let mut seen = Count::ZERO;
    let waiter = Waiter::start(1, rounds, move |_| {
        seen = point.wait(seen, Duration::from_secs(60)).unwrap();
    });
    let word = Arc::new(AtomicU32::new(0));
    let slept = Arc::clone(&word);
    let bare = Waiter::start(1, rounds, move |round| {
        while slept.load(Ordering::Acquire) == round as u32 {
            futex::wait(&slept, round as u32);
        }
    });
    futex::pin(0);
    let (mut points, mut futexes) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        points.push(waiter.time(|| emitter.emit()));
        futexes.push(bare.time(|| {
            word.fetch_add(1, Ordering::Release);
            futex::wake(&word);
        }));
    }
    futex::unpin();
    let median = |times: &[f64]| {
        let mut sorted = times.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    let ratio = median(&points) / median(&futexes);
    report("a thread on another core, by a point", "us", points);
    report("the same by a bare futex", "us", futexes);
    println!("{:<44} {ratio:.2} times a bare futex", "");
}

/// A thread that notes when it was woken.
struct Waiter {
    woken: Arc<AtomicU64>,
}

impl Waiter {
    fn start(core: usize, rounds: u64, mut wait: impl FnMut(u64) + Send + 'static) -> Self {
        let woken = Arc::new(AtomicU64::new(0));
        let noted = Arc::clone(&woken);
        thread::spawn(move || {
            futex::pin(core);
            for round in 0..rounds {
                wait(round);
                noted.store(nanoseconds(), Ordering::Release);
            }
        });
        Self { woken }
    }

    /// From a wake-up to the thread that runs, microseconds.
    fn time(&self, wake: impl FnOnce()) -> f64 {
        // Until it sleeps again.
        thread::sleep(Duration::from_micros(300));
        self.woken.store(0, Ordering::Release);
        let start = nanoseconds();
        wake();
        loop {
            match self.woken.load(Ordering::Acquire) {
                0 => std::hint::spin_loop(),
                woken => return woken.saturating_sub(start) as f64 * 1e-3,
            }
        }
    }
}

/// Measures the delay from a stage's timeout to the next stage.
fn timeouts() {
    let text = "[loop]\nperiod = \"1ms\"\ntimeouts.Act = \"5ms\"\n[modules.sleeper]\n";
    let mut agent = agent(text, Options::default());
    let mut times = Vec::new();
    let mut last = 0;
    let observer = move |cycle: &Cycle<'_>| {
        let now = nanoseconds();
        let took = std::mem::replace(&mut last, now);
        // A cycle of a millisecond, or one in which the stage took its time.
        let took = (now - took) as f64 * 1e-3;
        if cycle.number > 1 && took > 4000.0 {
            times.push(took - 6000.0);
        }
        if times.len() < 100 && cycle.number < 100_000 {
            return Control::Continue;
        }
        report("from a stage's timeout to the next stage", "us", std::mem::take(&mut times));
        Control::Stop
    };
    agent.run(Box::new(observer)).unwrap();
}

/// Ten thousand faults over a hundred modules.
fn faults(cycles: u64) {
    let batch = batch::run(cycles);
    println!(
        "faults of 100 modules in {cycles} cycles: {} panics, {} late steps; {} cycles missed by ten others; \
         {:+} KiB of memory, {:+} threads; {:?}",
        batch.panics,
        batch.late,
        batch.missed,
        batch.memory / 1024,
        batch.threads,
        batch.end
    );
}

/// System calls that the standard library does not offer.
#[allow(unsafe_code, reason = "system calls")]
mod futex {
    use std::sync::atomic::AtomicU32;

    pub fn wait(word: &AtomicU32, expected: u32) {
        let none = std::ptr::null::<libc::timespec>();
        // SAFETY: the word lives during the call.
        unsafe {
            libc::syscall(
                libc::SYS_futex,
                word.as_ptr(),
                libc::FUTEX_WAIT | libc::FUTEX_PRIVATE_FLAG,
                expected,
                none,
            )
        };
    }

    pub fn wake(word: &AtomicU32) {
        // SAFETY: as above.
        unsafe {
            libc::syscall(libc::SYS_futex, word.as_ptr(), libc::FUTEX_WAKE | libc::FUTEX_PRIVATE_FLAG, 1)
        };
    }

    pub fn pin(core: usize) {
        cores(|set| {
            // SAFETY: the number is that of a core, or it is left out.
            unsafe { libc::CPU_SET(core, set) }
        });
    }

    pub fn unpin() {
        cores(|set| {
            (0..64).for_each(|core| {
                // SAFETY: as above.
                unsafe { libc::CPU_SET(core, set) }
            });
        });
    }

    fn cores(choose: impl FnOnce(&mut libc::cpu_set_t)) {
        // SAFETY: a set of zeros is an empty one, and it lives during the call.
        unsafe {
            let mut set: libc::cpu_set_t = std::mem::zeroed();
            choose(&mut set);
            libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set);
        }
    }
}

fn main() {
    // Under `cargo test` benches are only built and started.
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let long = std::env::args().any(|argument| argument == "--long");
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
    if wanted("stages") {
        stages(0, 1_000_000);
        stages(1, if long { 1_000_000 } else { 100_000 });
    }
    if wanted("thousand") {
        thousand(Duration::from_secs(if long { 60 } else { 10 }));
    }
    if wanted("notify") {
        notify(3000);
    }
    if wanted("timeouts") {
        timeouts();
    }
    if wanted("faults") {
        faults(if long { 10_100 } else { 1010 });
    }
}
