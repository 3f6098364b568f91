//! Modules that do not return: they are named, nothing of them is taken away under them, and the rest continues.

use slate_blackboard::interface::Value;
use slate_runtime::{Mode, PluginError};

use crate::fixtures::libraries;
use crate::support::*;

const SAVE_HANGS: u32 = 6;
const DESTROY_HANGS: u32 = 7;
const RESTORE_HANGS: u32 = 8;
const CREATE_HANGS: u32 = 9;
/// Longer than any test waits, milliseconds.
const FOR_EVER: u64 = 600_000;

fn robot_with(params: &str) -> String {
    let text =
        robot(&plain()).replace("[modules.reader]", &format!("params = {{ {params} }}\n[modules.reader]"));
    format!("loop.period = \"5ms\"\nloop.hang = \"250ms\"\n{text}")
}

fn condition(running: &Running) -> &'static str {
    running.composer.modules().into_iter().find(|module| module.name == "counter").unwrap().condition
}

#[test]
fn nothing_is_unloaded_or_exchanged_while_its_tick_hangs() {
    for (mode, trigger) in [(Mode::Staged, ""), (Mode::Threaded, "every = \"5ms\"\n")] {
        let text = robot_with("hang_at = 5, hang = 2000").replace("params =", &format!("{trigger}params ="));
        let running = Running::start(&text, mode, &["beat/count/value"]);
        until("the hang is noticed", || condition(&running) == "LATE");
        let unload = running.composer.unload("counter").unwrap_err();
        let reload = running.composer.reload("counter", Some(&libraries().counter("more"))).unwrap_err();
        let replace = running.composer.reload("counter", Some(&libraries().counter("ports"))).unwrap_err();
        for refusal in [unload, reload, replace] {
            assert!(matches!(refusal, PluginError::Late { .. }), "{mode:?}: {refusal:?}");
            assert_says(
                &complaint(&refusal),
                &["module `counter` has not returned from its last call", "wait until"],
            );
        }
        running.cycles(3);
        assert_eq!(
            (running.value("reader/seen/value"), running.value("reader/seen/stale")),
            (0, 1),
            "it is safe"
        );
        until("it returns", || condition(&running) == "WORKING");
        running.composer.reload("counter", Some(&libraries().counter("more"))).unwrap();
        until("the new code", || running.value("counter/count/version") == 2);
        running.composer.unload("counter").unwrap();
        let (_, _, samples) = running.stop();
        assert!(samples.windows(2).all(|rows| rows[1][0] == rows[0][0] + 1), "{mode:?}");
    }
}

#[test]
fn a_hanging_save_during_a_reload_leaves_the_old_code_running() {
    for (mode, trigger) in [(Mode::Staged, ""), (Mode::Threaded, "every = \"5ms\"\n")] {
        let text = robot_with(&format!("fault = {SAVE_HANGS}, hang = 2000"));
        let text = text.replace("params =", &format!("{trigger}params ="));
        let running = Running::start(&text, mode, &["beat/count/value"]);
        let refusal = running.composer.reload("counter", Some(&libraries().counter("more"))).unwrap_err();
        assert!(matches!(refusal, PluginError::Late { .. }), "{mode:?}: {refusal:?}");
        running.cycles(3);
        assert_eq!(
            (running.value("reader/seen/value"), running.value("reader/seen/stale")),
            (0, 1),
            "it is safe"
        );
        until("it returns", || condition(&running) == "WORKING");
        let count = running.value("counter/count/value");
        until("it goes on", || running.value("counter/count/value") > count);
        assert_eq!(running.value("counter/count/version"), 1, "{mode:?}: with its old code");
        let (_, _, samples) = running.stop();
        assert!(samples.windows(2).all(|rows| rows[1][0] == rows[0][0] + 1), "{mode:?}");
    }
}

#[test]
fn a_reload_that_one_module_hinders_is_made_for_none() {
    for hindrance in ["hang_at = 5, hang = 2000", "fault = 6, hang = 2000"] {
        // One has a thread of its own, the other is on the loop.
        let text = format!(
            "loop.period = \"5ms\"\nloop.hang = \"250ms\"\n{}[modules.free]\nkind = \"counter\"\n\
             every = \"2ms\"\n[modules.slow]\nkind = \"counter\"\nparams = {{ {hindrance} }}\n",
            library("counter", &plain())
        );
        let running = Running::start(&text, Mode::Threaded, &[]);
        let condition = |name: &str| {
            running.composer.modules().into_iter().find(|module| module.name == name).unwrap().condition
        };
        if hindrance.starts_with("hang_at") {
            until("the hang is noticed", || condition("slow") == "LATE");
        }
        let refusal = running.composer.reload("counter", Some(&libraries().counter("more"))).unwrap_err();
        assert_says(&complaint(&refusal), &["module `slow` has not returned"]);
        let count = running.value("free/count/value");
        until("the free one goes on", || running.value("free/count/value") > count + 3);
        assert_eq!(running.value("free/count/version"), 1, "{hindrance}: with its old code");
        assert!(running.composer.modules().iter().all(|module| !module.plugin.is_empty()), "all are known");
        until("the slow one returns", || condition("slow") == "WORKING");
        if hindrance.starts_with("hang_at") {
            running.composer.reload("counter", Some(&libraries().counter("more"))).unwrap();
            until("the new code", || {
                ["free", "slow"].iter().all(|name| running.value(&format!("{name}/count/version")) == 2)
            });
        }
        running.composer.unload("counter").unwrap();
        running.stop();
    }
}

