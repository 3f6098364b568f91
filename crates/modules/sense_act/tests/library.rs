//! The library, loaded into an agent that runs.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and an agent on the wall clock is waited for"
)]

use std::path::PathBuf;
use std::time::{Duration, Instant};

use slate_module::aspect::{Aspect, MainLoop};
use slate_module::blackboard::Board;
use slate_module::blackboard::interface::Value;
use slate_module::prelude::*;
use slate_module::{Plugin, Stage};
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Composer, Control, End, Options, Rate, StartError};
use slate_sense_act::SenseAct;

/// The library as it was built for this test.
fn library() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let file = test.with_file_name("libslate_sense_act.so");
    assert!(file.is_file(), "{} is not there", file.display());
    file
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

/// Ports of [`Greedy`].
#[ports]
pub struct GreedyIo {
    main_loop: Aspect<MainLoop>,
}

/// May take the loop, too.
pub struct Greedy;

#[module(stage = PreLoop)]
impl Module for Greedy {
    type Io = GreedyIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &GreedyIo, (): &(), _: &Tick) -> Outcome {
        if io.main_loop.is_held() { Outcome::Failed } else { Outcome::Ok }
    }
}

/// The name of the module of a stage.
fn name(stage: Stage) -> String {
    stage.name().to_lowercase()
}

fn load(text: &str, rate: Rate) -> (Agent, MemoryTarget) {
    try_load(text, rate).unwrap()
}

fn try_load(text: &str, rate: Rate) -> Result<(Agent, MemoryTarget), StartError> {
    let module = |stage: Stage| {
        format!("[modules.{}]\nkind = \"worker\"\nstage = \"{}\"\n", name(stage), stage.name())
    };
    let text = format!("{text}\n{}", Stage::ALL.map(module).concat());
    let configuration =
        Configuration::from_text("test.toml", &text, &configuration::Options::default()).unwrap();
    let log = MemoryTarget::default();
    let options = Options { rate, log: vec![Box::new(log.clone())], ..Options::default() };
    let plugins = [Plugin::linked::<Worker>(), Plugin::linked::<Greedy>(), Plugin::linked::<SenseAct>()];
    // What is linked in and not in the configuration has no module, and so leaves the name to the library.
    let linked = if text.contains("[modules.sense_act]") { &plugins[..] } else { &plugins[..2] };
    Ok((Agent::load(&configuration, linked, options)?, log))
}

/// In lockstep, as fast as it goes.
fn lockstep(text: &str) -> (Agent, MemoryTarget) {
    load(&format!("time.source = \"preloop\"\n{text}"), Rate::Max)
}

/// How often the modules of each stage run in so many cycles.
fn ticks_in(agent: &mut Agent, cycles: u64) -> [u64; 10] {
    let ticks = |agent: &Agent| Stage::ALL.map(|stage| agent.counts(&name(stage)).unwrap().0);
    let before = ticks(agent);
    (0..cycles).for_each(|_| assert!(agent.step()));
    let after = ticks(agent);
    std::array::from_fn(|stage| after[stage] - before[stage])
}

/// Those of `Sense` and those of `Act`.
fn halves(sense: u64, act: u64) -> [u64; 10] {
    std::array::from_fn(|stage| if stage < 5 { sense } else { act })
}

/// The stages that the board shows, each with how often it was measured.
fn stages(board: &Board) -> Vec<(String, u64)> {
    let properties = board.properties();
    let names = properties.iter().filter_map(|property| {
        let stage = property.path().strip_prefix("loop/")?.strip_suffix("/histogram")?;
        let count = board.read(&format!("{}/count", property.path())).ok().flatten();
        Some((stage.to_owned(), count.and_then(|(count, _)| count.as_f64()).unwrap_or(0.0) as u64))
    });
    let mut stages: Vec<_> = names.collect();
    stages.sort();
    stages
}

fn names(board: &Board) -> Vec<String> {
    stages(board).into_iter().map(|(name, _)| name).collect()
}

fn ten() -> Vec<String> {
    let mut names = Stage::ALL.map(|stage| stage.name().to_owned()).to_vec();
    names.sort();
    names
}

fn set_every(composer: &Composer, every: i128) {
    composer.board().write("sense_act/params/every", &Value::Integer(every), composer.now()).unwrap();
}

