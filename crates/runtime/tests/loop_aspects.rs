//! A module that has the main loop, and one that has the clock.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{Counter, Relay, complaint, configuration, number};
use slate_module::aspect::{Aspect, LoopPlace, MainLoop, Policy, TimeSource};
use slate_module::prelude::*;
use slate_module::{ModuleKind, Plugin};
use slate_runtime::{Agent, Options, PluginError, Rate, StartError};

/// Ports of [`Conductor`].
#[ports]
pub struct ConductorIo {
    main_loop: Aspect<MainLoop>,
    has: Output<common::Number>,
}

/// How the [`Conductor`] conducts.
#[params]
pub struct ConductorParams {
    #[param(default = 1, doc = "the tick in which it takes the loop")]
    take_at: u64,
    #[param(default = 0, doc = "the tick in which it gives the loop back")]
    give_at: u64,
    #[param(default = 0, doc = "the tick in which it fails")]
    fail_at: u64,
    #[param(default = 0, doc = "the cycle in which its policy panics")]
    panic_at: u64,
}

/// Leaves the stage SensorProcess out in odd cycles.
pub struct Conductor;

struct Halving {
    panic_at: u64,
}

impl Policy for Halving {
    fn next(&mut self, place: &LoopPlace) -> Option<usize> {
        assert!(place.cycle != self.panic_at, "as the test wants");
        let mut next = place.after().map_or(0, |after| after + 1);
        if place.cycle % 2 == 1 && Some(next) == place.find("SensorProcess") {
            next += 1;
        }
        (next < place.stage_count()).then_some(next)
    }
}

#[module(stage = PreLoop)]
impl Module for Conductor {
    type Io = ConductorIo;
    type Params = ConductorParams;
    type State = ();

    fn tick(_: &mut (), io: &ConductorIo, params: &ConductorParams, now: &Tick) -> Outcome {
        if now.number() == params.take_at {
            io.main_loop.take_with_policy(Halving { panic_at: params.panic_at });
        }
        if now.number() == params.give_at {
            io.main_loop.give_back();
        }
        io.has.set(common::Number { value: io.main_loop.is_held().into() });
        if now.number() == params.fail_at { Outcome::Failed } else { Outcome::Ok }
    }
}

fn plugins() -> Vec<Plugin> {
    vec![
        Plugin::linked::<Counter>(),
        Plugin::new("relays", [ModuleKind::linked::<Relay>()]),
        Plugin::linked::<Conductor>(),
        Plugin::linked::<Metronome>(),
    ]
}

fn agent(conductor: &str) -> Agent {
    let text = format!(
        "time.source = \"counter\"\n[modules.counter]\n[modules.relay]\n{conductor}\n[links]\n\"relay/input\" = \"counter/number\"\n"
    );
    let options = Options { rate: Rate::Max, ..Options::default() };
    Agent::load(&configuration(&text), &plugins(), options).unwrap()
}

fn ticks(agent: &Agent, module: &str) -> u64 {
    agent.counts(module).unwrap().0
}

fn step(agent: &mut Agent, cycles: u64) {
    (0..cycles).for_each(|_| assert!(agent.step()));
}

#[test]
fn a_module_chooses_the_next_stage_from_the_next_cycle() {
    let mut agent = agent("[modules.conductor]");
    step(&mut agent, 41);
    // It takes the loop in cycle 1, and of cycles 2 to 41 the even ones have the stage.
    assert_eq!(ticks(&agent, "counter"), 41);
    assert!((20..=22).contains(&ticks(&agent, "relay")), "{}", ticks(&agent, "relay"));
    assert_eq!(number(&agent, "conductor/has/value"), 1.0);
}