#[test]
fn an_end_that_hangs_is_given_up_and_other_changes_are_made() {
    for (mode, trigger) in [(Mode::Staged, ""), (Mode::Threaded, "every = \"5ms\"\n")] {
        let text = robot_with(&format!("fault = {DESTROY_HANGS}, hang = {FOR_EVER}"));
        let text = text.replace("params =", &format!("{trigger}params ="));
        let running = Running::start(&text, mode, &["beat/count/value"]);
        let more = libraries().counter("more");
        let reload = running.composer.reload("counter", Some(&more)).unwrap();
        assert!(reload.in_place && reload.modules[0].1.is_ok(), "{mode:?}: {reload:?}");
        assert_eq!(reload.old_library, "open", "a call of it goes on");
        until("the new code", || running.value("counter/count/version") == 2);
        let unloaded = running.composer.unload("counter").unwrap();
        assert_eq!(unloaded, [("counter".to_owned(), "open")]);
        until("it is said", || {
            let said = "counter has not returned from its end within 250 ms";
            running.log.lines().iter().filter(|line| line.text.contains(said)).count() == 2
        });
        running.composer.load_library(&plain()).unwrap();
        until("it counts", || running.value("reader/seen/value") > 3);
        assert!(running.composer.plugins().iter().any(|plugin| plugin.name == "counter" && plugin.loaded));
        let (agent, _, samples) = running.stop();
        // One that ends with the agent holds the program up no longer either.
        drop(agent);
        assert!(samples.windows(2).all(|rows| rows[1][0] == rows[0][0] + 1), "{mode:?}");
    }
}

#[test]
fn a_hanging_save_or_restore_at_a_port_change_costs_the_state() {
    for (fault, call) in [(SAVE_HANGS, "save"), (RESTORE_HANGS, "restore")] {
        let text = robot_with(&format!("fault = {fault}, hang = {FOR_EVER}"));
        let running = Running::start(&text, Mode::Staged, &["beat/count/value"]);
        let reload = running.composer.reload("counter", Some(&libraries().counter("ports"))).unwrap();
        assert!(!reload.in_place);
        assert_eq!(reload.modules[0].1, Err(format!("its {call} has not returned")));
        until("the new ports", || running.value("counter/twice/value") > 0);
        let before = running.value("reader/seen/value");
        until("it is read", || running.value("reader/seen/value") > before);
        until("it is said", || {
            let said = format!("counter has not returned from its {call} within 250 ms");
            running.log.lines().iter().any(|line| line.text.contains(&said))
        });
        running.composer.unload("counter").unwrap();
        let (_, _, samples) = running.stop();
        assert!(samples.windows(2).all(|rows| rows[1][0] == rows[0][0] + 1), "{call}");
    }
}

#[test]
fn a_create_that_hangs_is_given_up_and_lists_do_not_wait_for_it() {
    let running =
        Running::start(&robot_with(&format!("hang = {FOR_EVER}")), Mode::Staged, &["beat/count/value"]);
    running.board.write("counter/params/fault", &Value::Integer(CREATE_HANGS.into()), 0).unwrap();
    std::thread::scope(|scope| {
        let reload = scope.spawn(|| running.composer.reload("counter", Some(&libraries().counter("more"))));
        while !reload.is_finished() {
            let start = std::time::Instant::now();
            assert!(running.composer.plugins().iter().any(|plugin| plugin.name == "counter"));
            assert!(running.composer.modules().iter().any(|module| module.name == "counter"));
            // The limit of a create is ten times the time after which a step hangs.
            assert!(start.elapsed() < std::time::Duration::from_secs(2));
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        let refusal = reload.join().unwrap().unwrap_err();
        let said = ["module `counter`", "its create has not returned within 2500 ms"];
        assert_says(&complaint(&refusal), &said);
    });
    let said = "counter has not returned from its create within 2500 ms";
    // Another thread writes the log.
    until("it is said", || running.log.lines().iter().any(|line| line.text.contains(said)));
    let count = running.value("counter/count/value");
    until("the old code goes on", || running.value("counter/count/value") > count);
    assert_eq!(running.value("counter/count/version"), 1);
    let (_, _, samples) = running.stop();
    assert!(samples.windows(2).all(|rows| rows[1][0] == rows[0][0] + 1));
}

#[test]
fn an_unload_needs_no_state_and_waits_for_no_save() {
    let running =
        Running::start(&robot_with(&format!("fault = {SAVE_HANGS}, hang = 600000")), Mode::Staged, &[]);
    running.composer.unload("counter").unwrap();
    running.cycles(3);
    running.stop();
}

#[test]
fn an_agent_that_does_not_run_reloads_too() {
    let mut agent = lockstep(&robot(&plain()));
    agent.composer().reload("counter", Some(&libraries().counter("more"))).unwrap();
    step(&mut agent, 1);
    agent.board().write("counter/params/step", &Value::Integer(5), 0).unwrap();
    step(&mut agent, 1);
    agent.composer().reload("counter", Some(&plain())).unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 11, "a parameter that was set stays");
}
