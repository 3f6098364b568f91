//! Values that programs outside of an agent send to its inputs.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use slate_blackboard::interface::Value;
use slate_record::Recorder;
use slate_replay::{Plan, Verdict};
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::{
    Agent, Composer, Control, Cycle, End, ExternalContent, ExternalPorts, ExternalValue, Options,
    RecordedTimes,
};

use crate::replay::repaired::verdict;
use crate::replay::support::{ROBOT, file, play, plugins, times, values};

/// Nothing of the robot fills this input.
fn robot() -> String {
    ROBOT.replace("\"front/other\" = { from = \"back/sum\", previous = true }\n", "")
}

const INPUT: &str = "front/other";

fn external(value: f64) -> ExternalValue {
    let bytes = value.to_ne_bytes().to_vec();
    ExternalValue { input: INPUT.into(), content: ExternalContent::Bytes(bytes) }
}

fn set(composer: &Composer, values: &[f64]) {
    let results = composer.set_external(values.iter().copied().map(external).collect());
    assert!(results.len() == values.len() && results.iter().all(Result::is_ok), "{results:?}");
}

/// A robot, as it begins to be recorded, with inputs that have a source outside.
fn begun(path: &Path, text: &str, declared: &[(&str, &str)]) -> (Agent, Recorder) {
    let database = Database::from_text("robot.toml", text, Layers::default()).unwrap();
    let recorder = Recorder::new(database.current().record());
    let options = Options {
        time_source: Some(Box::new(RecordedTimes::new(times()))),
        recording: Some(Arc::new(recorder.clone())),
        ..Options::default()
    };
    let agent = Agent::load_with(&database, &plugins(), options).unwrap();
    for (input, source) in declared {
        agent.composer().external_input(input).unwrap().0.set_external(source);
    }
    recorder.begin(&agent, path);
    (agent, recorder)
}

/// Records the robot; `between` is called before each cycle.
fn recorded(path: &Path, declared: bool, between: impl Fn(&Composer, usize)) {
    let source = [(INPUT, "ros2:/other")];
    let (mut agent, recorder) = begun(path, &robot(), if declared { &source } else { &[] });
    for cycle in 0..times().len() {
        between(&agent.composer(), cycle);
        assert!(agent.step());
    }
    recorder.end(&mut agent).unwrap();
}

fn recomputed(path: &Path) {
    for modules in [&["front"][..], &["front", "back"]] {
        let plan =
            Plan { modules: modules.iter().map(|name| (*name).to_owned()).collect(), ..Plan::default() };
        assert_eq!(play(path, plan).1.unwrap().first, None, "{modules:?}");
    }
}

#[test]
fn values_from_outside_come_in_the_same_cycle_of_a_rerun() {
    let path = file("external.mcap");
    recorded(&path, true, |composer, cycle| match cycle {
        0 => {
            let refused = composer.set_external(vec![external(-2.0)]);
            assert!(refused[0].as_ref().is_err_and(|error| error.to_string().contains("first cycle")));
        }
        // Two in one cycle, and more after them.
        9 => {
            set(composer, &[5.0, 1.0 / 3.0]);
            set(composer, &[7.0]);
        }
        10 => set(composer, &[9.0]),
        20 => set(composer, &[f64::MAX]),
        _ => {}
    });
    assert_eq!(values(&path, "/front/other").len(), 5);
    let found = verdict(&path);
    assert!(matches!(found, Verdict::Identical { values: 100.., whole: true, cycles: 30 }), "{found:?}");
    recomputed(&path);
}

#[test]
fn a_rerun_differs_when_no_source_outside_is_recorded() {
    let path = file("undeclared.mcap");
    recorded(&path, false, |composer, cycle| {
        if cycle == 9 {
            set(composer, &[5.0]);
        }
    });
    let Verdict::Different(difference) = verdict(&path) else { panic!("nothing says where it came from") };
    assert!(["/front/other", "/front/sum"].contains(&difference.url.as_str()), "{difference}");
}

#[test]
#[allow(clippy::disallowed_methods, reason = "a program outside goes by a clock of its own")]
fn values_from_another_thread_do_not_change_a_cycle_that_runs() {
    let path = file("external-thread.mcap");
    let (mut agent, recorder) = begun(&path, &robot(), &[(INPUT, "ros2:/other")]);
    let (composer, is_over) = (agent.composer(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut number = 0.0;
            while composer.set_external(vec![external(0.5)])[0].is_err() {}
            while !is_over.load(Ordering::Relaxed) {
                set(&composer, &[number, number * 3.0]);
                number += 1.0;
            }
        });
        let look = |cycle: &Cycle<'_>| {
            std::thread::sleep(Duration::from_millis(2));
            if cycle.number < 30 { Control::Continue } else { Control::Stop }
        };
        agent.run(Box::new(look)).unwrap();
        is_over.store(true, Ordering::Relaxed);
    });
    recorder.end(&mut agent).unwrap();
    assert!(values(&path, "/front/other").len() >= 20);
    let found = verdict(&path);
    assert!(matches!(found, Verdict::Identical { whole: true, cycles: 30, .. }), "{found:?}");
    recomputed(&path);
}

