//! Each fault that a module can commit, in a process of its own: other modules are not affected, and its actuator is safe.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use slate_runtime::configuration::{Configuration, Options as Reading};
use slate_runtime::{Agent, Control, End, Options};

use crate::Test;
use crate::common::hanging;
use crate::modules::{fault, plugins};

pub const TESTS: [Test; 11] = [
    ("a segmentation fault ends one process", || ends("segfault", "segmentation fault")),
    ("an abort ends one process", || ends("abort", "abort")),
    ("a stack overflow ends one process", || ends("stack overflow", "ended by signal")),
    ("an exit ends one process", || ends("exit", "ended with exit code 0")),
    ("an endless loop is ended", || ends("endless loop", "did not return within 1s")),
    ("a lack of memory ends one process", || ends("out of memory", "ended by signal")),
    ("a panic ends one process", || ends("panic", "panicked")),
    ("a fault while it waits is noticed too", killed_while_it_waits),
    ("a fault while it is set up is an error of loading", fault_at_the_beginning),
    ("an agent that ends waits for no step of a process", ends_beside_a_hang),
    ("time to live holds for a module in its own process", time_to_live_holds_for_module_in_its_own_process),
];

fn time_to_live_holds_for_module_in_its_own_process() {
    hanging::read_by_a_module("isolated = true", "a module in a process of its own");
}

fn ends_beside_a_hang() {
    let text = text("endless loop", 20, "").replace("loop.hang = \"1s\"", "loop.hang = \"60s\"");
    let mut agent = agent(&text);
    // The villain hangs from its twentieth step on.
    let samples = watch(&mut agent, |sample| sample.number == 100);
    let last = samples.last().unwrap();
    assert!(last.number == 100 && last.now > last.committed + 500_000_000, "it hangs: {last:?}");
    let took = last.at.elapsed();
    assert!(took < Duration::from_secs(5), "the end took {took:?}");
}

const TIME_TO_LIVE: u64 = 60_000_000;

pub fn agent(text: &str) -> Agent {
    let configuration = Configuration::from_text("test.toml", text, &Reading::default()).unwrap();
    let options = Options { armed: true, ..Options::default() };
    Agent::load(&configuration, &plugins(), options).unwrap_or_else(|error| panic!("{error}"))
}

pub fn text(fault_name: &str, at: u64, more: &str) -> String {
    format!(
        r#"
loop.period = "10ms"
loop.hang = "1s"
[modules.villain]
isolated = true
isolation.memory = "100MB"
params = {{ fault = {}, at = {at} }}
{more}
[modules.pulse]
[modules.driver]
[links]
"villain/input" = "pulse/beat"
"driver/input" = "pulse/beat"
[actuators.wheel]
command = "villain/wheel"
time_to_live = "60ms"
[actuators.other]
command = "driver/wheel"
"#,
        fault(fault_name)
    )
}

/// What was to be seen at the end of a cycle.
#[derive(Debug)]
pub struct Sample {
    pub at: Instant,
    /// The agent's time.
    pub now: u64,
    pub number: u64,
    pub beats: f64,
    pub condition: String,
    /// Since when, of the agent's time.
    pub since: u64,
    /// When the villain committed a tick last.
    pub committed: u64,
    pub command: f64,
    pub other: f64,
    pub gate: String,
    pub process: u64,
    pub last_end: String,
}

