//! A module that takes the main loop with stages of its own.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and a hang is a matter of the wall clock"
)]

mod common;

use std::time::{Duration, Instant};

use common::{configuration, number};
use slate_blackboard::Board;
use slate_module::aspect::{Aspect, LoopPlace, LoopStage, MainLoop, Policy};
use slate_module::prelude::*;
use slate_module::{Plugin, Stage};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{
    Agent, Composer, Control, End, LoopPolicy, Mode, Options, Place, Rate, Schedule, ScheduledStage,
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
            Some(after) if after == sense && place.cycle % 2 == 0 => Some(act),
            _ => None,
        }
    }
}

/// The stages one after the other.
struct InOrder;

impl Policy for InOrder {
    fn next(&mut self, place: &LoopPlace) -> Option<usize> {
        let next = place.after().map_or(0, |after| after + 1);
        (next < place.stage_count).then_some(next)
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
        io.has.set(common::Number { value: io.main_loop.has().into() });
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
            io.main_loop.take_order(NoAct);
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
        format!("[modules.{}]\nplugin = \"worker\"\nstage = \"{}\"\n", name(stage), stage.name())
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

#[test]
fn the_stages_of_a_module_hold_from_the_cycle_after_it_took_the_loop() {
    let (mut agent, log) = lockstep("take_at = 3");
    assert_eq!(ticks_in(&mut agent, 2), all(2));
    assert_eq!(shown(agent.board()), ten());
    assert_eq!(ticks_in(&mut agent, 1), all(1), "in this cycle it takes the loop");
    // The cycles 4 to 23: in the even ones it acts.
    assert_eq!(ticks_in(&mut agent, 20), halves(20, 10));
    assert_eq!(number(&agent, "director/has/value"), 1.0);
    agent.publish_timing();
    assert_eq!(shown(agent.board()), ["Act", "Sense"]);
    let said = lines(&log, "main loop");
    assert_eq!(said, ["director has the main loop, with the stages Sense, Act"]);
    // What is measured of a stage stays with its name.
    step(&mut agent, 200);
    agent.publish_timing();
    assert!(number(&agent, "loop/Sense/histogram/count") > number(&agent, "loop/Act/histogram/count"));
}

#[test]
fn the_stages_of_before_hold_from_the_next_cycle_on_when_the_module_has_the_loop_no_more() {
    for (how, said) in [
        ("give_at = 11", BACK),
        ("fail_at = 11", BACK),
        ("panic_at = 11", BACK),
        ("policy_panics_at = 11", "the policy of director panicked; it is asked no more"),
        ("policy_errs_at = 11", "the policy of director chose stage 7 of 2, from 0; it is asked no more"),
    ] {
        let (mut agent, log) = lockstep(how);
        step(&mut agent, 10);
        // Where nobody says which stage comes next, they follow one another.
        assert_eq!(ticks_in(&mut agent, 1), all(1), "{how}");
        assert_eq!(ticks_in(&mut agent, 20), all(20), "{how}");
        assert_eq!(shown(agent.board()), ten(), "{how}");
        assert_eq!(number(&agent, "director/has/value"), 0.0, "{how}");
        assert_eq!(lines(&log, said).len(), 1, "{how}: {:?}", lines(&log, "loop"));
        assert_eq!(lines(&log, BACK).len(), 1, "{how}");
        agent.publish_timing();
        let (count, _) = agent.board().read("loop/Think/histogram/count").unwrap().unwrap();
        assert!(count.as_f64() > Some(0.0), "what was measured before is still there");
    }
}

#[test]
fn a_module_that_is_switched_off_or_unloaded_leaves_the_stages_of_before() {
    for forgets in [0, 5] {
        let (mut agent, log) = lockstep(&format!("policy_forgets_at = {forgets}"));
        step(&mut agent, 10);
        agent.composer().enable("director", false).unwrap();
        // Also when its policy gives it no turn in which it would see it.
        step(&mut agent, 1);
        assert_eq!(ticks_in(&mut agent, 20), all(20));
        assert_eq!((shown(agent.board()), lines(&log, BACK).len()), (ten(), 1));
    }
    let (mut agent, log) = lockstep("");
    step(&mut agent, 10);
    agent.composer().unload("director").unwrap();
    assert_eq!(shown(agent.board()), ten());
    assert_eq!(ticks_in(&mut agent, 20), all(20));
    assert_eq!(lines(&log, BACK).len(), 1);
    // And again, afresh.
    agent.composer().load("director").unwrap();
    assert_eq!(ticks_in(&mut agent, 1), all(1));
    assert_eq!(ticks_in(&mut agent, 20), halves(20, 10));
    assert_eq!(shown(agent.board()), ["Act", "Sense"]);
}

#[test]
fn stages_that_are_none_are_refused_with_the_reason_and_nothing_changes() {
    let (mut agent, log) = lockstep("take_at = 0, refused_at = 2");
    assert_eq!(ticks_in(&mut agent, 20), all(20));
    assert_eq!((shown(agent.board()), number(&agent, "director/has/value")), (ten(), 0.0));
    let said = lines(&log, "refused: ");
    let name = "can't name a stage: expected up to 32 letters, digits and `_`";
    let expected = [
        "no stage of the loop runs the modules of PreLoop, SensorAcquire",
        "no stage of the loop runs the modules of ActExec, PostLoop",
        "two stages are named `All`",
        "the modules of Think would run both in `All` and in `Again`",
        name,
        name,
    ];
    assert_eq!(said.len(), expected.len());
    assert!(said.iter().zip(expected).all(|(said, expected)| said.contains(expected)), "{said:?}");
    // What it has meanwhile stays.
    let (mut agent, _) = lockstep("refused_at = 5");
    step(&mut agent, 10);
    assert_eq!(ticks_in(&mut agent, 20), halves(20, 10));
}

#[test]
fn a_module_may_take_the_loop_with_other_stages_and_with_an_order_alone() {
    let (mut agent, log) = lockstep("one_at = 11, order_at = 21, give_at = 31");
    step(&mut agent, 11);
    assert_eq!(ticks_in(&mut agent, 9), all(9));
    assert_eq!(shown(agent.board()), ["One"]);
    step(&mut agent, 1);
    assert_eq!(ticks_in(&mut agent, 9), halves(9, 0));
    assert_eq!(shown(agent.board()), ten());
    step(&mut agent, 1);
    assert_eq!(ticks_in(&mut agent, 9), all(9));
    let said = lines(&log, "director has");
    assert_eq!(said.len(), 4, "{said:?}");
    assert_eq!(said[1], "director has the main loop, with the stages One");
    assert_eq!(said[2], "director has the main loop, and says which stage comes next");
}

#[test]
fn who_waits_for_all_stages_waits_for_those_that_the_loop_has() {
    let (mut agent, _) = lockstep("take_at = 0, one_at = 3, give_at = 6");
    let stages = agent.synchronization().point("/stage").unwrap();
    let think = agent.synchronization().point("/stage/Think/end").unwrap();
    for cycle in 1..=10 {
        let (all, one) = (stages.mark(), think.count());
        step(&mut agent, 1);
        stages.wait_all(&all, Duration::ZERO).unwrap();
        // In the cycles 4 to 6 another stage has its modules.
        assert_eq!(think.count() > one, !(4..=6).contains(&cycle), "{cycle}");
    }
}

/// Leaves out the stage `Late`.
struct NotLate;

impl LoopPolicy for NotLate {
    fn next(&mut self, place: &Place<'_>) -> Option<usize> {
        place.after.is_none().then(|| place.find("Early").unwrap_or_default())
    }
}

#[test]
fn the_stages_and_the_policy_that_the_program_sets_meanwhile_are_those_that_come_back() {
    let (mut agent, _) = lockstep("give_at = 21");
    step(&mut agent, 10);
    let scheduled = |name: &str, members: &[Stage]| ScheduledStage {
        name: name.into(),
        members: members.into(),
        timeout: None,
    };
    let (early, late) = Stage::ALL.split_at(2);
    let schedule = Schedule::new(vec![scheduled("Early", early), scheduled("Late", late)]).unwrap();
    agent.composer().set_schedule(schedule);
    agent.composer().set_policy(Some(Box::new(NotLate)));
    assert_eq!(ticks_in(&mut agent, 10), halves(10, 5));
    assert_eq!(shown(agent.board()), ["Act", "Sense"]);
    step(&mut agent, 1);
    let expected = std::array::from_fn(|stage| if stage < 2 { 10 } else { 0 });
    assert_eq!(ticks_in(&mut agent, 10), expected);
    assert_eq!(shown(agent.board()), ["Early", "Late"]);
    agent.composer().set_policy(None);
    assert_eq!(ticks_in(&mut agent, 10), all(10));
}

#[test]
fn modules_come_and_go_while_a_module_has_the_loop() {
    let (mut agent, _) = lockstep("give_at = 31");
    step(&mut agent, 10);
    agent.composer().unload("worker").unwrap_err(); // One of them is the clock.
    let before = agent.counts("think").unwrap().0;
    agent.composer().enable("think", false).unwrap();
    step(&mut agent, 10);
    assert_eq!(agent.counts("think").unwrap().0, before);
    agent.composer().enable("think", true).unwrap();
    assert_eq!(ticks_in(&mut agent, 10), halves(10, 5));
    step(&mut agent, 1);
    assert_eq!(ticks_in(&mut agent, 10), all(10));
}

#[test]
fn of_two_modules_that_want_the_loop_one_is_refused() {
    let text = "[modules.a]\nplugin = \"director\"\n[modules.b]\nplugin = \"director\"\n";
    let Err(StartError::Configuration(report)) = load(text, Mode::Staged, Rate::Max) else {
        panic!("two modules can't have the loop");
    };
    assert!(report.to_string().contains("`a` and `b` both want the main loop"), "{report}");
}

#[test]
fn in_lockstep_the_stages_take_hold_in_the_same_cycle_in_each_run() {
    let run = |workers: usize| {
        let log = MemoryTarget::default();
        let text = format!(
            "time.source = \"preloop\"\n[modules.director]\nparams = {{ take_at = 3, one_at = 11, give_at = 21 }}\n{}",
            self::workers()
        );
        let options = Options {
            rate: Rate::Max,
            workers,
            always_help: workers > 0,
            log: vec![Box::new(log.clone())],
            ..Options::default()
        };
        let plugins = [Plugin::linked::<Director>(), Plugin::linked::<Worker>()];
        let mut agent = Agent::load(&configuration(&text), &plugins, options).unwrap();
        step(&mut agent, 30);
        let lines = log.lines().into_iter().filter(|line| line.text.contains("main loop"));
        (lines.map(|line| (line.time, line.text)).collect::<Vec<_>>(), agent.digest())
    };
    let first = run(0);
    assert_eq!(first.0.iter().map(|(time, _)| time / 20_000_000).collect::<Vec<_>>(), [3, 11, 21]);
    for workers in [0, 0, 2] {
        assert_eq!(run(workers), first);
    }
}

/// Waits for what comes soon.
#[track_caller]
fn until(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(30), "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// An agent that runs beside a test.
struct Beside {
    composer: Composer,
    log: MemoryTarget,
    stopper: Stopper,
}

impl Drop for Beside {
    fn drop(&mut self) {
        self.stopper.stop();
    }
}

impl Beside {
    fn until_shown(&self, stages: &[String]) {
        until("stages", || self::shown(self.composer.board()) == stages);
    }

    /// Lets the director do that in a tick that comes soon.
    fn soon(&self, what: &str) {
        let modules = self.composer.modules();
        let ticks = modules.iter().find(|module| module.name == "director").unwrap().ticks;
        let path = format!("director/params/{what}");
        let when = slate_blackboard::interface::Value::Integer(i128::from(ticks) + 50);
        self.composer.board().write(&path, &when, self.composer.now()).unwrap();
    }

    fn until_said(&self, part: &str) {
        until(part, || !lines(&self.log, part).is_empty());
    }
}

/// On the wall clock: looks at an agent with that director while it runs. No other module misses a cycle.
fn running(director: &str, mode: Mode, look: impl FnOnce(&Beside)) {
    let text =
        format!("loop.period = \"1ms\"\nloop.hang = \"50ms\"\n[modules.director]\n{director}\n{}", workers());
    let (mut agent, log) = load(&text, mode, Options::default().rate).unwrap();
    let beside = Beside { composer: agent.composer(), log, stopper: agent.stopper() };
    let run = std::thread::spawn(move || {
        let end = agent.run(Box::new(|_| Control::Continue));
        (agent, end.unwrap())
    });
    beside.until_said("director has the main loop");
    look(&beside);
    drop(beside);
    let (agent, end) = run.join().unwrap();
    assert_eq!(end, End::Stopped);
    let cycles = number(&agent, "loop/state/cycles");
    for stage in &Stage::ALL[..5] {
        assert_eq!(agent.counts(&name(*stage)).unwrap().0 as f64, cycles, "{}", stage.name());
    }
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

#[test]
fn on_the_wall_clock_the_stages_hold_some_cycles_later_and_no_module_misses_one() {
    running("", Mode::Staged, |agent| {
        agent.until_shown(&owned(&["Act", "Sense"]));
        assert_eq!(lines(&agent.log, "director has").len(), 1);
        agent.composer.enable("director", false).unwrap();
        agent.until_said(BACK);
        agent.until_shown(&ten());
    });
}

#[test]
fn a_module_or_a_policy_that_hangs_has_the_loop_no_more_and_may_take_it_again_when_it_has_returned() {
    for (how, said) in [
        ("", "director has not returned"),
        ("params.policy_hangs_at = 50", "the policy of a module did not return"),
    ] {
        // It would have a thread of its own, if it were not to be watched in the loop.
        for (mode, trigger) in [(Mode::Staged, ""), (Mode::Threaded, "every = \"1ms\"\n")] {
            running(&format!("{trigger}{how}"), mode, |agent| {
                if how.is_empty() {
                    agent.soon("hang_at");
                }
                agent.until_said(said);
                agent.until_said(BACK);
                agent.until_shown(&ten());
                agent.until_said("director returned after");
                agent.soon("one_at");
                agent.until_said("director has the main loop, with the stages One");
                agent.until_shown(&owned(&["One"]));
                let records = agent.log.lines();
                let time = |part| records.iter().find(|record| record.text.contains(part)).unwrap().time;
                let ahead = Duration::from_nanos(time("director returned after") - time(BACK));
                assert!(ahead > Duration::from_millis(100), "not only when it returned: {ahead:?}");
            });
        }
    }
}

#[test]
fn the_loop_is_taken_and_given_back_while_the_program_changes_it_too() {
    running("params.churn = 10", Mode::Staged, |agent| {
        let cycles = || lines(&agent.log, "director has the main loop,").len();
        let mut round = 0_u64;
        until("rounds", || {
            round += 1;
            let scheduled = ScheduledStage {
                name: format!("All{}", round % 3),
                members: Stage::ALL.to_vec(),
                timeout: Some(Duration::from_secs(1)),
            };
            agent.composer.set_schedule(Schedule::new(vec![scheduled]).unwrap());
            agent.composer.enable("think", round % 2 == 0).unwrap();
            // It is taken between two cycles, too.
            agent.composer.snapshot().unwrap();
            cycles() >= 20 && round >= 50
        });
        agent.composer.set_schedule(Schedule::default());
        agent.composer.unload("director").unwrap();
        agent.until_shown(&ten());
    });
}
