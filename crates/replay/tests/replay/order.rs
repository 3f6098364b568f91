//! Changes between the same two cycles are made again in their order, whichever thread or module made them.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::channel;

use slate_module::aspect::{Aspect, Settings};
use slate_module::prelude::*;
use slate_record::Recorder;
use slate_replay::{Plan, Verdict};
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::{Agent, NewLink, Options, RecordedTimes};

use crate::replay::repaired::verdict;
use crate::replay::support::{Number, file, play, plugins, times, values};

#[ports]
pub struct DriverIo {
    input: Input<Number>,
    wheel: Command<Number>,
}

/// Commands an actuator with what it reads.
pub struct Driver;

#[module(stage = Act)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &DriverIo, _: &(), _: &Tick) -> Outcome {
        io.wheel.send(io.input.get().copied().unwrap_or_default(), Priority::Plan);
        Outcome::Ok
    }
}

#[ports]
pub struct AskerIo {
    settings: Aspect<Settings>,
}

/// Requests other steps of the source: two in its fifth cycle, and one in its eighth.
pub struct Asker;

#[module(stage = Act)]
impl Module for Asker {
    type Io = AskerIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &AskerIo, _: &(), now: &Tick) -> Outcome {
        let steps: &[&str] = match now.number() {
            5 => &["3.0", "4.0"],
            8 => &["5.0"],
            _ => &[],
        };
        for step in steps {
            io.settings.change([&*format!("modules.source.params.step={step}")]);
        }
        Outcome::Ok
    }
}

const ROBOT: &str = r#"
[agent]
name = "robot"
[loop]
period = "10ms"
[log.targets]
console = false
[modules.source]
[modules.driver]
[modules.asker]
[modules.scale]
[links]
"driver/input" = "source/number"
[actuators.wheel]
command = "driver/wheel"
limits = { value = [-1000.0, 1000.0] }
[record]
enabled = true
"#;

/// Records it; `before` is called before the recording begins, and `at_end` at the end of each cycle, before each request of a
/// module and after the last, with the number of the cycle and of the call.
fn record(path: &Path, before: impl FnOnce(&Agent), mut at_end: impl FnMut(&Agent, usize, usize)) {
    let database = Database::from_text("robot.toml", ROBOT, Layers::default()).unwrap();
    let recorder = Recorder::new(database.current().record());
    let options = Options {
        time_source: Some(Box::new(RecordedTimes::new(times()))),
        recording: Some(Arc::new(recorder.clone())),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    recorder.note_content(&agent);
    before(&agent);
    recorder.begin(&agent, path);
    for cycle in 1..=times().len() {
        let mut call = 0;
        assert!(agent.step_with(|agent| {
            call += 1;
            at_end(agent, cycle, call);
        }));
    }
    recorder.end(&mut agent).unwrap();
}

fn is_made_again(path: &Path) {
    let verdict = verdict(path);
    assert!(matches!(verdict, Verdict::Identical { values: 100.., .. }), "{verdict:?}");
    let (_, outcome, _) = play(path, Plan { modules: ["source".into()].into(), ..Plan::default() });
    assert_eq!(outcome.unwrap().first, None);
}

fn set_step(agent: &Agent, step: &str) {
    agent.database().unwrap().set(&[("modules.source.params.step", step)]).unwrap();
}

#[test]
fn changes_of_several_threads_keep_their_order_in_a_rerun() {
    let path = file("order-threads.mcap");
    // As before the first cycle of a run: tools change the agent, and the recorder takes out nothing yet.
    let before = |agent: &Agent| {
        let composer = agent.composer();
        let (request, requests) = channel::<()>();
        let (done, stops) = channel();
        let other = composer.clone();
        let stopper = std::thread::spawn(move || {
            for () in requests {
                other.stop_actuators("the other thread");
                done.send(()).unwrap();
            }
        });
        let stop = || {
            request.send(()).unwrap();
            stops.recv().unwrap();
        };
        stop();
        composer.reset();
        assert!(composer.arm());
        stop();
        composer.reset();
        drop(request);
        stopper.join().unwrap();
    };
    record(&path, before, |_, _, _| {});
    let commands = values(&path, "/wheel/command");
    assert!(commands.len() > 10 && commands.iter().all(|own| own.2 == commands[0].2), "it is not armed");
    is_made_again(&path);
}

#[test]
fn changes_beside_those_that_modules_request_keep_their_order() {
    let path = file("order-requests.mcap");
    record(
        &path,
        |_| {},
        |agent, cycle, call| match (cycle, call) {
            (5, 1) => set_step(agent, "2.0"),
            (5, 2) => set_step(agent, "3.5"),
            (8, 1) => set_step(agent, "4.5"),
            (8, 2) => set_step(agent, "1.5"),
            _ => {}
        },
    );
    let written = values(&path, "/source/number");
    assert!(written.len() > 20, "{written:?}");
    is_made_again(&path);
}

#[test]
fn changes_between_two_cycles_are_made_again_one_by_one() {
    let path = file("order-alone.mcap");
    record(
        &path,
        |_| {},
        |agent, cycle, _| {
            if cycle == 12 {
                ["2.0", "3.0"].iter().for_each(|step| set_step(agent, step));
                agent.database().unwrap().set(&[("modules.source.params.first", "5.0")]).unwrap();
            }
        },
    );
    // That of the beginning, two requests and three changes, and one request more.
    assert_eq!(values(&path, "/source/params").len(), 1 + 3 + 3);
    is_made_again(&path);
}

#[test]
fn changes_before_the_recording_begins_are_made_again() {
    let path = file("order-before.mcap");
    let before = |agent: &Agent| {
        ["2.0", "3.0"].iter().for_each(|step| set_step(agent, step));
        agent.composer().link(&NewLink::new("scale/number", "source/number")).unwrap();
    };
    record(&path, before, |_, _, _| {});
    is_made_again(&path);
}
