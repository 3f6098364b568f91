//! What reaches the targets of the log, and in which order.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

mod common;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use common::{Number, load};
use slate_module::prelude::*;
use slate_module::{Level, Plugin};
use slate_runtime::log::{LogTarget, MemoryTarget, Record};
use slate_runtime::{Control, End, Options, Rate};

/// Ports of [`Talker`].
#[ports]
pub struct TalkerIo {
    number: Output<Number>,
}

/// Parameters of [`Talker`].
#[params]
pub struct TalkerParams {
    #[param(default = 1, doc = "lines a tick")]
    lines: u64,
}

/// Logs in every level.
pub struct Talker;

#[module(stage = Think)]
impl Module for Talker {
    type Io = TalkerIo;
    type Params = TalkerParams;
    type State = ();

    fn tick(_: &mut (), io: &TalkerIo, params: &TalkerParams, now: &Tick) -> Outcome {
        for line in 0..params.lines {
            now.log(Level::Trace, format_args!("trace {}", now.number()));
            now.log(Level::Debug, format_args!("debug {}", now.number()));
            now.info(format_args!("info {} {line}", now.number()));
            now.warn(format_args!("warn {}", now.number()));
            now.error(format_args!("error {}", now.number()));
        }
        io.number.set(Number { value: 1.0 });
        Outcome::Ok
    }
}

fn lines_of(text: &str, options: Options, steps: usize) -> Vec<Record> {
    let target = MemoryTarget::default();
    let options = Options { log: vec![Box::new(target.clone())], rate: Rate::Max, ..options };
    let mut agent = load(text, &[Plugin::linked::<Talker>()], options).unwrap();
    (0..steps).for_each(|_| assert!(agent.step()));
    drop(agent);
    target.lines()
}

#[test]
fn each_module_has_its_level() {
    let text = r#"
time.source = "a"
[log]
level = "warn"
[log.levels]
b = "debug"
c = "error"
[modules.a]
plugin = "talker"
[modules.b]
plugin = "talker"
[modules.c]
plugin = "talker"
"#;
    let lines = lines_of(text, Options::default(), 1);
    let said: Vec<_> = lines.iter().map(|line| (&*line.module, line.text.as_str())).collect();
    assert_eq!(
        said,
        [
            ("a", "warn 1"),
            ("a", "error 1"),
            ("b", "debug 1"),
            ("b", "info 1 0"),
            ("b", "warn 1"),
            ("b", "error 1"),
            ("c", "error 1"),
        ]
    );
}

#[test]
fn in_lockstep_lines_stand_in_the_order_of_the_modules_whoever_makes_their_steps() {
    let mut text = String::from("time.source = \"m0\"\nloop.period = \"10ms\"\n");
    for module in 0..7 {
        text.push_str(&format!("[modules.m{module}]\nplugin = \"talker\"\n"));
    }
    let mut expected = Vec::new();
    for step in 0..20_u64 {
        for module in 0..7 {
            for text in ["info {} 0", "warn {}", "error {}"] {
                let text = text.replace("{}", &(step + 1).to_string());
                expected.push((step * 10_000_000, format!("m{module}"), text));
            }
        }
    }
    for workers in [0, 1, 3] {
        let options = Options { workers, always_help: true, ..Options::default() };
        let lines = lines_of(&text, options, 20).into_iter();
        let said: Vec<_> = lines.map(|line| (line.time, line.module.to_string(), line.text)).collect();
        assert_eq!(said, expected, "{workers} workers");
    }
}

/// Takes 2 ms for a line, as a full disk or a slow terminal does.
struct SlowTarget {
    written: Arc<AtomicU64>,
    lost: Arc<Mutex<Vec<String>>>,
}

impl LogTarget for SlowTarget {
    fn write(&mut self, record: &Record) {
        if &*record.module == "agent" {
            self.lost.lock().unwrap().push(record.text.clone());
            return;
        }
        self.written.fetch_add(1, Ordering::Relaxed);
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn on_the_wall_clock_a_slow_target_loses_lines_and_says_how_many_but_holds_nobody_up() {
    let written = Arc::new(AtomicU64::new(0));
    let lost = Arc::new(Mutex::new(Vec::new()));
    let target = SlowTarget { written: Arc::clone(&written), lost: Arc::clone(&lost) };
    let text = "loop.period = \"2ms\"\n[modules.talker]\nparams.lines = 50\n";
    let options = Options { log: vec![Box::new(target)], ..Options::default() };
    let mut agent = load(text, &[Plugin::linked::<Talker>()], options).unwrap();
    let start = Instant::now();
    let end =
        agent.run(Box::new(|cycle| if cycle.number == 200 { Control::Stop } else { Control::Continue }));
    assert_eq!(end.unwrap(), End::Stopped);
    let ticks = agent.counts("talker").unwrap().0;
    assert_eq!(ticks, 200);
    let lines = ticks * 50 * 3;
    let elapsed = start.elapsed();
    assert!(
        elapsed < Duration::from_millis(2 * lines) / 4,
        "it would take a minute to write all: {elapsed:?}"
    );
    assert!(written.load(Ordering::Relaxed) < lines / 2);
    let told = lost.lock().unwrap();
    let dropped: u64 = told.iter().filter_map(|line| line.split(' ').next()?.parse::<u64>().ok()).sum();
    assert!(dropped > lines / 2 && dropped <= lines, "{dropped} of {lines} dropped: {told:?}");
}

#[test]
fn in_lockstep_no_line_is_lost_to_a_slow_target() {
    /// Writes a line now and then slowly.
    struct Uneven(Arc<AtomicU64>);
    impl LogTarget for Uneven {
        fn write(&mut self, _: &Record) {
            if self.0.fetch_add(1, Ordering::Relaxed).is_multiple_of(500) {
                std::thread::sleep(Duration::from_millis(20));
            }
        }
    }
    let written = Arc::new(AtomicU64::new(0));
    let text = "time.source = \"talker\"\n[modules.talker]\nparams.lines = 10\n";
    let options =
        Options { log: vec![Box::new(Uneven(Arc::clone(&written)))], rate: Rate::Max, ..Options::default() };
    let mut agent = load(text, &[Plugin::linked::<Talker>()], options).unwrap();
    (0..200).for_each(|_| assert!(agent.step()));
    drop(agent);
    assert_eq!(written.load(Ordering::Relaxed), 200 * 10 * 3, "and the end waits for the last ones");
}

#[test]
fn a_long_line_is_cut_and_nothing_else_happens() {
    /// Logs more than a line holds.
    pub struct Novelist;

    #[module(stage = Think)]
    impl Module for Novelist {
        type Io = ();
        type Params = ();
        type State = ();

        fn tick(_: &mut (), _: &(), _: &(), now: &Tick) -> Outcome {
            now.info(format_args!("{:>600}", "ä"));
            Outcome::Ok
        }
    }

    let target = MemoryTarget::default();
    let options = Options { log: vec![Box::new(target.clone())], rate: Rate::Max, ..Options::default() };
    let text = "time.source = \"novelist\"\n[modules.novelist]\n";
    let mut agent = load(text, &[Plugin::linked::<Novelist>()], options).unwrap();
    assert!(agent.step() && agent.step());
    drop(agent);
    let lines = target.lines();
    assert_eq!(lines.len(), 2);
    assert_eq!(lines[0].text.len(), 512);
}
