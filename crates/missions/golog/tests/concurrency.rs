//! Actions at a time, priorities and interrupts.

use slate_golog::*;

use crate::common::{Robot, executor};

#[test]
fn concurrent_actions_run_at_the_same_time() {
    let (mut executor, mut robot) =
        (executor("action a action b action c procedure main { { a; c } || b }"), Robot::default());
    robot.tick(&mut executor);
    assert_eq!(robot.log, ["start a", "start b"]);
    assert_eq!(robot.ticks(&mut executor, 5), GologOutcome::Succeeded);
    assert_eq!(robot.log[2..], ["end a", "end b", "start c", "end c"]);
}

#[test]
fn an_interrupt_suspends_the_action_of_lower_priority() {
    let text = "condition near fluent met = false
        action drive action wait met becomes true action forget performs nothing met becomes false
        procedure main {
            interrupt near and not met { wait } >> interrupt met and not near { forget } >> drive
        }";
    let (mut executor, mut robot) = (executor(text), Robot::default());
    robot.set_condition("near", false);
    robot.tick(&mut executor);
    robot.set_condition("near", true);
    robot.tick(&mut executor);
    assert_eq!(robot.log, ["start drive", "stop drive", "start wait"]);
    let running: Vec<(String, bool)> =
        executor.running().map(|(_, text, is_suspended)| (text, is_suspended)).collect();
    assert_eq!(running, [("drive".into(), true), ("wait".into(), false)]);
    robot.ticks(&mut executor, 2);
    assert_eq!(robot.log[3..], ["end wait", "start drive"], "the meeting is one");
    robot.set_condition("near", false);
    robot.ticks(&mut executor, 2);
    assert_eq!(executor.fluent("met").as_deref(), Some("false"));
    assert_eq!(executor.outcome(), GologOutcome::Succeeded);
}

#[test]
fn an_interrupt_that_holds_comes_before_the_end() {
    let text = "condition dirty fluent done = false action clean done becomes true action go
        procedure main { interrupt dirty and not done { clean } >> go }";
    let (mut executor, mut robot) = (executor(text), Robot::default());
    robot.ticks(&mut executor, 2);
    robot.set_condition("dirty", true);
    assert_eq!(robot.ticks(&mut executor, 8), GologOutcome::Succeeded);
    assert_eq!(robot.log, ["start go", "end go", "start clean", "end clean"]);
}

#[test]
fn too_many_actions_at_a_time_are_refused() {
    let (mut executor, mut robot) =
        (executor("action a procedure main { parallel repeat { a } }"), Robot::default());
    let error = executor.tick(&mut robot).unwrap_err().to_string();
    assert_eq!(error, "line 1: expected at most 16 actions of the robot at a time");
    assert_eq!(executor.running().count(), 0);
}