/// Runs until `done`, or for 20 s, and returns what was seen.
pub fn watch(agent: &mut Agent, mut done: impl FnMut(&Sample) -> bool + Send + 'static) -> Vec<Sample> {
    let samples = Arc::new(Mutex::new(Vec::new()));
    let taken = Arc::clone(&samples);
    let start = Instant::now();
    let end = agent.run(Box::new(move |cycle| {
        let read = |path: &str| cycle.board.read(path).unwrap();
        let number = |path: &str| read(path).and_then(|(value, _)| value.as_f64()).unwrap_or(0.0);
        let word = |path: &str| {
            read(path).map(|(value, _)| value.as_str().unwrap_or_default().to_owned()).unwrap_or_default()
        };
        let sample = Sample {
            at: Instant::now(),
            now: cycle.now,
            number: cycle.number,
            beats: number("pulse/beat/value"),
            condition: word("villain/state/condition"),
            since: read("villain/state").map_or(0, |(_, stamp)| stamp.time),
            committed: read("villain/number").map_or(0, |(_, stamp)| stamp.time),
            command: number("wheel/command/value"),
            other: number("other/command/value"),
            gate: word("wheel/gate/mode"),
            process: number("villain/process/id") as u64,
            last_end: word("villain/process/last_end"),
        };
        let over = done(&sample) || start.elapsed() > Duration::from_secs(20);
        taken.lock().unwrap().push(sample);
        if over { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    std::mem::take(&mut *samples.lock().unwrap())
}

fn ends(fault_name: &str, said: &str) {
    let mut agent = agent(&text(fault_name, 20, ""));
    let mut first = 0;
    let mut fell = false;
    let samples = watch(&mut agent, move |sample| {
        if first == 0 {
            first = sample.process;
        }
        fell |= sample.condition == "FAILED";
        fell && sample.condition == "WORKING" && sample.process != first
    });
    // Every other module was there in every cycle, and no cycle waited for a process.
    let last = samples.last().unwrap();
    assert_eq!(last.beats, last.number as f64, "a module of the loop ticks once in each cycle");
    for pair in samples.windows(2) {
        assert_eq!(pair[1].number, pair[0].number + 1);
        let gap = pair[1].at - pair[0].at;
        // Far below what is waited for a module that does not return, and what a busy machine may take.
        assert!(gap < Duration::from_millis(500), "a cycle took {gap:?}");
        assert!(pair[1].other > pair[0].other, "the other actuator follows its commander");
    }
    // Its actuator followed it, and was safe as soon as its time to live was over.
    assert!(samples.iter().any(|sample| sample.command == 1.0), "{samples:#?}");
    let stale = |sample: &&Sample| sample.command != 0.0 && sample.now > sample.committed + TIME_TO_LIVE;
    assert!(samples.iter().find(stale).is_none());
    // It was seen, said, and started anew, disarmed.
    let fell = samples.iter().position(|sample| sample.condition == "FAILED").expect("it was seen");
    for sample in &samples[fell..] {
        assert_eq!(sample.command, 0.0, "{sample:?}");
        assert_eq!(sample.gate, "DISARMED", "{sample:?}");
    }
    assert!(last.last_end.contains(said), "{}", last.last_end);
    assert_eq!(last.condition, "WORKING", "it starts anew");
    assert_ne!(last.process, samples[0].process);
    let away = Duration::from_nanos(last.since - samples[fell].since);
    assert!(away >= Duration::from_millis(100), "after a while: {away:?}");
    // And drives again once armed.
    assert!(agent.arm());
    let samples = watch(&mut agent, |sample| sample.command == 1.0);
    assert_eq!(samples.last().unwrap().command, 1.0);
}

fn killed_while_it_waits() {
    // It has nothing to do for an hour.
    let mut agent = agent(&text("", 0, "every = \"1h\"").replace("\"1h\"", "\"60min\""));
    let mut killed = 0;
    let samples = watch(&mut agent, move |sample| {
        if killed == 0 && sample.number > 5 {
            killed = sample.process;
            let id = rustix::process::Pid::from_raw(killed as i32).unwrap();
            rustix::process::kill_process(id, rustix::process::Signal::KILL).unwrap();
        }
        killed != 0 && sample.process != killed && sample.process != 0
    });
    let last = samples.last().unwrap();
    assert!(last.last_end.contains("signal 9"), "{}", last.last_end);
    assert_eq!(last.gate, "DISARMED");
}

fn fault_at_the_beginning() {
    let text = r#"
[modules.crasher]
isolated = true
"#;
    let configuration = Configuration::from_text("test.toml", text, &Reading::default()).unwrap();
    let error = Agent::load(&configuration, &plugins(), Options::default()).unwrap_err().to_string();
    assert!(error.contains("its process ended by signal 6 (abort) while it was set up"), "{error}");
}
