//! Lines that reach the targets of the log, and their order.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use crate::common;
mod configuration;
mod fields;
mod file;
mod flood;
mod levels;
mod properties;
mod remote;
mod repeat;
mod syslog;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use common::{Number, load};
use slate_module::prelude::*;
use slate_module::{Level, Plugin};
use slate_runtime::log::{Levels, LogSettings, LogTarget, Logger, MemoryTarget, Record};
use slate_runtime::{Options, Rate};

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

/// Time enough for what must come in the end.
const LONG: Duration = Duration::from_secs(60);

/// A logger of all levels on the wall clock.
fn logger(repeat: u64, targets: Vec<Box<dyn LogTarget>>) -> Logger {
    let settings = LogSettings { levels: Levels::new(Level::Trace), repeat, lockstep: false, modules: 4 };
    Logger::new(settings, targets).unwrap()
}

/// A record of a module `m`.
fn record(text: &str) -> Record {
    Record::new(1_500_000_000, Level::Info, &Arc::from("m"), text)
}

/// An empty folder for a test.
fn folder(test: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("log-{}-{test}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
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
fn in_lockstep_log_lines_follow_the_order_of_modules() {
    let mut text = String::from("time.source = \"m0\"\nloop.period = \"10ms\"\n");
    for module in 0..7 {
        text.push_str(&format!("[modules.m{module}]\nkind = \"talker\"\n"));
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
    let text = "time.source = \"talker\"\nlog.repeat = 0\n[modules.talker]\nparams.lines = 10\n";
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

#[test]
fn a_target_that_panics_takes_no_other_with_it() {
    struct Broken;
    impl LogTarget for Broken {
        fn write(&mut self, _: &Record) {
            panic!("as the test wants");
        }
    }
    let target = MemoryTarget::default();
    let logger = logger(0, vec![Box::new(Broken), Box::new(target.clone())]);
    logger.log(0, Level::Info, "one");
    logger.log(1, Level::Info, "two");
    drop(logger);
    let texts: Vec<_> = target.lines().into_iter().map(|line| line.text).collect();
    assert_eq!(texts, ["one", "a target of the log panicked and gets no more lines", "two"]);
}

#[test]
fn a_target_may_come_while_the_agent_runs() {
    let target = MemoryTarget::default();
    let logger = logger(0, Vec::new());
    logger.log(0, Level::Info, "before");
    logger.add_target(Box::new(target.clone()));
    logger.log(1, Level::Info, "after");
    logger.flush(LONG);
    assert_eq!(target.lines().len(), 1);
    assert_eq!(target.lines()[0].text, "after");
}
