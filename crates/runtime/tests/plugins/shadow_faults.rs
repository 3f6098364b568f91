//! New code that panics, hangs or is slow beside the old: others are not affected.

use std::time::{Duration, Instant};

use slate_blackboard::interface::Value;
use slate_runtime::{Mode, PluginError};

use crate::fixtures::libraries;
use crate::shadow::{comparison, shown, step_together};
use crate::support::*;

const PANICS: i128 = 1;
const HANGS: i128 = 2;

/// As the fixture counts what panics in every version.
const TICK: u32 = 2;
const RESTORE: u32 = 4;

fn robot_with(params: &str) -> String {
    robot(&plain()).replace("[modules.reader]", &format!("params = {{ {params} }}\n[modules.reader]"))
}

/// An agent with a period of 5 ms beside whose counter a rogue runs.
fn beside_a_rogue() -> Running {
    let text = format!("loop.period = \"5ms\"\nloop.hang = \"250ms\"\n{}", robot(&plain()));
    let running = Running::start(&text, Mode::Staged, &["beat/count/value", "counter/count/value"]);
    running.composer.shadow("counter", &libraries().counter("rogue")).unwrap();
    running.cycles(3);
    running
}

fn set(running: &Running, path: &str, number: i128) {
    running.board.write(path, &Value::Integer(number), 0).unwrap();
}

/// That no cycle was missed and nothing came late.
#[track_caller]
fn nobody_noticed(running: Running) {
    let modules = running.composer.modules();
    let counter = modules.iter().find(|module| module.name == "counter").unwrap();
    assert_eq!((counter.condition, counter.panics), ("WORKING", 0));
    let (agent, _, samples) = running.stop();
    for (i, row) in samples.iter().enumerate() {
        assert_eq!(row[..], [i as u64 + 1; 2]);
    }
    assert_eq!(number(&agent, "reader/seen/generation"), 1);
}

#[test]
fn new_code_that_panics_is_counted_and_does_not_take_over() {
    let mut agent = lockstep(&robot(&plain()));
    agent.composer().shadow("counter", &libraries().counter("rogue")).unwrap();
    step_together(&mut agent, "counter", 2);
    agent.board().write("counter/params/rogue", &Value::Integer(PANICS), 0).unwrap();
    step_together(&mut agent, "counter", 30);
    assert_eq!(comparison(&agent, "counter"), ([32, 30, 0, 30, 3], "count".into()));
    let (ticks, _, panics) = agent.counts("counter").unwrap();
    assert_eq!((ticks, panics, number(&agent, "reader/seen/value")), (32, 0, 32));
    let refusal = agent.composer().promote("counter").unwrap_err();
    assert_says(
        &complaint(&refusal),
        &["module `counter` has panicked", "the old code keeps running", "--end"],
    );
    step_together(&mut agent, "counter", 1);
    agent.composer().end_shadow("counter").unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 34);
}

#[test]
fn hanging_new_code_disturbs_no_module_and_can_be_ended() {
    let running = beside_a_rogue();
    set(&running, "counter/params/hang", 6000);
    set(&running, "counter/params/rogue", HANGS);
    // More than it may lag behind.
    running.cycles(30);
    set(&running, "counter/params/rogue", 0);
    let refusal = running.composer.promote("counter").unwrap_err();
    assert_says(&complaint(&refusal), &["module `counter` lags behind or does not return", "--end"]);
    assert_eq!(shown(&running.composer).0, ["counter"], "nothing has changed");
    let start = Instant::now();
    running.composer.end_shadow("counter").unwrap();
    assert!(start.elapsed() < Duration::from_secs(5), "it is left to its thread");
    // Other code can be tried while that thread still hangs.
    running.composer.shadow("counter", &libraries().counter("more")).unwrap();
    until("other code", || running.value("counter/shadow/ticks") > 5);
    running.composer.promote("counter").unwrap();
    until("it takes over", || running.value("counter/count/version") == 2);
    nobody_noticed(running);
}

#[test]
fn an_unload_does_not_wait_for_new_code_that_hangs() {
    let running = beside_a_rogue();
    set(&running, "counter/params/hang", 6000);
    set(&running, "counter/params/rogue", HANGS);
    running.cycles(5);
    let start = Instant::now();
    running.composer.unload("counter").unwrap();
    assert!(start.elapsed() < Duration::from_secs(5));
    assert!(running.board.find("counter/shadow").is_err());
    let (_, _, samples) = running.stop();
    assert!(samples.windows(2).all(|rows| rows[1][0] == rows[0][0] + 1), "no cycle was missed");
}