#[track_caller]
fn until(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(30), "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn the_library_brings_two_stages_and_unloading_restores_ten() {
    let (mut agent, log) = load("loop.period = \"1ms\"\n", Rate::REALTIME);
    let (composer, stopper) = (agent.composer(), agent.stopper());
    let user = std::thread::spawn(move || {
        let board = composer.board();
        let ticks = |module: &str| {
            let modules = composer.modules();
            modules.iter().find(|known| known.name == module).map(|known| known.ticks)
        };
        until("the ten stages", || stages(board).iter().all(|(_, count)| *count > 0));
        let loaded = composer.load_library(&library()).unwrap();
        assert_eq!(loaded.modules, ["sense_act"]);
        until("two stages", || {
            names(board) == ["Act", "Sense"]
                && stages(board).iter().all(|(name, count)| name == "Act" || *count > 0)
        });
        set_every(&composer, 1_000_000);
        // The last cycle in which it acted is over when the next ones have sensed.
        let sensed = ticks("worldstate").unwrap();
        until("cycles", || ticks("worldstate").unwrap() > sensed + 5);
        let (sensed, acted) = (ticks("worldstate").unwrap(), ticks("think").unwrap());
        until("cycles", || ticks("worldstate").unwrap() > sensed + 50);
        let acted = ticks("think").unwrap() - acted;
        composer.reload("slate-sense-act", None).unwrap();
        until("two stages again", || names(board) == ["Act", "Sense"]);
        let libraries = composer.unload("slate-sense-act").unwrap();
        assert_eq!(names(board), ten());
        let before = ticks("think").unwrap();
        until("the ten stages again", || ticks("think").unwrap() > before + 20);
        stopper.stop();
        (acted, libraries)
    });
    assert_eq!(agent.run(Box::new(|_| Control::Continue)).unwrap(), End::Stopped);
    let (acted, libraries) = user.join().unwrap();
    assert!(acted <= 1, "it acts in one of a million cycles: {acted}");
    assert_eq!(libraries[0].0, "slate-sense-act");
    let cycles = agent.board().read("loop/state/cycles").unwrap().unwrap().0.as_f64().unwrap();
    for stage in &Stage::ALL[..5] {
        assert_eq!(agent.counts(&name(*stage)).unwrap().0 as f64, cycles, "{} misses no cycle", stage.name());
    }
    let lines: Vec<_> = log.lines().into_iter().map(|line| line.text).collect();
    let has = "sense_act has the main loop, with the stages Sense, Act";
    let back = "sense_act has the main loop no more; from now on its stages are PreLoop, SensorAcquire";
    assert_eq!(lines.iter().filter(|line| *line == has).count(), 2, "{lines:#?}");
    assert_eq!(lines.iter().filter(|line| line.starts_with(back)).count(), 2, "{lines:#?}");
}

#[test]
fn it_acts_in_one_of_as_many_cycles_as_its_parameter_says() {
    for linked in [true, false] {
        let (mut agent, _) = lockstep(if linked { "[modules.sense_act]\nparams.every = 3\n" } else { "" });
        let composer = agent.composer();
        if !linked {
            composer.load_library(&library()).unwrap();
            set_every(&composer, 3);
        }
        // In the first cycle it takes the loop.
        assert_eq!(ticks_in(&mut agent, 1), halves(1, 1));
        assert_eq!(ticks_in(&mut agent, 11), halves(11, 4), "in the cycles 3, 6, 9 and 12");
        set_every(&composer, 5);
        assert_eq!(ticks_in(&mut agent, 13), halves(13, 3), "in the cycles 15, 20 and 25");
        set_every(&composer, 0);
        assert_eq!(ticks_in(&mut agent, 10), halves(10, 10), "there is no less than one");
        assert_eq!(names(agent.board()), ["Act", "Sense"]);
    }
}

#[test]
fn a_parameter_that_makes_no_sense_is_refused() {
    let text = "[modules.sense_act]\nparams.every = 0\n";
    let Err(StartError::Configuration(report)) = try_load(text, Rate::Max) else {
        panic!("it is not a number of cycles")
    };
    assert!(report.to_string().contains("is 0, outside 1 to 1000000"), "{report}");
}

#[test]
fn after_a_reload_it_owns_the_loop_from_the_second_cycle() {
    let (mut agent, _) = lockstep("");
    let composer = agent.composer();
    composer.load_library(&library()).unwrap();
    set_every(&composer, 1000);
    assert_eq!(ticks_in(&mut agent, 10), halves(10, 1));
    let reload = composer.reload("slate-sense-act", None).unwrap();
    assert!(reload.in_place && reload.modules[0].1.is_ok(), "{reload:?}");
    assert_eq!(
        ticks_in(&mut agent, 1),
        halves(1, 1),
        "the stages of before, as the old code has the loop no more"
    );
    assert_eq!(ticks_in(&mut agent, 10), halves(10, 0));
}

#[test]
fn it_is_refused_while_another_module_may_take_the_loop() {
    let (mut agent, _) = lockstep("[modules.greedy]\n");
    let refused = agent.composer().load_library(&library()).unwrap_err().to_string();
    assert!(refused.contains("`greedy` and `sense_act` both want the main loop"), "{refused}");
    assert_eq!(ticks_in(&mut agent, 10), halves(10, 10));
    agent.composer().unload("greedy").unwrap();
    agent.composer().load_library(&library()).unwrap();
    assert_eq!(names(agent.board()), ten());
    assert_eq!(ticks_in(&mut agent, 10), halves(10, 10));
    assert_eq!(names(agent.board()), ["Act", "Sense"]);
}
