//! Defects of the predecessors.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use slate_runtime::{Control, End, Mode, Options, Rate};

use crate::faults::common::{lockstep, number};
use crate::faults::{after, agent, count, value};

/// How many of `cycles` on the loop, with workers, took longer than a lost wake-up's time limit.
fn stalled(workers: usize, cycles: u64) -> u64 {
    let text = "time.source = \"a\"\n[modules.a]\nkind = \"counter\"\n[modules.b]\nkind = \"counter\"\n\
                [modules.c]\nkind = \"dice\"\n[modules.d]\nkind = \"dice\"\n";
    let options = Options { rate: Rate::Max, workers, always_help: true, ..Options::default() };
    let mut agent = agent(text, options);
    let stalls = Arc::new(AtomicU64::new(0));
    let counter = Arc::clone(&stalls);
    let mut last = Instant::now();
    let end = agent.run(Box::new(move |cycle| {
        if std::mem::replace(&mut last, Instant::now()).elapsed() > Duration::from_millis(9) {
            counter.fetch_add(1, Ordering::Relaxed);
        }
        if cycle.number == cycles { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    for module in ["a", "b", "c", "d"] {
        assert_eq!(count(&agent, module), cycles);
    }
    stalls.load(Ordering::Relaxed)
}

#[test]
fn fawkes_no_wake_up_of_a_worker_is_lost_in_ten_thousand_cycles() {
    // Fawkes lost one in four. Another program may take the processor away for that long at times.
    for workers in [1, 2] {
        let stalls = stalled(workers, 10_000);
        assert!(stalls < 100, "{stalls} stalls with {workers} workers");
    }
}

#[test]
fn fawkes_no_wake_up_is_lost_between_threads_in_10000_rounds() {
    // Nothing but the other's value wakes a player, and its thread looks by itself only ten times a second.
    let text = r#"
loop.period = "10ms"
[modules.a]
kind = "player"
on = ["kick", "ball"]
inputs.kick = { value = 1.0 }
[modules.b]
kind = "player"
stage = "Act"
on = "ball"
[links]
"a/ball" = "b/played"
"b/ball" = "a/played"
"#;
    let mut agent = agent(text, Options { mode: Mode::Threaded, ..Options::default() });
    let start = Instant::now();
    let end = agent.run(Box::new(move |cycle| {
        let done = value(cycle, "a/played/value").is_some_and(|value| value > 20_000.0);
        if done || start.elapsed() > Duration::from_secs(60) { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    let rounds = number(&agent, "a/played/value") / 2.0;
    assert!(rounds > 10_000.0, "{rounds} rounds in {:?}", start.elapsed());
}

#[test]
fn fawkes_a_slow_reader_does_not_block_the_writer() {
    let text = r#"
loop.period = "5ms"
[modules.counter]
every = "2ms"
[modules.slow]
[links]
"slow/input" = "counter/number"
"#;
    let mut agent = agent(text, Options { mode: Mode::Threaded, ..Options::default() });
    agent.run(after(200)).unwrap();
    let (writer, reader) = (count(&agent, "counter"), count(&agent, "slow"));
    assert!(reader >= 5, "{reader}");
    assert!(writer > 4 * reader, "{writer} values for {reader} ticks of the reader");
}

#[test]
fn openrdk_unread_queue_does_not_grow() {
    let text = r#"
[modules.counter]
[modules.sender]
[modules.receiver]
enabled = false
[links]
"receiver/notes" = "sender/note"
"receiver/history" = "counter/number"
"#;
    let mut agent = lockstep(text);
    (0..10_000).for_each(|_| assert!(agent.step()));
    let on = slate_blackboard::interface::Value::Bool(true);
    agent.board().write("receiver/enabled/value", &on, 0).unwrap();
    agent.step();
    let kept: f64 = (9_970..=9_985).map(f64::from).sum();
    assert_eq!(number(&agent, "receiver/sum/second"), kept, "of 10 001 values two windows were kept");
    let messages = number(&agent, "receiver/sum/first");
    assert!(
        messages > 0.0 && messages < 10_000.0,
        "the first ones were kept, the others refused: {messages}"
    );
}
