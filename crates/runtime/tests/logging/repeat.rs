use std::collections::BTreeMap;

use proptest::prelude::*;
use slate_module::prelude::{Module, Outcome, Tick, module, params};
use slate_module::{Level, Plugin};
use slate_runtime::log::{MemoryTarget, Record};
use slate_runtime::{Options, Rate};

use crate::logging::common::load;
use crate::logging::{LONG, logger};

/// Parameters of [`Parrot`].
#[params]
pub struct ParrotParams {
    #[param(default = 0, doc = "says something else in that tick; 0 for never")]
    other_at: u64,
}

/// Says the same in every tick, with another field each time.
pub struct Parrot;

#[module(stage = Think)]
impl Module for Parrot {
    type Io = ();
    type Params = ParrotParams;
    type State = ();

    fn tick(_: &mut (), _: &(), params: &ParrotParams, now: &Tick) -> Outcome {
        if now.number() == params.other_at {
            now.info(format_args!("something else"));
        }
        now.log_with(Level::Info, format_args!("again"), &[("tick", now.number().into())]);
        Outcome::Ok
    }
}

fn logged_lines(text: &str, steps: usize, workers: usize) -> Vec<(u64, String, String)> {
    let target = MemoryTarget::default();
    let options = Options {
        log: vec![Box::new(target.clone())],
        rate: Rate::Max,
        workers,
        always_help: true,
        ..Options::default()
    };
    let mut agent = load(text, &[Plugin::linked::<Parrot>()], options).unwrap();
    (0..steps).for_each(|_| assert!(agent.step()));
    drop(agent);
    let milliseconds = |line: Record| (line.time / 1_000_000, line.module.to_string(), line.message());
    target.lines().into_iter().map(milliseconds).collect()
}

fn expected(lines: &[(u64, &str, &str)]) -> Vec<(u64, String, String)> {
    lines.iter().map(|(time, module, text)| (*time, (*module).into(), (*text).into())).collect()
}

const ONE: &str = "time.source = \"parrot\"\nloop.period = \"100ms\"\n[modules.parrot]\n";

#[test]
fn repeated_lines_are_summarized_per_window() {
    let lines = [
        (0, "parrot", "again tick=1"),
        (100, "parrot", "again tick=2"),
        (200, "parrot", "again tick=3"),
        (300, "parrot", "again tick=4"),
        (400, "parrot", "again tick=5"),
        (900, "parrot", "repeated 5 times: again"),
        (1000, "parrot", "again tick=11"),
        (1100, "parrot", "again tick=12"),
        (1200, "parrot", "again tick=13"),
        (1300, "parrot", "again tick=14"),
        (1400, "parrot", "again tick=15"),
        // The end of the run.
        (1500, "parrot", "repeated once more: again"),
    ];
    assert_eq!(logged_lines(ONE, 16, 0), expected(&lines));
}

#[test]
fn only_messages_of_the_same_module_bring_the_suppressed_count() {
    let text = r#"
time.source = "a"
loop.period = "100ms"
log.repeat = 1
[modules.a]
kind = "parrot"
params.other_at = 4
[modules.b]
kind = "parrot"
"#;
    let lines = [
        (0, "a", "again tick=1"),
        (0, "b", "again tick=1"),
        (200, "a", "repeated 2 times: again"),
        (300, "a", "something else"),
        (900, "a", "repeated 7 times: again"),
        (900, "b", "repeated 9 times: again"),
        (1000, "a", "again tick=11"),
        (1000, "b", "again tick=11"),
    ];
    for workers in [0, 1] {
        assert_eq!(logged_lines(text, 11, workers), expected(&lines), "{workers} workers");
    }
}

#[test]
fn without_a_limit_everything_is_written() {
    assert_eq!(logged_lines(&format!("log.repeat = 0\n{ONE}"), 30, 0).len(), 30);
}

#[test]
fn on_the_wall_clock_the_sum_comes_though_nothing_else_does() {
    let target = MemoryTarget::default();
    let logger = logger(2, vec![Box::new(target.clone())]);
    (0..20).for_each(|time| logger.log(time, Level::Warn, "again"));
    let mut waited = std::time::Duration::ZERO;
    while target.lines().len() < 3 && waited < LONG {
        let look = std::time::Duration::from_millis(20);
        std::thread::sleep(look);
        waited += look;
    }
    let texts: Vec<_> = target.lines().into_iter().map(|line| line.text).collect();
    assert_eq!(texts, ["again", "again", "repeated 18 times: again"]);
}

/// How often a line was logged, by what it says.
fn count(line: &Record) -> (String, u64) {
    match line.text.strip_prefix("repeated ").and_then(|rest| rest.split_once(": ")) {
        None => (line.text.clone(), 1),
        Some(("once more", text)) => (text.into(), 1),
        Some((times, text)) => (text.into(), times.split(' ').next().unwrap().parse().unwrap()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_line_is_forgotten_and_no_text_fills_the_log(
        lines in prop::collection::vec((0_u64..400_000_000, 0..4_usize), 1..200),
        limit in 1_u64..4,
    ) {
        let target = MemoryTarget::default();
        let logger = logger(limit, vec![Box::new(target.clone())]);
        let (mut time, mut logged) = (0, BTreeMap::<String, u64>::new());
        for (pause, text) in lines {
            time += pause;
            let text = ["a", "b", "c", "d"][text];
            logger.log(time, Level::Info, text);
            *logged.entry(text.to_owned()).or_default() += 1_u64;
        }
        logger.flush(LONG);
        let written = target.lines();
        let mut counted = BTreeMap::<String, u64>::new();
        for (text, times) in written.iter().map(count) {
            *counted.entry(text).or_default() += times;
        }
        prop_assert_eq!(counted, logged);
        for (at, line) in written.iter().enumerate() {
            let same = |other: &&Record| other.text == line.text && other.time < line.time + 1_000_000_000;
            prop_assert!(line.text.contains(' ') || written[at..].iter().filter(same).count() as u64 <= 2 * limit);
        }
    }
}
