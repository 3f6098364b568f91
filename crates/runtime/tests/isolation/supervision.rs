//! Processes start anew after a while, not for ever, and leave nothing behind.

use std::time::{Duration, Instant};

use slate_runtime::{Agent, Control, End, Options, Rate};

use crate::Test;
use crate::common::{configuration, number};
use crate::faults::{self, watch};
use crate::modules::{fault, plugins};

pub const TESTS: [Test; 6] = [
    ("restarts wait longer and longer and come to an end", back_off_and_limit),
    ("an endless loop in lockstep is ended and the run goes on", endless_loop_in_lockstep),
    ("a late module misses turns and holds nobody up", late_module),
    ("actuators stay armed where the configuration says so", stay_armed),
    ("a process outlives the threads that it was made in", outlives_threads),
    ("30 crashes leave nothing behind", || leaves_nothing(30)),
];

pub const LONG_TESTS: [Test; 1] = [("1000 crashes leave nothing behind", || leaves_nothing(1000))];

fn lockstep(fault_name: &str, at: u64, period: &str) -> Agent {
    let text = format!(
        r#"
time.source = "pulse"
loop.period = "{period}"
loop.hang = "1s"
[modules.pulse]
[modules.villain]
isolated = true
params = {{ fault = {}, at = {at} }}
[actuators.wheel]
command = "villain/wheel"
"#,
        fault(fault_name)
    );
    let options = Options { rate: Rate::Max, armed: true, ..Options::default() };
    Agent::load(&configuration(&text), &plugins(), options).unwrap_or_else(|error| panic!("{error}"))
}

fn condition(agent: &Agent) -> String {
    let (value, _) = agent.board().read("villain/state/condition").unwrap().unwrap();
    value.as_str().unwrap().to_owned()
}

fn back_off_and_limit() {
    let run = || {
        let mut agent = lockstep("abort", 3, "10ms");
        let mut changes = Vec::new();
        for cycle in 0..500_u64 {
            agent.step();
            let now = condition(&agent);
            if changes.last().is_none_or(|(_, before)| *before != now) {
                changes.push((cycle * 10, now));
            }
        }
        assert_eq!(number(&agent, "villain/process/restarts"), 5.0);
        assert_eq!(number(&agent, "villain/process/id"), 0.0);
        assert_eq!(number(&agent, "wheel/command/value"), 0.0);
        assert_eq!(number(&agent, "pulse/beat/value"), 500.0);
        (changes, agent.digest())
    };
    let (changes, digest) = run();
    let away: Vec<u64> = changes
        .windows(2)
        .filter(|pair| pair[0].1 == "FAILED" && pair[1].1 == "WORKING")
        .map(|pair| pair[1].0 - pair[0].0)
        .collect();
    assert_eq!(away, [100, 200, 400, 800, 1600], "{changes:?}");
    assert_eq!(changes.last().unwrap().1, "FAULTED");
    assert_eq!(run(), (changes, digest), "crashes in lockstep are repeatable");
}

fn endless_loop_in_lockstep() {
    let mut agent = lockstep("endless loop", 3, "10ms");
    let mut cycles = 0;
    let end = agent.run(Box::new(move |_| {
        cycles += 1;
        if cycles == 14 { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    assert_eq!(number(&agent, "pulse/beat/value"), 14.0);
    assert_eq!(number(&agent, "villain/process/restarts"), 1.0);
    assert_eq!(condition(&agent), "WORKING");
}

fn late_module() {
    let text = r#"
loop.period = "10ms"
[modules.pulse]
[modules.counter]
isolated = true
params = { hang_at = 5, hang_ms = 1000 }
"#;
    let mut agent = Agent::load(&configuration(text), &plugins(), Options::default()).unwrap();
    let mut last = None::<Instant>;
    let mut longest = Duration::ZERO;
    let end = agent.run(Box::new(move |cycle| {
        let now = Instant::now();
        longest = longest.max(last.replace(now).map_or(Duration::ZERO, |last| now - last));
        assert!(longest < Duration::from_millis(500), "the loop waited for {longest:?}");
        let (value, _) = cycle.board.read("pulse/beat/value").unwrap().unwrap();
        assert_eq!(value.as_f64(), Some(cycle.number as f64));
        if cycle.number == 150 { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    let (ticks, misses, panics) = agent.counts("counter").unwrap();
    assert_eq!(panics, 0);
    assert!(misses >= 30, "{misses}");
    assert!(ticks + misses <= 150 && ticks > 5, "{ticks} and {misses}");
}

fn stay_armed() {
    let text =
        faults::text("abort", 10, "").replace("isolation.memory", "isolation.rearm = true\nisolation.memory");
    let mut agent = faults::agent(&text);
    let mut fell = false;
    let samples = watch(&mut agent, move |sample| {
        fell |= sample.condition == "FAILED";
        fell && sample.condition == "WORKING" && sample.command == 1.0
    });
    assert!(samples.iter().any(|sample| sample.condition == "FAILED"));
    assert_eq!(samples.last().unwrap().command, 1.0);
}

fn outlives_threads() {
    let mut agent = std::thread::spawn(|| faults::agent(&faults::text("", 0, ""))).join().unwrap();
    let first = watch(&mut agent, |sample| sample.committed > 0 && sample.number > 10);
    let again = watch(&mut agent, |sample| sample.number > 30);
    assert!(first[0].process > 0);
    for sample in first.iter().chain(&again) {
        assert_eq!(sample.process, first[0].process, "{}", sample.last_end);
    }
    assert!(agent.counts("villain").unwrap().0 > 10);
}

/// What a process has of the system's.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Possessions {
    descriptors: usize,
    threads: usize,
    children: usize,
    mappings: usize,
}

fn possessions() -> Possessions {
    let count = |path: &str| std::fs::read_dir(path).unwrap().count();
    let tasks = std::fs::read_dir("/proc/self/task").unwrap().flatten();
    let children = tasks.map(|task| {
        let text = std::fs::read_to_string(task.path().join("children")).unwrap_or_default();
        text.split_whitespace().count()
    });
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    Possessions {
        descriptors: count("/proc/self/fd"),
        threads: count("/proc/self/task"),
        children: children.sum(),
        mappings: maps.lines().filter(|line| line.contains("memfd:slate")).count(),
    }
}

/// Memory in use, bytes.
fn memory() -> usize {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    text.split(' ').nth(1).unwrap().parse::<usize>().unwrap() * 4096
}

fn leaves_nothing(crashes: u64) {
    let before = possessions();
    // One crash in 15 s of the agent's time, which the supervisor allows for ever.
    let mut agent = lockstep("abort", 15, "1s");
    while number_of_crashes(&agent) < 5 {
        agent.step();
    }
    let (early, memory_early) = (possessions(), memory());
    while number_of_crashes(&agent) < crashes {
        assert_ne!(condition(&agent), "FAULTED");
        agent.step();
    }
    assert_eq!(possessions(), early);
    let grown = memory().saturating_sub(memory_early);
    assert!(grown < 2 << 20, "{crashes} crashes cost {grown} bytes");
    drop(agent);
    let after = possessions();
    // The thread that starts processes stays.
    assert!(after.threads <= before.threads + 1, "{before:?}, {after:?}");
    assert_eq!(Possessions { threads: 0, ..after }, Possessions { threads: 0, ..before });
}

fn number_of_crashes(agent: &Agent) -> u64 {
    agent.counts("villain").unwrap().2
}