#[test]
fn awaited_values_come_in_the_same_cycle_of_a_rerun() {
    let path = file("external-awaited.mcap");
    let (mut agent, recorder) = begun(&path, &robot(), &[(INPUT, "ros2:/other")]);
    let mut cycles = 0;
    agent.composer().wait_after_cycles(Some(Box::new(move |cycle| {
        cycles += 1;
        // As a program that thinks for a while, every third cycle.
        std::thread::sleep(Duration::from_millis(cycles % 3));
        if cycles % 3 == 0 {
            cycle.set(&external(cycle.now as f64)).map_err(|error| error.to_string())?;
        }
        if cycles < 30 { Ok(()) } else { Err("no answer after 30 cycles".into()) }
    })));
    let end = agent.run(Box::new(|_| Control::Continue)).unwrap();
    assert_eq!(end, End::Unanswered { reason: "no answer after 30 cycles".into() });
    assert_eq!(agent.composer().cycles(), 30);
    recorder.end(&mut agent).unwrap();
    assert_eq!(values(&path, "/front/other").len(), 10);
    let found = verdict(&path);
    assert!(matches!(found, Verdict::Identical { whole: true, cycles: 30, .. }), "{found:?}");
    // A run that is stopped waits for nothing.
    let (mut agent, recorder) = begun(&file("external-stopped.mcap"), &robot(), &[]);
    agent.composer().wait_after_cycles(Some(Box::new(|cycle| {
        while cycle.is_running() {
            std::thread::yield_now();
        }
        Ok(())
    })));
    let stopper = agent.stopper();
    let stop = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(20));
        stopper.stop();
    });
    assert_eq!(agent.run(Box::new(|_| Control::Continue)).unwrap(), End::Stopped);
    assert_eq!(agent.composer().cycles(), 1);
    stop.join().unwrap();
    recorder.end(&mut agent).unwrap();
}

#[test]
fn only_inputs_without_a_link_are_filled_from_outside() {
    recorded(&file("refused.mcap"), true, |composer, cycle| {
        if cycle != 1 {
            return;
        }
        let cases = [
            ("front/otter", "front/other"),
            ("front/number", "it is linked, from /source/number"),
            ("gatherer/numbers", "it is linked"),
            ("front/params", "it is not an input"),
            ("front/sum", "it is not an input"),
        ];
        for (input, reason) in cases {
            let error = composer.external_input(input).unwrap_err();
            assert!(error.to_string().contains(reason) && !error.help.is_empty(), "{error}");
        }
        let wrong = ExternalValue { content: ExternalContent::Bytes(vec![0; 3]), ..external(0.0) };
        let gone = ExternalValue { input: "front/gone".into(), ..external(0.0) };
        let results = composer.set_external(vec![wrong, external(1.0), gone]);
        assert!(matches!(&results[..], [Err(_), Ok(()), Err(_)]), "{results:?}");
        // A tool's value would be overwritten without a trace.
        let (property, _) = composer.board().get(INPUT).unwrap();
        let tool = property.set("value", &Value::Float(2.0), 0).unwrap_err();
        assert!(tool.to_string().contains("ros2:/other"), "{tool}");
    });
}

#[test]
fn queues_and_fields_from_outside_come_in_the_same_cycle() {
    let path = file("external-queue.mcap");
    // An input with a value of its own, of which a part is filled.
    let text = robot()
        .replace("\"gatherer/numbers\" = \"source/number\"", "\"gatherer/numbers\" = \"zenoh:numbers\"")
        .replace("\"back/other\" = { from = \"source/number\", previous = true }\n", "")
        .replace(
            "[modules.back]\nkind = \"sum\"",
            "[modules.back]\nkind = \"sum\"\ninputs.other.value = 0.125",
        );
    let (mut agent, recorder) =
        begun(&path, &text, &[("gatherer/numbers", "zenoh:numbers"), ("back/other/value", "zenoh:other")]);
    for cycle in 0..times().len() {
        if cycle > 0 {
            let whole = |value: f64| ExternalValue { input: "gatherer/numbers".into(), ..external(value) };
            let value = Value::Float(cycle as f64 / 3.0);
            let content = ExternalContent::Value { field: "value".into(), value };
            let field = ExternalValue { input: "back/other/value".into(), content };
            let values = vec![whole(1.0), whole(cycle as f64), field, whole(-1.0)];
            let results = agent.composer().set_external(values);
            assert!(results.len() == 4 && results.iter().all(Result::is_ok), "{results:?}");
        }
        assert!(agent.step());
    }
    recorder.end(&mut agent).unwrap();
    assert_eq!(values(&path, "/gatherer/numbers").len(), 3 * (times().len() - 1));
    let found = verdict(&path);
    assert!(matches!(found, Verdict::Identical { values: 100.., whole: true, cycles: 30 }), "{found:?}");
    for module in ["gatherer", "back"] {
        let plan = Plan { modules: [module.to_owned()].into(), ..Plan::default() };
        assert_eq!(play(&path, plan).1.unwrap().first, None, "{module}");
    }
}
