//! Benchmarks of the cost of recording.
//! All of them: `cargo bench -p slate-record`; one of them by its name: `cargo bench -p slate-record -- images`. With
//! `--long` the runs are as long as the promises that they check.
#![allow(missing_docs, clippy::unwrap_used, clippy::disallowed_methods, reason = "a benchmark")]

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use slate_interfaces::Image;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_record::Recorder;
use slate_runtime::configuration::{Database, Options as Layers, Record};
use slate_runtime::recording::{Recording, RecordingControl};
use slate_runtime::{Agent, Control, Cycle, Options, Rate, RecordedTimes};

/// A number.
#[interface]
pub struct Number {
    /// The number.
    pub value: f64,
}

#[ports]
pub struct SegmentIo {
    input: Input<Number>,
    output: Output<Number>,
}

/// Passes a number on, plus one.
pub struct Segment;

#[module(stage = Think)]
impl Module for Segment {
    type Io = SegmentIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SegmentIo, _: &(), _: &Tick) -> Outcome {
        io.output.set(Number { value: io.input.get().map_or(0.0, |input| input.value) + 1.0 });
        Outcome::Ok
    }
}

/// Bytes of an image: 640 by 480 pixels of three.
const IMAGE: usize = 640 * 480 * 3;

#[ports]
pub struct CameraIo {
    #[capacity(921600)]
    image: Output<Image>,
}

/// Takes pictures.
pub struct Camera;

#[module(stage = SensorAcquire)]
impl Module for Camera {
    type Io = CameraIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &CameraIo, _: &(), now: &Tick) -> Outcome {
        io.image.write(IMAGE, |image| image.data[now.number() as usize % IMAGE] = 1);
        Outcome::Ok
    }
}

const MODULES: usize = 17;

/// Modules in a row, each reading the one before.
fn caterpillar() -> String {
    let mut text = String::from("[log.targets]\nconsole = false\n");
    for module in 0..MODULES {
        write!(text, "[modules.m{module:02}]\nkind = \"segment\"\n").unwrap();
    }
    text.push_str("[links]\n");
    for module in 1..MODULES {
        writeln!(text, "\"m{module:02}/input\" = \"m{:02}/output\"", module - 1).unwrap();
    }
    text
}

fn agent(text: &str, lockstep: bool, recorder: Option<&Recorder>) -> Agent {
    let database = Database::from_text("bench.toml", text, Layers::default()).unwrap();
    let options = Options {
        rate: if lockstep { Rate::Max } else { Rate::REALTIME },
        time_source: lockstep.then(|| Box::new(RecordedTimes::new(Vec::new())) as _),
        recording: recorder.map(|recorder| Arc::new(recorder.clone()) as Arc<dyn Recording>),
        log: recorder.iter().map(|recorder| recorder.log_target()).collect(),
        ..Options::default()
    };
    Agent::load_with(&database, &[Plugin::linked::<Segment>(), Plugin::linked::<Camera>()], options).unwrap()
}

/// Cycles above this were interrupted: none takes so long by itself.
const INTERRUPTED: u64 = 20_000;

fn report(name: &str, mut times: Vec<u64>) {
    times.sort_unstable();
    let at = |part: f64| times[((times.len() - 1) as f64 * part) as usize] as f64 * 1e-3;
    let interrupted = times.iter().rev().take_while(|time| **time > INTERRUPTED).count();
    // The machine interrupts a longer cycle more often; own interruptions increase the rate.
    let within: u64 = times[..times.len() - interrupted].iter().sum();
    println!(
        "{name:<44} p50 {:7.2} us  p99 {:7.2} us  p99.9 {:7.2} us  max {:8.1} us  ({} samples, {} interrupted in a second of cycles)",
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0),
        times.len(),
        (interrupted as f64 / (within as f64 * 1e-9)).round(),
    );
}

/// Directory of the recorded files, in memory if there is such a file system.
fn folder() -> PathBuf {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
    folder.join(format!("slate-bench-{}", std::process::id()))
}

/// Cycle time of the caterpillar, alternately with and without a recording.
/// Without pauses between the cycles the figure is that of the recorder, because lockstep waits for it.
fn ticks(long: bool) {
    let rounds = if long { 100 } else { 10 };
    cycles("ten thousand a second, the processor never asleep", rounds, 2000, |start| {
        while start.elapsed() < Duration::from_micros(100) {
            std::hint::spin_loop();
        }
    });
    // As on a robot: what it needs comes from memory that others have used meanwhile.
    cycles("a thousand a second, asleep in between", rounds, 200, |start| {
        std::thread::sleep(Duration::from_millis(1).saturating_sub(start.elapsed()));
    });
}