#[test]
fn the_stages_follow_each_other_after_the_loop_is_released() {
    for how in ["params = { give_at = 11 }", "params = { fail_at = 11 }", "params = { panic_at = 11 }"] {
        let mut agent = agent(&format!("[modules.conductor]\n{how}"));
        step(&mut agent, 20);
        let before = ticks(&agent, "relay");
        step(&mut agent, 20);
        assert_eq!(ticks(&agent, "relay"), before + 20, "{how}");
        assert_eq!(number(&agent, "conductor/has/value"), 0.0, "{how}");
    }
}

#[test]
fn a_module_switched_off_or_unloaded_loses_the_loop() {
    let mut agent = agent("[modules.conductor]");
    step(&mut agent, 20);
    agent.composer().enable("conductor", false).unwrap();
    step(&mut agent, 2);
    let before = ticks(&agent, "relay");
    step(&mut agent, 20);
    assert_eq!(ticks(&agent, "relay"), before + 20);

    let mut agent = self::agent("[modules.conductor]");
    step(&mut agent, 20);
    agent.composer().unload("conductor").unwrap();
    let before = ticks(&agent, "relay");
    step(&mut agent, 20);
    assert_eq!(ticks(&agent, "relay"), before + 20);
    // What is linked into the program can come again, afresh.
    agent.composer().load("conductor").unwrap();
    let before = ticks(&agent, "relay");
    step(&mut agent, 20);
    assert!((9..=12).contains(&(ticks(&agent, "relay") - before)));
}

#[test]
fn one_module_has_the_loop() {
    let text = "[modules.a]\nkind = \"conductor\"\n[modules.b]\nkind = \"conductor\"\n";
    let Err(StartError::Configuration(report)) =
        Agent::load(&configuration(text), &plugins(), Options::default())
    else {
        panic!("two modules can't have the loop");
    };
    let text = report.to_string();
    assert!(text.contains("`a` and `b` both want the main loop"), "{text}");
}

/// Ports of [`Metronome`].
#[ports]
pub struct MetronomeIo {
    time: Aspect<TimeSource>,
    refused: Output<common::Number>,
}

/// Every cycle lies 7 ms after the one before, and once it tries to go back.
pub struct Metronome;

#[module(stage = PreLoop)]
impl Module for Metronome {
    type Io = MetronomeIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &MetronomeIo, _: &(), now: &Tick) -> Outcome {
        if now.number() == 5 {
            let back = io.time.set_next(now.now() - 1);
            io.refused.set(common::Number { value: (!back).into() });
        } else {
            assert!(io.time.set_next(now.now() + 7_000_000));
        }
        Outcome::Ok
    }
}

#[test]
fn a_module_says_what_time_the_next_cycle_has() {
    let text =
        "time.source = \"metronome\"\nloop.period = \"20ms\"\n[modules.metronome]\n[modules.counter]\n";
    let options = Options { rate: Rate::Max, ..Options::default() };
    let mut agent = Agent::load(&configuration(text), &plugins(), options).unwrap();
    let start = {
        step(&mut agent, 1);
        agent.now()
    };
    step(&mut agent, 4);
    assert_eq!(agent.now(), start + 4 * 7_000_000);
    // In its fifth tick it was refused to go back, so the next cycle is a period later.
    step(&mut agent, 1);
    assert_eq!(number(&agent, "metronome/refused/value"), 1.0);
    assert_eq!(agent.now(), start + 4 * 7_000_000 + 20_000_000);
    let refused = agent.composer().unload("metronome").unwrap_err();
    assert!(matches!(refused, PluginError::TimeSource { .. }), "{refused}");
}

#[test]
fn only_the_time_source_sets_the_time() {
    let text = "[modules.metronome]\n[modules.counter]\n";
    let Err(StartError::Configuration(report)) =
        Agent::load(&configuration(text), &plugins(), Options::default())
    else {
        panic!("it is not the time source");
    };
    assert!(report.to_string().contains("is not the time source"), "{report}");
    // Without it nothing is wrong.
    assert!(complaint("[modules.nothing]\n").contains("nothing"));
}
