//! A cycle that has warmed up allocates nothing.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

mod common;

use std::time::Duration;

use allocation_counter::measure;
use common::{Number, load, number};
use slate_module::aspect::{
    Aspect, Logger, LoopPlace, LoopStage, MainLoop, Policy, Stop, Synchronization, Threads,
};
use slate_module::prelude::*;
use slate_module::{Plugin, Stage};
use slate_runtime::log::{LogTarget, MemoryTarget, Record};
use slate_runtime::{Agent, Options, Rate};

/// Ports of [`Reporter`].
#[ports]
pub struct ReporterIo {
    input: Input<Number>,
}

/// Logs what it reads.
pub struct Reporter;

#[module(stage = PostLoop)]
impl Module for Reporter {
    type Io = ReporterIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &ReporterIo, _: &(), now: &Tick) -> Outcome {
        now.info(format_args!("the number is {}", io.input.get().copied().unwrap_or_default().value));
        Outcome::Ok
    }
}

/// Ports of [`Talker`].
#[ports]
pub struct TalkerIo {
    threads: Aspect<Threads>,
    synchronization: Aspect<Synchronization>,
    logger: Aspect<Logger>,
    heard: Output<Number>,
}

/// Talks with a thread of its own.
pub struct Talker;

#[module(stage = Think)]
impl Module for Talker {
    type Io = TalkerIo;
    type Params = ();
    type State = f64;

    fn tick(heard: &mut f64, io: &TalkerIo, _: &(), now: &Tick) -> Outcome {
        if !io.threads.is_running("echo") {
            let echo = |stop: &Stop| {
                while stop.wait(Duration::from_secs(1)) {
                    while let Ok(Some(number)) = stop.receive::<Number>() {
                        let _ = stop.send(&number);
                    }
                }
            };
            io.threads.spawn("echo", echo).unwrap();
        }
        // The ring may be full now and then.
        io.threads.send("echo", &Number { value: now.seconds() }).unwrap();
        while let Ok(Some(_)) = io.threads.receive::<Number>("echo") {
            *heard += 1.0;
        }
        io.synchronization.emit("/talker").unwrap();
        assert!(io.synchronization.count("/talker").unwrap() < now.number());
        assert_eq!(io.logger.dropped(), 0);
        io.heard.set(Number { value: *heard });
        Outcome::Ok
    }
}

/// Ports of [`Director`].
#[ports]
pub struct DirectorIo {
    main_loop: Aspect<MainLoop>,
}

/// Has the main loop, with one stage.
pub struct Director;

/// The stages one after the other.
struct InOrder;

impl Policy for InOrder {
    fn next(&mut self, place: &LoopPlace) -> Option<usize> {
        let next = place.after().map_or(0, |after| after + 1);
        (next < place.stage_count()).then_some(next)
    }
}

#[module(stage = PreLoop)]
impl Module for Director {
    type Io = DirectorIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &DirectorIo, _: &(), _: &Tick) -> Outcome {
        if !io.main_loop.is_held() {
            let all = LoopStage { name: "All", members: &Stage::ALL, timeout: None };
            io.main_loop.take(&[all], InOrder).unwrap();
        }
        Outcome::Ok
    }
}

const ROBOT: &str = r#"
time.source = "counter"
[modules.counter]
[modules.a]
kind = "relay"
[modules.b]
kind = "relay"
[modules.sender]
[modules.receiver]
[modules.driver]
[modules.reporter]
[links]
"a/input" = "counter/number"
"b/input" = "a/output"
"driver/input" = "b/output"
"reporter/input" = "wheel/command"
"receiver/notes" = "sender/note"
"receiver/history" = "counter/number"
[actuators.wheel]
command = "driver/wheel"
limits = { value = [0.0, 500.0] }
"#;

/// Writes its first line slowly, so that loggers fill the buffer and wait: a thread that does so first allocates its
/// entry in the wait list.
struct SlowFirst(bool);

impl LogTarget for SlowFirst {
    fn write(&mut self, _: &Record) {
        if !std::mem::replace(&mut self.0, true) {
            std::thread::sleep(Duration::from_millis(200));
        }
    }
}

fn robot(text: &str, workers: usize) -> Agent {
    let log: Vec<Box<dyn LogTarget>> = vec![Box::new(MemoryTarget::default()), Box::new(SlowFirst(false))];
    let options =
        Options { rate: Rate::Max, armed: true, log, workers, always_help: true, ..Options::default() };
    let plugins = [Plugin::linked::<Reporter>(), Plugin::linked::<Talker>(), Plugin::linked::<Director>()];
    load(text, &plugins, options).unwrap()
}

