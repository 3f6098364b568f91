//! Late steps: other modules continue, and the late one is reported and recovers.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use slate_runtime::{Control, End, Mode, Options};

use crate::faults::common::{number, try_lockstep};
use crate::faults::{after, agent, count, value};

/// What was to be seen at the end of a cycle.
#[derive(Clone, Copy, Debug)]
struct Sample {
    /// What the module wrote that hangs once, in its tenth tick.
    number: f64,
    /// What another module wrote, which counts its ticks.
    other: f64,
    /// What a reader of the first one saw, and whether it was stale.
    seen: f64,
    stale: bool,
}

fn samples_of_a_hang(trigger: &str, options: Options) -> Vec<Sample> {
    let text = format!(
        r#"
loop.period = "5ms"
loop.hang = "50ms"
[modules.counter]
params = {{ hang_at = 10, hang_ms = 400 }}
{trigger}
[modules.other]
kind = "counter"
[modules.watcher]
[links]
"watcher/input" = "counter/number"
"#
    );
    let mut agent = agent(&text, options);
    let samples = Arc::new(Mutex::new(Vec::new()));
    let taken = Arc::clone(&samples);
    let start = Instant::now();
    let end = agent.run(Box::new(move |cycle| {
        let read = |path| value(cycle, path).unwrap_or(0.0);
        let sample = Sample {
            number: read("counter/number/value"),
            other: read("other/number/value"),
            seen: read("watcher/seen/first"),
            stale: read("watcher/seen/second") == 1.0,
        };
        taken.lock().unwrap().push(sample);
        let done = sample.seen >= 15.0 || start.elapsed() > Duration::from_secs(20);
        if done { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    let samples = samples.lock().unwrap();
    samples.clone()
}

fn check_hang(samples: &[Sample], threaded: bool) {
    let first = samples.iter().position(|sample| sample.number == -1.0).expect("the outputs become safe");
    let last = samples.iter().rposition(|sample| sample.number == -1.0).unwrap();
    assert_eq!(samples[first - 1].number, 9.0, "the tenth tick hangs");
    let ticks = samples[last].other - samples[first].other;
    assert!(ticks >= 15.0, "in 350 ms at 5 ms the others made {ticks} ticks");
    let late = &samples[first + 1..=last];
    assert!(late.iter().all(|sample| sample.stale && sample.seen == -1.0), "readers see stale safe values");
    assert!(samples.iter().all(|sample| sample.number != 10.0), "what it wrote late is dropped");
    // A fresh state would begin at 1. The loop that looks may miss values of a thread of its own.
    let back = samples[last + 1].number;
    assert!(back == 11.0 || threaded && back > 11.0, "it comes back with its state: {back}");
    let end = samples.last().unwrap();
    assert!(end.number >= 15.0 && !end.stale, "it works again: {end:?}");
}

#[test]
fn hanging_module_on_loop_blocks_no_other() {
    check_hang(&samples_of_a_hang("", Options::default()), false);
}

#[test]
fn hanging_module_on_own_thread_blocks_no_other() {
    let options = Options { mode: Mode::Threaded, ..Options::default() };
    check_hang(&samples_of_a_hang("every = \"5ms\"", options), true);
}

#[test]
fn hanging_module_on_worker_blocks_no_other() {
    for workers in [1, 2] {
        let options = Options { workers, always_help: true, ..Options::default() };
        check_hang(&samples_of_a_hang("", options), false);
    }
}

#[test]
fn a_late_step_keeps_its_inputs_while_their_writer_goes_on() {
    for (workers, always_help) in [(0, false), (1, true)] {
        let text = r#"
loop.period = "5ms"
loop.hang = "50ms"
[modules.counter]
[modules.sleeper]
[links]
"sleeper/input" = "counter/number"
"#;
        let mut agent = agent(text, Options { workers, always_help, ..Options::default() });
        let start = Instant::now();
        let end = agent.run(Box::new(move |cycle| {
            let back = value(cycle, "sleeper/kept/second").is_some_and(|kept| kept > 0.0);
            let late = start.elapsed() > Duration::from_secs(20);
            if back || late { Control::Stop } else { Control::Continue }
        }));
        assert_eq!(end.unwrap(), End::Stopped);
        let (before, after) = (number(&agent, "sleeper/kept/first"), number(&agent, "sleeper/kept/second"));
        let written = number(&agent, "counter/number/value");
        assert!(written > before + 20.0, "from {before} on the writer came to {written}");
        assert_eq!(before, after, "what the late step read stayed as it was");
    }
}

#[test]
fn cycles_are_counted_once_each_when_the_loop_moves_on() {
    // `a` is made by the worker and `b` by the loop itself, or both by the loop.
    for workers in [0, 1] {
        let text = r#"
loop.period = "5ms"
loop.hang = "30ms"
[modules.a]
kind = "counter"
params = { hang_at = 3, hang_ms = 150 }
[modules.b]
kind = "counter"
params = { hang_at = 10, hang_ms = 150 }
[modules.c]
kind = "counter"
"#;
        let mut agent = agent(text, Options { workers, always_help: true, ..Options::default() });
        let numbers = Arc::new(Mutex::new(Vec::new()));
        let taken = Arc::clone(&numbers);
        agent
            .run(Box::new(move |cycle| {
                taken.lock().unwrap().push(cycle.number);
                if cycle.number == 100 { Control::Stop } else { Control::Continue }
            }))
            .unwrap();
        assert_eq!(*numbers.lock().unwrap(), (1..=100).collect::<Vec<_>>());
        assert_eq!(count(&agent, "c"), 100, "every cycle has its tick");
    }
}

#[test]
fn four_hanging_modules_end_the_run_by_name() {
    let text = |trigger: &str| {
        let module = |name| {
            format!(
                "[modules.{name}]\nkind = \"counter\"\nparams = {{ hang_at = 3, hang_ms = 3000 }}\n{trigger}\n"
            )
        };
        let modules: String = ["a", "b", "c", "d"].map(module).concat();
        format!("loop.period = \"5ms\"\nloop.hang = \"50ms\"\n{modules}[modules.counter]\n")
    };
    for (mode, trigger) in [(Mode::Staged, ""), (Mode::Threaded, "every = \"5ms\"")] {
        let mut agent = agent(&text(trigger), Options { mode, ..Options::default() });
        let start = Instant::now();
        let end = agent.run(after(100_000)).unwrap();
        let End::TooManyHung { mut modules } = end else { panic!("{end:?}") };
        modules.sort();
        assert_eq!(modules, ["a", "b", "c", "d"]);
        assert!(start.elapsed() < Duration::from_millis(2500), "it waits for none of them");
    }
}

#[test]
fn a_hang_in_lockstep_ends_the_run_by_name() {
    let mut agent = try_lockstep(
        "loop.hang = \"50ms\"\n[modules.counter]\nparams = { hang_at = 5, hang_ms = 1500 }\n[modules.other]\nkind = \"counter\"\n",
    )
    .unwrap();
    let start = Instant::now();
    let end = agent.run(after(100)).unwrap();
    assert_eq!(end, End::Hung { module: "counter".into() });
    assert!(start.elapsed() < Duration::from_millis(1400), "it does not wait for the module");
    assert_eq!(count(&agent, "other"), 4, "nothing goes on without it");
}

#[test]
fn a_late_step_that_panics_is_followed_by_a_fresh_state() {
    for (mode, trigger) in [(Mode::Staged, ""), (Mode::Threaded, "every = \"5ms\"")] {
        let text = format!(
            "loop.period = \"5ms\"\nloop.hang = \"50ms\"\n[modules.counter]\n{trigger}\n\
             params = {{ hang_at = 3, hang_ms = 300, panic_at = 3 }}\n[modules.other]\nkind = \"counter\"\n"
        );
        let mut agent = agent(&text, Options { mode, ..Options::default() });
        let start = Instant::now();
        let end = agent.run(Box::new(move |cycle| {
            let goes_on = value(cycle, "counter/number/value").is_some_and(|count| count > 5.0);
            let late = start.elapsed() > Duration::from_secs(20);
            if goes_on || late { Control::Stop } else { Control::Continue }
        }));
        assert_eq!(end.unwrap(), End::Stopped);
        let (ticks, _, panics) = agent.counts("counter").unwrap();
        assert_eq!(panics, 1, "{mode:?}");
        let count = number(&agent, "counter/number/value");
        assert!(count > 5.0 && count < ticks as f64, "it began anew and goes on: {count} of {ticks}");
    }
}

#[test]
fn a_late_steps_posts_are_lost_with_their_numbers() {
    let text = r#"
loop.period = "5ms"
loop.hang = "50ms"
[modules.poster]
[modules.receiver]
[links]
"receiver/notes" = "poster/notes"
"#;
    let mut agent = agent(text, Options::default());
    let start = Instant::now();
    let end = agent.run(Box::new(move |cycle| {
        let done = value(cycle, "poster/fares/second").is_some() || start.elapsed() > Duration::from_secs(20);
        if done { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    assert_eq!(number(&agent, "poster/fares/first"), 2.0);
    // The fifth may have come behind the receiver's last step.
    let sum = number(&agent, "receiver/sum/first");
    assert!([7.0, 12.0].contains(&sum), "the third is lost: {sum}");
}