#[test]
fn new_code_that_is_slow_skips_steps_which_are_counted() {
    let running = beside_a_rogue();
    set(&running, "counter/params/hang", 40);
    set(&running, "counter/params/rogue", HANGS);
    until("it skips steps", || running.value("counter/shadow/skipped") > 0);
    set(&running, "counter/params/rogue", 0);
    let compared = |field: &str| running.value(&format!("counter/shadow/{field}"));
    until("it is fast again", || {
        let ticks = running.composer.modules().iter().find(|module| module.name == "counter").unwrap().ticks;
        compared("ticks") > 20 && ticks - compared("ticks") - compared("skipped") < 16
    });
    assert_eq!(compared("panics"), 0);
    assert!(compared("differences") > 0, "its count is another one since");
    nobody_noticed(running);
}

#[test]
fn new_code_that_does_not_take_the_state_over_begins_afresh() {
    let running = Running::start(&robot_with(&format!("fault = {RESTORE}")), Mode::Staged, &[]);
    running.composer.shadow("counter", &plain()).unwrap();
    until("it begins", || running.value("counter/shadow/ticks") > 3);
    assert!(running.value("counter/shadow/first_difference") > 0);
    until("it is said", || {
        running.log.lines().iter().any(|line| {
            &*line.module == "counter/shadow"
                && line.text.contains("restarts with a fresh state")
                && line.text.contains("it can't be restored")
        })
    });
    running.stop();
}

#[test]
fn new_code_begins_beside_all_modules_or_none() {
    // The one with the later name can't be saved in time.
    let text = format!(
        "loop.period = \"5ms\"\nloop.hang = \"250ms\"\n{}[modules.slow]\nkind = \"counter\"\n\
         params = {{ fault = 6, hang = 1500 }}\n",
        robot(&plain())
    );
    let running = Running::start(&text, Mode::Staged, &["beat/count/value", "counter/count/value"]);
    let refusal = running.composer.shadow("counter", &libraries().counter("more")).unwrap_err();
    assert!(matches!(refusal, PluginError::Late { .. }), "{refusal:?}");
    assert_says(&complaint(&refusal), &["module `slow` has not returned"]);
    assert_eq!(shown(&running.composer), (vec![], vec![]));
    for module in ["counter", "slow"] {
        assert!(running.board.find(&format!("{module}/shadow")).is_err(), "{module}");
    }
    until("it returns", || running.composer.modules().iter().all(|module| module.condition == "WORKING"));
    nobody_noticed(running);
}

#[test]
fn promoted_code_revives_a_module_that_has_failed_for_good() {
    let mut agent = lockstep(&robot_with(&format!("fault = {TICK}")));
    step(&mut agent, 10);
    agent.board().write("counter/params/fault", &Value::Integer(0), 0).unwrap();
    agent.composer().shadow("counter", &libraries().counter("more")).unwrap();
    step(&mut agent, 3);
    agent.composer().promote("counter").unwrap();
    step(&mut agent, 4);
    assert_eq!((number(&agent, "counter/count/value"), number(&agent, "counter/count/version")), (4, 2));
    let modules = agent.composer().modules();
    assert_eq!(modules.iter().find(|module| module.name == "counter").unwrap().condition, "WORKING");
}

#[test]
fn steps_in_which_the_old_code_panics_run_in_the_new_code() {
    let mut agent = lockstep(&robot_with("step = 1"));
    agent.composer().shadow("counter", &plain()).unwrap();
    step_together(&mut agent, "counter", 2);
    for _ in 0..3 {
        agent.board().write("counter/params/fault", &Value::Integer(TICK.into()), 0).unwrap();
        step_together(&mut agent, "counter", 1);
        agent.board().write("counter/params/fault", &Value::Integer(0), 0).unwrap();
        step_together(&mut agent, "counter", 1);
    }
    let ([ticks, _, skipped, panics, _], _) = comparison(&agent, "counter");
    assert_eq!((ticks, skipped, panics), (8, 0, 3));
}
