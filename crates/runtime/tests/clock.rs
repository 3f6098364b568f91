//! Where the agent's time comes from, and what it does not depend on.
#![cfg(not(feature = "shuttle"))]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use crate::common;

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant, SystemTime};

use common::{load, number};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{
    Agent, Calendar, Control, End, Mode, Observer, Options, Rate, RecordedTimes, SystemClock, TimeSource,
};

const MS: u64 = 1_000_000;

/// A machine whose date is set by the hour, and how often it was read.
#[derive(Clone, Default)]
struct Machine {
    /// Seconds.
    offset: Arc<AtomicI64>,
    asked: Arc<AtomicU64>,
}

impl Machine {
    fn calendar(&self) -> Calendar {
        let machine = self.clone();
        Arc::new(move || {
            machine.asked.fetch_add(1, Ordering::Relaxed);
            let offset = machine.offset.load(Ordering::Relaxed);
            let date = SystemTime::now();
            let seconds = Duration::from_secs(offset.unsigned_abs());
            if offset < 0 { date - seconds } else { date + seconds }
        })
    }
}

/// What depends on time: periods, timeouts, deadlines, ages of values and of commands. The limits are shorter than an hour, and longer
/// than any pause of a busy machine.
const ROBOT: &str = r#"
[loop]
period = "2ms"
hang = "120s"
timeouts.Act = "60s"
[modules.counter]
deadline = "60s"
[modules.periodic]
kind = "counter"
every = "4ms"
[modules.relay]
[modules.driver]
[links]
"relay/input" = { from = "counter/number", stale = "60s" }
"driver/input" = "relay/output"
[actuators.wheel]
command = "driver/wheel"
time_to_live = "60s"
limits = { value = [-1000.0, 1000.0] }
"#;

#[test]
fn jumps_of_the_date_by_an_hour_make_nothing_late_or_early() {
    for mode in [Mode::Staged, Mode::Threaded] {
        let machine = Machine::default();
        let log = MemoryTarget::default();
        let options = Options {
            mode,
            armed: true,
            log: vec![Box::new(log.clone())],
            calendar: Some(machine.calendar()),
            ..Options::default()
        };
        let mut agent = load(ROBOT, &[], options).unwrap();
        let jumps = machine.clone();
        let times = Arc::new(Mutex::new(Vec::new()));
        let taken = Arc::clone(&times);
        let composer = agent.composer();
        let start = Instant::now();
        let end = agent.run(Box::new(move |cycle| {
            taken.lock().unwrap().push(cycle.now);
            // Forward, and back beyond where it was.
            jumps.offset.store([0, 3600, -3600][(cycle.number / 20 % 3) as usize], Ordering::Relaxed);
            let modules = composer.modules();
            assert!(modules.iter().all(|module| module.condition == "WORKING"), "{modules:?}");
            if cycle.number == 200 { Control::Stop } else { Control::Continue }
        }));
        assert_eq!(end.unwrap(), End::Stopped);
        let took = start.elapsed().as_nanos() as u64;
        let times = times.lock().unwrap();
        assert!(times.is_sorted(), "the agent's time does not go back");
        let passed = times[199] - times[0];
        assert!(passed >= 390 * MS && passed <= took, "nor does it jump: {passed} of {took} ns");
        let (ticks, misses, _) = agent.counts("counter").unwrap();
        assert_eq!((ticks, misses), (200, 0));
        // A busy machine may let it miss some of its turns, and those are counted.
        let (ticks, misses, _) = agent.counts("periodic").unwrap();
        assert!(
            ticks + misses >= 90 && ticks <= took / (4 * MS) + 2,
            "{ticks} ticks and {misses} missed in {took} ns"
        );
        // On threads of their own the last ones may be on their way.
        let command = number(&agent, "wheel/command/value");
        assert!(
            command > 100.0 && (command == 201.0 || mode == Mode::Threaded),
            "no command has expired: {command}"
        );
        let troubles: Vec<_> =
            log.lines().into_iter().filter(|line| !line.text.contains("longer than its period")).collect();
        assert_eq!(troubles, [], "nothing to say");
    }
}

#[test]
fn the_date_is_for_people_and_follows_the_machines() {
    let machine = Machine::default();
    let options = Options { calendar: Some(machine.calendar()), ..Options::default() };
    let mut agent = load(ROBOT, &[], options).unwrap();
    let before = machine.asked.load(Ordering::Relaxed);
    agent.run(after(20)).unwrap();
    assert_eq!(machine.asked.load(Ordering::Relaxed), before, "a run does not ask for it");
    let now = agent.now();
    let close = |a: SystemTime, b: SystemTime| {
        a.duration_since(b).unwrap_or_else(|error| error.duration()) < Duration::from_secs(30)
    };
    assert!(close(agent.date_of(now), SystemTime::now()));
    let second = agent.date_of(now).duration_since(agent.date_of(now.saturating_sub(20 * MS))).unwrap();
    assert!(second >= Duration::from_millis(10));
    machine.offset.store(3600, Ordering::Relaxed);
    assert!(close(agent.date_of(now), SystemTime::now() + Duration::from_secs(3600)));
}

