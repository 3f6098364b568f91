//! The same configuration in all modes, and with any number of workers.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use crate::common;

use std::fmt::Write;

use common::{Number, Pair, load, number};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::{Agent, Control, End, Mode, Options, Rate, StartError};

/// Ports of [`Twins`].
#[ports]
pub struct TwinsIo {
    left: Output<Pair>,
    right: Output<Pair>,
}

/// Writes the same number to two outputs.
pub struct Twins;

#[module(stage = SensorAcquire)]
impl Module for Twins {
    type Io = TwinsIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &TwinsIo, _: &(), _: &Tick) -> Outcome {
        *state += 1.0;
        io.left.set(Pair { first: *state, second: 0.0 });
        io.right.set(Pair { first: *state, second: 0.0 });
        Outcome::Ok
    }
}

/// Ports of [`Mixer`].
#[ports]
pub struct MixerIo {
    a: Input<Number>,
    b: Input<Number>,
    output: Output<Number>,
}

/// Mixes two numbers with a random one.
pub struct Mixer;

#[module(stage = Think)]
impl Module for Mixer {
    type Io = MixerIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &MixerIo, _: &(), now: &Tick) -> Outcome {
        *state = 0.5 * *state + io.a.get().copied().unwrap_or_default().value
            - 0.25 * io.b.get().copied().unwrap_or_default().value
            + now.random(|random| random.normal());
        io.output.set(Number { value: *state });
        Outcome::Ok
    }
}

fn agent(text: &str, options: Options) -> Agent {
    load(text, &[Plugin::linked::<Twins>(), Plugin::linked::<Mixer>()], options).unwrap()
}

fn run(agent: &mut Agent, cycles: u64) {
    let end = agent.run(Box::new(
        move |cycle| {
            if cycle.number >= cycles { Control::Stop } else { Control::Continue }
        },
    ));
    assert_eq!(end.unwrap(), End::Stopped);
}

const ROBOT: &str = r#"
loop.period = "5ms"
[modules.counter]
every = "10ms"
[modules.relay]
[modules.sender]
[modules.receiver]
[links]
"relay/input" = "counter/number"
"receiver/notes" = "sender/note"
"receiver/history" = "counter/number"
"#;

#[test]
fn one_configuration_runs_staged_and_threaded() {
    for mode in [Mode::Staged, Mode::Threaded] {
        let mut agent = agent(ROBOT, Options { mode, ..Options::default() });
        run(&mut agent, 100);
        let count = |module: &str| agent.counts(module).unwrap().0 as f64;
        // The loop is not held up for long, but cycles may be left out; the agent's time says how many.
        let periods = agent.now() as f64 / 10e6;
        let ticks = count("counter");
        assert!(
            ticks > 0.5 * periods && ticks < periods + 3.0,
            "{mode:?}: {ticks} ticks in {periods} periods"
        );
        assert_eq!(number(&agent, "counter/number/value"), ticks);
        let relayed = number(&agent, "relay/output/value");
        assert!(relayed > ticks - 2.0 && relayed <= ticks + 1.0, "{mode:?}: {relayed} after {ticks}");
        let sent = count("sender");
        assert_eq!(
            number(&agent, "receiver/sum/first"),
            sent * (sent + 1.0) / 2.0,
            "{mode:?}: every message"
        );
        let values = number(&agent, "receiver/sum/second");
        assert!(
            values <= ticks * (ticks + 1.0) / 2.0 && values >= (ticks - 2.0) * (ticks - 1.0) / 2.0,
            "{mode:?}: {values}: every value but the last ones"
        );
    }
}

#[test]
fn threads_and_a_rate_without_limit_are_refused() {
    let options = Options { mode: Mode::Threaded, rate: Rate::Max, ..Options::default() };
    let refusal = load("[modules.counter]\n", &[], options).err().unwrap();
    assert!(matches!(refusal, StartError::ThreadedMax), "{refusal}");
}

