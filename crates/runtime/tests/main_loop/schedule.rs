use std::time::Duration;

use slate_runtime::configuration::{self, Configuration};
use slate_runtime::{Control, End, Schedule, ScheduleError, ScheduledStage, Stage};

use super::{comes, lockstep, order, run, sense_act, ticks, wall_clock, whole, witnesses};

const TWO: &str = r#"
[loop]
stages = ["Sense", "Act"]
[loop.members]
Sense = ["PreLoop", "SensorAcquire", "SensorPrepare", "SensorProcess", "WorldState"]
Act = ["Think", "Skill", "Act", "ActExec", "PostLoop"]
"#;

const MODULES: [(&str, &str); 4] =
    [("a", "ActExec"), ("b", "SensorAcquire"), ("c", "PostLoop"), ("d", "WorldState")];

#[test]
fn modules_run_in_the_order_of_the_ten_stages() {
    let stages = Stage::ALL.map(|stage| stage.name());
    let names = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j"];
    let modules: Vec<_> = names.into_iter().zip(stages).rev().collect();
    let mut agent = lockstep(&witnesses(&modules));
    for _ in 0..3 {
        assert!(agent.step());
        assert_eq!(order(&agent, &names), names);
    }
}

#[test]
fn a_loop_of_two_stages_runs_modules_that_name_the_ten() {
    let mut agent = lockstep(&format!("{TWO}{}", witnesses(&MODULES)));
    assert!(agent.step());
    assert_eq!(order(&agent, &["a", "b", "c", "d"]), ["b", "d", "a", "c"]);
}

#[test]
fn stages_and_their_members_run_in_configured_order() {
    let text = r#"
[loop]
stages = ["Late", "Think", "Early"]
members.Late = ["PostLoop", "ActExec", "Act", "Skill"]
members.Early = ["WorldState", "SensorProcess", "SensorPrepare", "SensorAcquire", "PreLoop"]
"#;
    let mut agent = lockstep(&format!("{text}{}", witnesses(&MODULES)));
    assert!(agent.step());
    assert_eq!(order(&agent, &["a", "b", "c", "d"]), ["c", "a", "d", "b"]);
}

#[test]
fn the_stages_are_exchanged_while_the_agent_runs() {
    let (mut agent, _) = wall_clock(&format!("loop.period = \"1ms\"\n{}", witnesses(&MODULES)));
    let composer = agent.composer();
    let board = std::sync::Arc::clone(agent.board());
    let stopper = agent.stopper();
    let changes = std::thread::spawn(move || {
        let measured = |stage: &str| match board.read(&format!("loop/{stage}/histogram/count")) {
            Ok(Some((count, _))) => count.as_f64() > Some(0.0),
            _ => false,
        };
        assert!(comes(|| measured("ActExec")));
        composer.set_schedule(sense_act());
        assert!(comes(|| measured("Act") && measured("Sense")));
        let gone = !measured("ActExec");
        composer.set_schedule(Schedule::default());
        assert!(comes(|| measured("ActExec")));
        stopper.stop();
        (gone, measured("Sense"))
    });
    assert_eq!(agent.run(Box::new(|_| Control::Continue)).unwrap(), End::Stopped);
    assert_eq!(changes.join().unwrap(), (true, false), "what is not a stage any more is not shown");
    let cycles = whole(&agent, "loop/state/cycles");
    for (module, _) in MODULES {
        assert_eq!(ticks(&agent, module), cycles, "{module} misses no cycle");
    }
    assert_eq!(order(&agent, &["a", "b", "c", "d"]), ["b", "d", "a", "c"]);
}

#[test]
fn stages_are_exchanged_between_two_runs_too() {
    let mut agent = lockstep(&witnesses(&MODULES));
    run(&mut agent, 3);
    agent.composer().set_schedule(sense_act());
    run(&mut agent, 3);
    assert!(MODULES.iter().all(|(module, _)| ticks(&agent, module) == 6));
}