fn after(cycles: u64) -> Observer {
    let mut left = cycles;
    Box::new(move |_| {
        left -= 1;
        if left == 0 { Control::Stop } else { Control::Continue }
    })
}

/// An agent whose time comes from there.
fn driven(text: &str, source: impl TimeSource + 'static, rate: Rate) -> Agent {
    let options = Options { rate, time_source: Some(Box::new(source)), ..Options::default() };
    load(text, &[], options).unwrap()
}

/// The times of so many cycles.
fn times(agent: &mut Agent, cycles: u64) -> Vec<u64> {
    let taken = Arc::new(Mutex::new(Vec::new()));
    let times = Arc::clone(&taken);
    let mut left = cycles;
    agent
        .run(Box::new(move |cycle| {
            times.lock().unwrap().push(cycle.now);
            left -= 1;
            if left == 0 { Control::Stop } else { Control::Continue }
        }))
        .unwrap();
    let taken = taken.lock().unwrap();
    taken.clone()
}

#[test]
fn a_recorded_run_repeats_its_times_and_then_uses_the_period() {
    let recorded = vec![3 * MS, 5 * MS, 5 * MS, 1000 * MS];
    let text = "loop.period = \"10ms\"\n[modules.counter]\n";
    let mut agent = driven(text, RecordedTimes::new(recorded), Rate::Max);
    assert_eq!(times(&mut agent, 6), [3, 5, 5, 1000, 1010, 1020].map(|ms| ms * MS));
    assert_eq!(agent.counts("counter").unwrap().0, 6);
    assert!(agent.digest().is_some(), "it is in lockstep");
}

#[test]
fn a_time_that_goes_back_is_refused_and_counted() {
    let recorded = vec![10 * MS, 20 * MS, 15 * MS, 19 * MS, 30 * MS, 0];
    let text = "loop.period = \"10ms\"\n[modules.counter]\n";
    let mut agent = driven(text, RecordedTimes::new(recorded), Rate::Max);
    assert_eq!(times(&mut agent, 7), [10, 20, 20, 20, 30, 30, 40].map(|ms| ms * MS));
    assert_eq!(number(&agent, "loop/state/refused_times"), 3.0);
}

#[test]
fn periods_and_ages_count_in_the_time_of_the_source() {
    let text = r#"
loop.period = "10ms"
[modules.counter]
every = "100ms"
[modules.relay]
[links]
"relay/input" = { from = "counter/number", stale = "150ms" }
"#;
    // The counter is due at 0, 100, 200 and so on.
    let recorded = vec![0, 99 * MS, 100 * MS, 101 * MS, 250 * MS, 299 * MS, 300 * MS];
    let mut agent = driven(text, RecordedTimes::new(recorded), Rate::Max);
    let ticks = (0..7).map(|_| {
        assert!(agent.step());
        agent.counts("counter").unwrap().0
    });
    assert_eq!(ticks.collect::<Vec<_>>(), [1, 1, 2, 2, 3, 3, 4]);
}

#[test]
fn the_rate_paces_the_times_of_the_source() {
    let recorded = vec![100 * MS, 110 * MS, 180 * MS];
    let mut agent =
        driven("loop.period = \"10ms\"\n[modules.counter]\n", RecordedTimes::new(recorded), Rate::Times(2.0));
    let start = Instant::now();
    assert_eq!(times(&mut agent, 3), [100, 110, 180].map(|ms| ms * MS));
    assert!(start.elapsed() >= Duration::from_millis(40), "80 ms at twice the pace: {:?}", start.elapsed());
}

/// Steps of its own.
struct Steps(u64);

impl TimeSource for Steps {
    fn next(&mut self, last: Option<u64>, planned: u64) -> u64 {
        assert!(last.is_none_or(|last| planned == last + 10 * MS), "a period after the last");
        last.unwrap_or(0) + self.0
    }
}

#[test]
fn the_source_is_exchanged_while_the_agent_runs() {
    let text = "time.source = \"counter\"\nloop.period = \"10ms\"\n[modules.counter]\n";
    let mut agent = load(text, &[], Options { rate: Rate::Max, ..Options::default() }).unwrap();
    assert_eq!(times(&mut agent, 2), [0, 10 * MS]);
    agent.composer().set_time_source(Some(Box::new(Steps(7 * MS)))).unwrap();
    assert_eq!(times(&mut agent, 2), [17 * MS, 24 * MS]);
    agent.composer().set_time_source(None).unwrap();
    assert_eq!(times(&mut agent, 2), [34 * MS, 44 * MS]);
}

#[test]
fn the_systems_clock_takes_no_time_source() {
    let agent = load("[modules.counter]\n", &[], Options::default()).unwrap();
    let refused = agent.composer().set_time_source(Some(Box::new(Steps(1))));
    assert_eq!(refused, Err(SystemClock));
    assert!(SystemClock.to_string().contains("start it with a time source"));
}
