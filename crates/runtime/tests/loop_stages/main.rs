//! A module that takes the main loop with stages of its own.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and a hang is a matter of the wall clock"
)]

use crate::common;
mod lockstep;
mod wall_clock;

use std::time::{Duration, Instant};

use common::{configuration, number};
use slate_blackboard::Board;
use slate_module::aspect::{Aspect, LoopPlace, LoopStage, MainLoop, Policy};
use slate_module::prelude::*;
use slate_module::{Plugin, Stage};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{
    Agent, Composer, Control, End, LoopPolicy, LoopPosition, Mode, Options, Rate, Schedule, ScheduledStage,
    StartError, Stopper,
};

/// Ports of [`Director`].
#[ports]
pub struct DirectorIo {
    main_loop: Aspect<MainLoop>,
    has: Output<common::Number>,
}

/// What the [`Director`] does in which tick or, in its policy, in which cycle; 0 for never.
#[params]
pub struct DirectorParams {
    #[param(default = 1, doc = "takes the loop")]
    take_at: u64,
    #[param(default = 0, doc = "takes it anew, with one stage")]
    one_at: u64,
    #[param(default = 0, doc = "takes it with an order of the stages that are there")]
    order_at: u64,
    #[param(default = 0, doc = "asks for stages that are refused")]
    refused_at: u64,
    #[param(default = 0, doc = "gives it back")]
    give_at: u64,
    #[param(default = 0, doc = "fails")]
    fail_at: u64,
    #[param(default = 0, doc = "panics")]
    panic_at: u64,
    #[param(default = 0, doc = "does not return for 400 ms")]
    hang_at: u64,
    #[param(default = 0, doc = "the policy panics")]
    policy_panics_at: u64,
    #[param(default = 0, doc = "the policy chooses a stage that is not there")]
    policy_errs_at: u64,
    #[param(
        default = 0,
        doc = "the policy does not return for 400 ms in the cycle with that number of its own"
    )]
    policy_hangs_at: u64,
    #[param(default = 0, doc = "the policy leaves this module's stage out from there on")]
    policy_forgets_at: u64,
    #[param(default = 0, doc = "takes it and gives it back by turns, after so many ticks each")]
    churn: u64,
}

/// Takes the loop with two stages, and acts in every second cycle.
pub struct Director;

struct EverySecond {
    params: DirectorParams,
    cycles: u64,
}

impl Policy for EverySecond {
    fn next(&mut self, place: &LoopPlace) -> Option<usize> {
        let params = &self.params;
        assert!(place.cycle != params.policy_panics_at, "as the test wants");
        if place.cycle == params.policy_errs_at {
            return Some(7);
        }
        if place.after().is_none() {
            self.cycles += 1;
            if self.cycles == params.policy_hangs_at {
                std::thread::sleep(Duration::from_millis(400));
            }
        }
        let forgets = params.policy_forgets_at != 0 && place.cycle >= params.policy_forgets_at;
        let (sense, act) = (place.find("Sense").unwrap(), place.find("Act").unwrap());
        match place.after() {
            None if forgets => Some(act),
            None => Some(sense),
            Some(after) if after == sense && place.cycle.is_multiple_of(2) => Some(act),
            _ => None,
        }
    }
}

/// The stages one after the other.
struct InOrder;

impl Policy for InOrder {
    fn next(&mut self, place: &LoopPlace) -> Option<usize> {
        let next = place.after().map_or(0, |after| after + 1);
        (next < place.stage_count()).then_some(next)
    }
}

/// Ends the cycle after the stage `WorldState`.
struct NoAct;

impl Policy for NoAct {
    fn next(&mut self, place: &LoopPlace) -> Option<usize> {
        let next = place.after().map_or(0, |after| after + 1);
        (next <= place.find("WorldState").unwrap()).then_some(next)
    }
}

fn stage<'a>(name: &'a str, members: &'a [Stage]) -> LoopStage<'a> {
    LoopStage { name, members, timeout: None }
}

/// Asks for what is no loop, and passes the reasons on.
fn ask_for_nonsense(main_loop: &MainLoop, now: &Tick) {
    let all = &Stage::ALL[..];
    let x = "x".repeat(33);
    for stages in [
        vec![],
        vec![stage("Some", &all[..8])],
        vec![stage("All", all), stage("All", &[])],
        vec![stage("All", all), stage("Again", &[Stage::Think])],
        vec![stage("state", all)],
        vec![stage(&x, all)],
    ] {
        let refusal = main_loop.take(&stages, InOrder).unwrap_err();
        now.warn(format_args!("refused: {refusal}"));
    }
}