#[test]
fn a_schedule_has_each_stage_of_modules_once() {
    let stage = |name: &str, members: &[Stage]| ScheduledStage {
        name: name.into(),
        members: members.into(),
        timeout: None,
    };
    let error = |stages| Schedule::new(stages).unwrap_err();
    let all = Stage::ALL;
    assert!(Schedule::new(vec![stage("All", &all)]).is_ok());
    let missing = error(vec![stage("Some", &all[..8])]);
    assert_eq!(missing.to_string(), "no stage of the loop runs the modules of ActExec, PostLoop");
    let twice = error(vec![stage("All", &all), stage("Again", &[Stage::Think])]);
    assert_eq!(twice.to_string(), "the modules of Think would run both in `All` and in `Again`");
    let doubled = error(vec![stage("All", &[&all[..], &[Stage::Act]].concat())]);
    assert!(matches!(doubled, ScheduleError::Twice { stage: Stage::Act, .. }), "{doubled}");
    let same = error(vec![stage("All", &all), stage("All", &[])]);
    assert_eq!(same, ScheduleError::SameName { name: "All".into() });
    for name in ["", "a b", "a/b", "state", "histogram", &"x".repeat(33)] {
        assert_eq!(error(vec![stage(name, &all)]), ScheduleError::Name { name: name.into() });
    }
    let unknown = sense_act().with_timeout("Think", Duration::from_millis(1)).unwrap_err();
    assert_eq!(unknown.to_string(), "the loop has no stage `Think`");
}

fn report(text: &str) -> String {
    let read = Configuration::from_text("test.toml", text, &configuration::Options::default());
    read.unwrap_err().to_string()
}

#[test]
fn a_loop_is_read_from_the_configuration() {
    let text = format!("{TWO}[loop.timeouts]\nAct = \"5ms\"\n");
    let read = Configuration::from_text("test.toml", &text, &configuration::Options::default()).unwrap();
    let expected = sense_act().with_timeout("Act", Duration::from_millis(5)).unwrap();
    assert_eq!(*read.schedule(), expected);
    let text = "[loop]\nminimum = \"5ms\"\ntimeouts.Think = \"1ms\"\n";
    let read = Configuration::from_text("test.toml", text, &configuration::Options::default()).unwrap();
    assert_eq!(read.minimum().map(|minimum| minimum.value), Some(5_000_000));
    let think = &read.schedule().stages()[5];
    assert_eq!((think.name.as_str(), think.timeout), ("Think", Some(Duration::from_millis(1))));
}

#[test]
fn a_wrong_loop_is_refused_with_the_place() {
    for (text, expected) in [
        ("[loop]\ntimeouts.Thinc = \"5ms\"", &["test.toml:2:", "no stage `Thinc`", "`Think`"][..]),
        ("[loop]\ntimeouts.Think = 5", &["test.toml:2:", "`Think` takes a duration"]),
        ("[loop]\nmembers.Sense = [\"Think\"]", &["test.toml:2:", "no stage `Sense`"]),
        ("[loop]\nstages = []", &["test.toml:2:", "at least one stage"]),
        ("[loop]\nstages = [\"Sense\"]", &["test.toml:2:", "PreLoop, SensorAcquire", "members.Sense"]),
        ("[loop]\nstages = [\"a/b\"]", &["test.toml:2:", "`a/b` can't name a stage"]),
        (
            "[loop]\nstages = [\"Sense\"]\nmembers.Sense = [\"PreLoop\", \"Thin\"]",
            &["test.toml:3:", "`Sense` can't be `Thin`", "`Think`"],
        ),
        (
            "[loop]\nstages = [\"Think\", \"Rest\"]\nmembers.Rest = [\"Think\"]",
            &["both in `Think` and in `Rest`"],
        ),
        ("[loop]\nperiod = \"5ms\"\nminimum = \"6ms\"", &["test.toml:3:", "longer than `period`"]),
    ] {
        let report = report(text);
        assert!(expected.iter().all(|part| report.contains(part)), "{text}\n{report}");
    }
}

#[test]
fn no_module_takes_the_place_of_the_loop() {
    for name in ["loop", "\"loop/inner\""] {
        let text = format!("[modules.{name}]\nkind = \"counter\"\n");
        let error =
            crate::main_loop::common::load(&text, &[], slate_runtime::Options::default()).unwrap_err();
        assert!(error.to_string().contains("`loop` is the main loop"), "{error}");
    }
}