/// Many modules in one level, and levels behind each other that cross each other.
fn mesh() -> String {
    let mut text = String::from("time.source = \"s00\"\nagent.seed = 7\n");
    let width = 12;
    for i in 0..width {
        writeln!(text, "[modules.s{i:02}]\nkind = \"dice\"").unwrap();
    }
    for level in 0..3 {
        for i in 0..width {
            writeln!(text, "[modules.m{level}_{i:02}]\nkind = \"mixer\"").unwrap();
        }
    }
    text.push_str("[modules.driver]\n[modules.a_reader]\nkind = \"relay\"\nstage = \"Act\"\n");
    text.push_str(
        "[modules.sender]\n[modules.receiver]\n[actuators.wheel]\ncommand = \"driver/wheel\"\n[links]\n",
    );
    for level in 0..3 {
        for i in 0..width {
            let source = |i: usize| match level {
                0 => format!("s{:02}/number", i % width),
                _ => format!("m{}_{:02}/output", level - 1, i % width),
            };
            writeln!(text, "\"m{level}_{i:02}/a\" = \"{}\"", source(i)).unwrap();
            writeln!(text, "\"m{level}_{i:02}/b\" = \"{}\"", source(i + 5)).unwrap();
        }
    }
    text.push_str("\"driver/input\" = \"m2_00/output\"\n\"a_reader/input\" = \"wheel/command\"\n");
    text.push_str("\"receiver/notes\" = \"sender/note\"\n\"receiver/history\" = \"m2_03/output\"\n");
    text
}

#[test]
fn workers_change_no_byte() {
    let digest = |workers: usize| {
        let options =
            Options { rate: Rate::Max, armed: true, workers, always_help: true, ..Options::default() };
        let mut agent = agent(&mesh(), options);
        (0..300).for_each(|_| assert!(agent.step()));
        let commanded = number(&agent, "wheel/command/value");
        assert!(commanded != 0.0 && number(&agent, "a_reader/output/value") == commanded + 1.0, "{workers}");
        agent.digest().unwrap()
    };
    let alone = digest(0);
    for workers in [0, 1, 2, 5, 20] {
        assert_eq!(digest(workers), alone, "{workers} workers");
    }
}

#[test]
fn workers_change_no_byte_in_a_run_with_a_watchdog() {
    let digest = |workers: usize| {
        let options = Options { rate: Rate::Max, workers, always_help: true, ..Options::default() };
        let mut agent = agent(&mesh(), options);
        run(&mut agent, 300);
        agent.digest().unwrap()
    };
    let alone = digest(0);
    for workers in [1, 2] {
        assert_eq!(digest(workers), alone, "{workers} workers");
    }
}

#[test]
fn two_outputs_of_a_tick_are_never_seen_mixed() {
    let text = r#"
loop.period = "10ms"
[modules.twins]
every = "50us"
[modules.twin]
on = "left"
[modules.other]
kind = "twin"
on = ["left", "right"]
[links]
"twin/left" = "twins/left"
"twin/right" = "twins/right"
"other/left" = "twins/left"
"other/right" = "twins/right"
"#;
    let mut agent = agent(text, Options { mode: Mode::Threaded, ..Options::default() });
    run(&mut agent, 100);
    for reader in ["twin", "other"] {
        assert!(agent.counts(reader).unwrap().0 > 500, "{:?}", agent.counts(reader));
        assert_eq!(number(&agent, &format!("{reader}/mismatches/value")), 0.0);
    }
}

#[test]
fn a_disabled_thread_sleeps_and_comes_back() {
    let text = "loop.period = \"5ms\"\n[modules.counter]\nevery = \"1ms\"\nenabled = false\n";
    let mut agent = agent(text, Options { mode: Mode::Threaded, ..Options::default() });
    run(&mut agent, 20);
    assert_eq!(agent.counts("counter").unwrap().0, 0);
    let on = slate_blackboard::interface::Value::Bool(true);
    agent.board().write("counter/enabled/value", &on, 0).unwrap();
    run(&mut agent, 40);
    assert!(agent.counts("counter").unwrap().0 > 10);
}

#[test]
fn a_value_that_a_tool_sets_wakes_a_waiting_thread() {
    let text = "loop.period = \"5ms\"\n[modules.relay]\n";
    let mut agent = agent(text, Options { mode: Mode::Threaded, ..Options::default() });
    let board = std::sync::Arc::clone(agent.board());
    let end = agent.run(Box::new(move |cycle| {
        if cycle.number == 5 {
            let value = slate_blackboard::interface::Value::Float(41.0);
            board.write("relay/input/value", &value, cycle.now).unwrap();
        }
        let answer = board.read("relay/output/value").unwrap();
        let done = answer.is_some_and(|(value, _)| value.as_f64() == Some(42.0)) || cycle.number > 2000;
        if done { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    assert_eq!(number(&agent, "relay/output/value"), 42.0);
}