#[module(stage = PreLoop)]
impl Module for Director {
    type Io = DirectorIo;
    type Params = DirectorParams;
    type State = ();

    fn tick(_: &mut (), io: &DirectorIo, params: &DirectorParams, now: &Tick) -> Outcome {
        let tick = now.number();
        io.has.set(common::Number { value: io.main_loop.is_held().into() });
        if tick == params.refused_at {
            ask_for_nonsense(&io.main_loop, now);
        }
        if tick == params.take_at {
            let (sense, act) = Stage::ALL.split_at(5);
            io.main_loop
                .take(&[stage("Sense", sense), stage("Act", act)], EverySecond { params: *params, cycles: 0 })
                .unwrap();
        }
        if params.churn > 0 && tick.is_multiple_of(params.churn) {
            match tick / params.churn % 2 {
                0 => io.main_loop.take(&[stage("One", &Stage::ALL)], InOrder).unwrap(),
                _ => io.main_loop.give_back(),
            }
        }
        if tick == params.one_at {
            io.main_loop.take(&[stage("One", &Stage::ALL)], InOrder).unwrap();
        }
        if tick == params.order_at {
            io.main_loop.take_with_policy(NoAct);
        }
        if tick == params.give_at {
            io.main_loop.give_back();
        }
        if tick == params.hang_at {
            std::thread::sleep(Duration::from_millis(400));
        }
        assert!(tick != params.panic_at, "as the test wants");
        if tick == params.fail_at { Outcome::Failed } else { Outcome::Ok }
    }
}

/// A module of each stage.
pub struct Worker;

#[module(stage = Think)]
impl Module for Worker {
    type Io = ();
    type Params = ();
    type State = ();

    fn tick(_: &mut (), (): &(), (): &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

/// The name of the module of a stage.
fn name(stage: Stage) -> String {
    stage.name().to_lowercase()
}

fn workers() -> String {
    let module = |stage: Stage| {
        format!("[modules.{}]\nkind = \"worker\"\nstage = \"{}\"\n", name(stage), stage.name())
    };
    Stage::ALL.map(module).concat()
}

fn load(text: &str, mode: Mode, rate: Rate) -> Result<(Agent, MemoryTarget), StartError> {
    let log = MemoryTarget::default();
    let options = Options { rate, mode, log: vec![Box::new(log.clone())], ..Options::default() };
    let plugins = [Plugin::linked::<Director>(), Plugin::linked::<Worker>()];
    Ok((Agent::load(&configuration(text), &plugins, options)?, log))
}

/// In lockstep, with a director of those parameters.
fn lockstep(params: &str) -> (Agent, MemoryTarget) {
    let text =
        format!("time.source = \"preloop\"\n[modules.director]\nparams = {{ {params} }}\n{}", workers());
    load(&text, Mode::Staged, Rate::Max).unwrap()
}

/// So many cycles, and all that is logged in them.
fn step(agent: &mut Agent, cycles: u64) {
    let mut left = cycles;
    let end = agent.run(Box::new(move |_| {
        left -= 1;
        if left == 0 { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
}

/// How often the modules of each stage run in so many cycles.
fn ticks_in(agent: &mut Agent, cycles: u64) -> [u64; 10] {
    let ticks = |agent: &Agent| Stage::ALL.map(|stage| agent.counts(&name(stage)).unwrap().0);
    let before = ticks(agent);
    step(agent, cycles);
    let after = ticks(agent);
    std::array::from_fn(|stage| after[stage] - before[stage])
}

fn all(cycles: u64) -> [u64; 10] {
    [cycles; 10]
}

/// Those of `Sense` and those of `Act`.
fn halves(sense: u64, act: u64) -> [u64; 10] {
    std::array::from_fn(|stage| if stage < 5 { sense } else { act })
}

/// The stages that the board shows.
fn shown(board: &Board) -> Vec<String> {
    let properties = board.properties();
    let names = properties.iter().filter_map(|property| {
        Some(property.path().strip_prefix("loop/")?.strip_suffix("/histogram")?.to_owned())
    });
    let mut names: Vec<_> = names.collect();
    names.sort();
    names
}

fn ten() -> Vec<String> {
    let mut names = Stage::ALL.map(|stage| stage.name().to_owned()).to_vec();
    names.sort();
    names
}

fn lines(log: &MemoryTarget, part: &str) -> Vec<String> {
    log.lines().into_iter().map(|line| line.text).filter(|text| text.contains(part)).collect()
}

const BACK: &str = "director has the main loop no more; from now on its stages are PreLoop, SensorAcquire";
