use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use slate_module::prelude::{Module, Outcome, Tick, module};
use slate_module::{Level, Plugin};
use slate_runtime::log::{Levels, LogSettings, LogTarget, Logger, MemoryTarget, Record};
use slate_runtime::{Control, End, Options};

use crate::logging::common::load;
use crate::logging::{LONG, Talker};

/// Takes no line while the test holds the gate, as a disk or a terminal that hangs.
struct Stuck {
    gate: Arc<Mutex<()>>,
    then: MemoryTarget,
    /// Whether a line waits at the gate.
    waits: Arc<AtomicBool>,
}

impl LogTarget for Stuck {
    fn write(&mut self, record: &Record) {
        self.waits.store(true, Ordering::Release);
        let _open = self.gate.lock();
        self.then.write(record);
    }
}

/// Logs in every tenth tick.
pub struct Quiet;

#[module(stage = PostLoop)]
impl Module for Quiet {
    type Io = ();
    type Params = ();
    type State = ();

    fn tick(_: &mut (), _: &(), _: &(), now: &Tick) -> Outcome {
        if now.number().is_multiple_of(10) {
            now.info(format_args!("quiet {}", now.number()));
        }
        Outcome::Ok
    }
}

#[test]
fn a_hanging_target_and_a_flooding_module_delay_no_other() {
    let (gate, then) = (Arc::new(Mutex::new(())), MemoryTarget::default());
    let closed = gate.lock().unwrap();
    let target = Stuck { gate: Arc::clone(&gate), then: then.clone(), waits: Arc::default() };
    let text =
        "loop.period = \"1ms\"\nlog.repeat = 0\n[modules.talker]\nparams.lines = 20\n[modules.quiet]\n";
    let options = Options { log: vec![Box::new(target)], ..Options::default() };
    let plugins = [Plugin::linked::<Talker>(), Plugin::linked::<Quiet>()];
    let mut agent = load(text, &plugins, options).unwrap();
    // Not one line is written during the whole run.
    let end =
        agent.run(Box::new(|cycle| if cycle.number == 100 { Control::Stop } else { Control::Continue }));
    assert_eq!(end.unwrap(), End::Stopped);
    assert_eq!(agent.counts("talker").unwrap().0, 100);
    drop(closed);
    agent.logger().flush(LONG);
    let lines = then.lines();
    let of = |module: &str| lines.iter().filter(|line| &*line.module == module).cloned().collect::<Vec<_>>();
    assert_eq!(of("quiet").len(), 10, "all of them");
    assert_eq!(agent.logger().dropped_of("quiet"), 0);
    let dropped = agent.logger().dropped_of("talker");
    assert!(dropped > 5000 && dropped <= agent.logger().dropped());
    let talker = of("talker");
    // One of the lines only reports what was dropped.
    assert_eq!(talker.len() as u64 - 1 + dropped, 100 * 20 * 3);
    assert_eq!(talker.iter().map(|line| line.dropped).sum::<u64>(), dropped, "all are told of");
    assert_eq!(talker.last().unwrap().text, "lines of the log were dropped, as its targets are too slow");
}

#[test]
fn the_line_after_dropped_ones_says_how_many_they_were() {
    let (gate, then) = (Arc::new(Mutex::new(())), MemoryTarget::default());
    let closed = gate.lock().unwrap();
    // In lockstep only lines bring what was dropped; those of the agent itself never wait.
    let settings = LogSettings { levels: Levels::new(Level::Info), repeat: 0, lockstep: true, modules: 0 };
    let waits = Arc::<AtomicBool>::default();
    let target = Stuck { gate: Arc::clone(&gate), then: then.clone(), waits: Arc::clone(&waits) };
    let logger = Logger::new(settings, vec![Box::new(target)]).unwrap();
    logger.log(0, Level::Info, "first");
    while !waits.load(Ordering::Acquire) {
        std::thread::yield_now();
    }
    (0..3000).for_each(|number| logger.log(0, Level::Info, &format!("line {number}")));
    let mut dropped = logger.dropped();
    assert!(dropped > 2000);
    assert_eq!(logger.dropped_of("agent"), dropped);
    drop(closed);
    loop {
        logger.log(1, Level::Info, "later");
        if logger.dropped() == dropped {
            break;
        }
        dropped = logger.dropped();
        std::thread::yield_now();
    }
    logger.flush(LONG);
    let lines = then.lines();
    let first = lines.iter().find(|line| line.text == "later").unwrap();
    assert_eq!(first.dropped, dropped);
    assert_eq!(first.message(), format!("later ({dropped} lines before this were dropped)"));
}
