//! Panics in every call of a plugin: the caller gets an error, and others are not affected.

use slate_blackboard::interface::Value;
use slate_runtime::{Agent, Mode, PluginError};

use crate::fixtures::libraries;
use crate::support::*;

/// As the fixture counts them.
const CREATE: u32 = 1;
const TICK: u32 = 2;
const SAVE: u32 = 3;
const RESTORE: u32 = 4;
const DESTROY: u32 = 5;

fn robot_with(fault: u32) -> String {
    robot(&plain()).replace("[modules.reader]", &format!("params = {{ fault = {fault} }}\n[modules.reader]"))
}

fn paths(agent: &Agent) -> Vec<String> {
    agent.board().properties().iter().map(|property| property.path().to_owned()).collect()
}

#[test]
fn a_panic_in_create_refuses_the_plugin_and_leaves_nothing() {
    let refusal = try_lockstep(&robot_with(CREATE)).unwrap_err();
    assert_says(&complaint(&refusal), &["`counter` can't be set up", "it can't be made"]);
    let text = robot_with(CREATE).replace("[modules.counter]", "load = false\n[modules.counter]");
    let mut agent = lockstep(&text);
    step(&mut agent, 2);
    let before = paths(&agent);
    for _ in 0..3 {
        let refusal = agent.composer().load("counter").unwrap_err();
        assert!(matches!(refusal, PluginError::Unfit(_)), "{refusal:?}");
        assert_says(&complaint(&refusal), &["`counter` can't be set up", "panicked", "it can't be made"]);
        assert_eq!(paths(&agent), before);
        step(&mut agent, 1);
    }
    assert_eq!(number(&agent, "reader/seen/alive"), 0);
}

#[test]
fn a_panic_in_describe_refuses_the_plugin() {
    let file = libraries().counter("describe");
    let refusal = try_lockstep(&robot(&file)).unwrap_err();
    assert_says(&complaint(&refusal), &["counter", "it can't describe itself"]);
    let mut agent = lockstep("");
    let refusal = agent.composer().load_library(&file).unwrap_err();
    assert_says(&complaint(&refusal), &["counter", "it can't describe itself"]);
    step(&mut agent, 1);
    agent.composer().load_library(&plain()).unwrap();
    step(&mut agent, 1);
}

#[test]
fn panics_in_tick_stop_that_module_and_no_other() {
    let mut agent = lockstep(&robot_with(TICK));
    step(&mut agent, 20);
    let (ticks, _, panics) = agent.counts("counter").unwrap();
    assert_eq!((ticks, panics), (5, 5), "after five it stays off");
    assert_eq!(number(&agent, "beat/count/value"), 20);
    assert_eq!(agent.counts("reader").unwrap().0, 20);
    assert_eq!((number(&agent, "reader/seen/value"), number(&agent, "reader/seen/stale")), (0, 1));
}

#[test]
fn a_failed_module_can_be_unloaded_and_loaded_again() {
    let mut agent = lockstep(&robot_with(TICK));
    step(&mut agent, 10);
    agent.composer().unload("counter").unwrap();
    step(&mut agent, 1);
    agent.composer().load("counter").unwrap();
    step(&mut agent, 10);
    assert_eq!(agent.counts("counter").unwrap().2, 5);
}

#[test]
fn better_code_revives_a_module_that_has_failed_for_good() {
    for version in ["more", "ports"] {
        let mut agent = lockstep(&robot_with(TICK));
        step(&mut agent, 10);
        agent.board().write("counter/params/fault", &Value::Integer(0), 0).unwrap();
        let reload = agent.composer().reload("counter", Some(&libraries().counter(version))).unwrap();
        let [(_, Err(reason))] = &reload.modules[..] else { panic!("{reload:?}") };
        assert_says(reason, &["it had failed"]);
        if version == "ports" {
            // The parameters are those of the configuration again.
            agent.board().write("counter/params/fault", &Value::Integer(0), 0).unwrap();
        }
        step(&mut agent, 4);
        assert_eq!(number(&agent, "counter/count/value"), 4, "{version}");
        assert_eq!((number(&agent, "reader/seen/value"), number(&agent, "reader/seen/stale")), (4, 0));
        let status = agent.composer().modules().into_iter().find(|module| module.name == "counter").unwrap();
        assert_eq!(status.condition, "WORKING");
    }
}

#[test]
fn a_failed_module_switched_off_and_on_needs_a_reload() {
    let mut agent = lockstep(&robot_with(TICK));
    step(&mut agent, 10);
    agent.composer().enable("counter", false).unwrap();
    step(&mut agent, 1);
    agent.composer().enable("counter", true).unwrap();
    agent.board().write("counter/params/fault", &Value::Integer(0), 0).unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 0, "not before");
    agent.composer().reload("counter", None).unwrap();
    step(&mut agent, 3);
    assert_eq!(number(&agent, "counter/count/value"), 3);
}

#[test]
fn a_panic_in_save_makes_the_new_code_begin_afresh() {
    for version in ["more", "ports"] {
        let mut agent = lockstep(&robot_with(SAVE));
        step(&mut agent, 3);
        let reload = agent.composer().reload("counter", Some(&libraries().counter(version))).unwrap();
        let [(_, Err(reason))] = &reload.modules[..] else { panic!("{reload:?}") };
        assert_says(reason, &["panicked", "it can't be saved"]);
        step(&mut agent, 2);
        assert_eq!(number(&agent, "counter/count/value"), 2);
        agent.composer().unload("counter").expect("its state is nothing that an unload needs");
        step(&mut agent, 1);
    }
}

#[test]
fn a_panic_in_restore_makes_the_new_code_begin_afresh() {
    for version in ["more", "ports"] {
        let mut agent = lockstep(&robot_with(RESTORE));
        step(&mut agent, 3);
        let reload = agent.composer().reload("counter", Some(&libraries().counter(version))).unwrap();
        let [(_, Err(reason))] = &reload.modules[..] else { panic!("{reload:?}") };
        assert_says(reason, &["panicked", "it can't be restored"]);
        step(&mut agent, 2);
        assert_eq!(number(&agent, "counter/count/value"), 2);
    }
}

#[test]
fn a_panic_in_destroy_is_logged_and_blocks_no_reload_or_unload() {
    let (mut agent, log) = logged_lockstep(&robot_with(DESTROY));
    step(&mut agent, 3);
    let reload = agent.composer().reload("counter", Some(&libraries().counter("more"))).unwrap();
    assert_eq!(reload.modules, [("counter".into(), Ok(()))]);
    let said = log.lines().iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
    assert_says(&said, &["counter has ended, but panicked", "(at counter/src/state.rs:"]);
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 4);
    agent.composer().unload("counter").unwrap();
    step(&mut agent, 1);
    agent.composer().load("counter").unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 1);
}

#[test]
fn panics_during_a_run_cost_no_other_module_a_cycle() {
    let text = robot_with(TICK) + "[modules.good]\nkind = \"counter\"\n";
    let running = Running::start(&text, Mode::Staged, &["beat/count/value", "good/count/value"]);
    for _ in 0..5 {
        running.composer.reload("counter", None).unwrap();
        running.cycles(10);
    }
    let (agent, _, samples) = running.stop();
    assert!(agent.counts("counter").unwrap().2 >= 5);
    for (i, row) in samples.iter().enumerate() {
        assert_eq!(row[..], [i as u64 + 1; 2], "the one that works is of the same plugin");
    }
}