/// What 1000 cycles allocate after as many to warm up.
fn allocations(agent: &mut Agent) -> u64 {
    // More lines than the logger's buffer holds.
    (0..3000).for_each(|_| assert!(agent.step()));
    // Of this thread: the logger's own thread may allocate.
    measure(|| (0..1000).for_each(|_| assert!(agent.step()))).count_total
}

#[test]
fn the_allocator_counts() {
    assert_eq!(measure(|| drop(std::hint::black_box(Box::new(7)))).count_total, 1);
}

#[test]
fn values_queues_messages_commands_and_log_allocate_nothing() {
    let mut agent = robot(ROBOT, 0);
    assert_eq!(allocations(&mut agent), 0);
    assert_eq!(number(&agent, "wheel/command/value"), 500.0, "the limit was at work");
    assert_eq!(number(&agent, "receiver/sum/first"), 4000.0 * 4001.0 / 2.0);
    assert_eq!(number(&agent, "receiver/sum/second"), 4000.0 * 4001.0 / 2.0);
}

#[test]
fn links_that_convert_filter_and_set_allocate_nothing() {
    let links = r#"
"twin/left/first" = "counter/number/value"
"twin/left/second" = { from = "counter/number/value", previous = true }
"counter/params/hang_ms" = "receiver/timing/ticks"
"sender/enabled" = "counter/enabled"
"receiver/history" = { from = "counter/number", every = 2, when = "value > 10" }
"#;
    let text = ROBOT.replace("\"receiver/history\" = \"counter/number\"\n", links);
    let text = text.replace("[modules.sender]", "[modules.twin]\n[modules.sender]");
    let mut agent = robot(&text, 0);
    assert_eq!(allocations(&mut agent), 0);
    let read = |path: &str| number(&agent, path);
    assert_eq!((read("twin/left/first"), read("twin/left/second")), (4000.0, 3999.0));
    assert!(read("counter/params/hang_ms") > 0.0);
}

#[test]
fn a_trace_that_is_recorded_allocates_nothing_in_the_loop() {
    let mut agent = robot(ROBOT, 0);
    let (trace, recording) = (agent.trace(), agent.trace().record(std::io::sink()).unwrap());
    assert_eq!(allocations(&mut agent), 0);
    assert!(trace.is_on());
    let (recorded, _) = recording.end().unwrap();
    let cycles = |track: &&slate_runtime::timing::RecordedTrack| track.name == "counter";
    let counter = recorded.tracks.iter().find(cycles).unwrap();
    assert_eq!(counter.spans + counter.missing, 4000);
}

#[test]
fn a_loop_with_the_stages_of_a_module_allocates_nothing() {
    let mut agent = robot(&ROBOT.replace("[modules.counter]", "[modules.counter]\n[modules.director]"), 0);
    assert_eq!(allocations(&mut agent), 0);
    assert!(
        agent.board().get("loop/All/histogram").is_some()
            && agent.board().get("loop/Act/histogram").is_none()
    );
    assert_eq!(number(&agent, "wheel/command/value"), 500.0, "all modules run");
}

#[test]
fn workers_allocate_nothing() {
    assert_eq!(allocations(&mut robot(ROBOT, 2)), 0);
}

#[test]
fn unread_queue_and_inbox_allocate_nothing() {
    let text = ROBOT.replace("[modules.receiver]", "[modules.receiver]\nenabled = false");
    assert_eq!(allocations(&mut robot(&text, 0)), 0);
}

#[test]
fn a_module_that_fails_or_writes_no_number_allocates_nothing() {
    // Its commands are withdrawn, and its readers run on.
    let text = ROBOT.replace("[modules.counter]", "[modules.counter]\nparams.nan_at = 3500");
    assert_eq!(allocations(&mut robot(&text, 0)), 0);
}

#[test]
fn a_tick_and_its_thread_exchange_values_without_allocation() {
    let mut agent = robot("time.source = \"counter\"\n[modules.counter]\n[modules.talker]\n", 0);
    assert_eq!(allocations(&mut agent), 0);
    while number(&agent, "talker/heard/value") == 0.0 {
        assert!(agent.step());
    }
}