fn cycles(pace: &str, rounds: usize, steps: usize, wait: impl Fn(Instant)) {
    let settings = Record::default();
    let with = |flight: bool, enabled: bool| {
        let mut settings = settings.clone();
        (settings.flight.enabled, settings.enabled) = (flight, enabled);
        Recorder::on_demand(&settings)
    };
    let folder = folder();
    let kinds = [
        ("without a recorder", None),
        ("with one that records nothing", Some(with(false, false))),
        ("with the last seconds in memory", Some(with(true, false))),
        ("with everything recorded", Some(with(false, true))),
        ("with both", Some(with(true, true))),
    ];
    let mut agents: Vec<_> = kinds
        .into_iter()
        .enumerate()
        .map(|(place, (name, recorder))| {
            let agent = agent(&caterpillar(), true, recorder.as_ref());
            if let Some(recorder) = &recorder {
                recorder.attach(&agent, &folder.join(place.to_string()));
            }
            (name, recorder, agent, Vec::with_capacity(rounds * steps))
        })
        .collect();
    for round in 0..=rounds {
        for (_, _, agent, times) in &mut agents {
            for _ in 0..steps {
                let start = Instant::now();
                assert!(agent.step());
                let end = start.elapsed();
                // The first round warms up.
                if round > 0 {
                    times.push(end.as_nanos() as u64);
                }
                wait(start);
            }
        }
    }
    println!("one cycle of {MODULES} modules in a row, {pace}:");
    for (name, recorder, mut agent, times) in agents {
        report(name, times);
        if let Some(Some(recorded)) = recorder.map(|recorder| recorder.finish(&mut agent)) {
            assert_eq!(recorded.unwrap().dropped, 0);
        }
    }
    let _ = std::fs::remove_dir_all(folder);
}

/// Images on the wall clock, more than 200 MB/s.
fn images(long: bool) {
    let cycles = if long { 10_000 } else { 1250 };
    let text =
        "loop.period = \"4ms\"\n[log.targets]\nconsole = false\n[modules.camera]\n[record]\nenabled = true\n";
    let folder = folder();
    let database = Database::from_text("bench.toml", text, Layers::default()).unwrap();
    let recorder = Recorder::new(database.current().record());
    let mut agent = agent(text, false, Some(&recorder));
    recorder.attach(&agent, &folder);
    let start = Instant::now();
    let stop = move |cycle: &Cycle<'_>| {
        if cycle.number < cycles { Control::Continue } else { Control::Stop }
    };
    agent.run(Box::new(stop)).unwrap();
    let took = start.elapsed().as_secs_f64();
    let recorded = recorder.end(&mut agent).unwrap();
    println!(
        "images of {:.2} MB, one in 4 ms: {:.0} MB/s for {took:.0} s, {} of {} values dropped",
        IMAGE as f64 * 1e-6,
        recorded.bytes as f64 * 1e-6 / took,
        recorded.dropped,
        recorded.values + recorded.dropped
    );
    let _ = std::fs::remove_dir_all(folder);
}

/// Maximum throughput of the recorder in lockstep, where the loop waits for it.
fn fastest() {
    let text = "[log.targets]\nconsole = false\n[modules.camera]\n[record]\nenabled = true\n";
    let folder = folder();
    let database = Database::from_text("bench.toml", text, Layers::default()).unwrap();
    let recorder = Recorder::new(database.current().record());
    let mut agent = agent(text, true, Some(&recorder));
    recorder.attach(&agent, &folder);
    let start = Instant::now();
    (0..2000).for_each(|_| assert!(agent.step()));
    let recorded = recorder.end(&mut agent).unwrap();
    let took = start.elapsed().as_secs_f64();
    println!("as fast as they are taken: {:.0} MB/s", recorded.bytes as f64 * 1e-6 / took);
    let _ = std::fs::remove_dir_all(folder);
}

/// Time to begin and to end a recording, and the cycle time meanwhile.
fn beginnings() {
    let recorder = Recorder::on_demand(&Record::default());
    let folder = folder();
    std::fs::create_dir_all(&folder).unwrap();
    let mut agent = agent(&caterpillar(), true, Some(&recorder));
    recorder.attach(&agent, &folder);
    let (composer, own) = (agent.composer(), recorder.clone());
    let tool = std::thread::spawn({
        let folder = folder.clone();
        move || {
            for number in 0..20 {
                std::thread::sleep(Duration::from_millis(20));
                let file = folder.join(format!("{number}.mcap"));
                own.start(&composer, &file, &slate_runtime::configuration::RecordSelection::default())
                    .unwrap();
                std::thread::sleep(Duration::from_millis(20));
                own.stop(&composer, None).unwrap();
            }
        }
    });
    let mut times = Vec::new();
    while !tool.is_finished() {
        let start = Instant::now();
        assert!(agent.step());
        times.push(start.elapsed().as_nanos() as u64);
        while start.elapsed() < Duration::from_micros(100) {
            std::hint::spin_loop();
        }
    }
    tool.join().unwrap();
    report("while recordings begin and end", times);
    let _ = std::fs::remove_dir_all(folder);
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|own| own != "--bench").collect();
    let long = arguments.iter().any(|own| own == "--long");
    let names: Vec<_> = arguments.iter().filter(|own| !own.starts_with("--")).collect();
    let wanted = |name: &str| names.is_empty() || names.iter().any(|own| *own == name);
    if wanted("ticks") {
        ticks(long);
    }
    if wanted("beginnings") {
        beginnings();
    }
    if wanted("images") {
        images(long);
        fastest();
    }
}
