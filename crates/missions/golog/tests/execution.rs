//! Online execution of programs.

use slate_golog::*;

use crate::common::{Robot, executor};

#[test]
fn actions_run_one_after_the_other_with_effects_at_the_end() {
    let text = "domain place = desk, shelf fluent at: place = shelf
        action go(p: place) possible if at != p at becomes p
        procedure main { go(desk); test at == desk; go(shelf) }";
    let (mut executor, mut robot) = (executor(text), Robot::default());
    robot.tick(&mut executor);
    assert_eq!(executor.fluent("at").as_deref(), Some("shelf"));
    assert_eq!(robot.ticks(&mut executor, 5), GologOutcome::Succeeded);
    assert_eq!(robot.log, ["start go(desk)", "end go(desk)", "start go(shelf)", "end go(shelf)"]);
}

#[test]
fn an_action_of_the_robot_has_numbers_of_tables() {
    let text = "domain place = desk, shelf table x(place) = desk: 1.5, shelf: -2 fluent n: 0..9 = 4
        action go(p: place) performs GoTo(x(p), -0.25, n + 1) procedure main { go(shelf) }";
    struct Numbers(Vec<f64>);
    impl GologHost for Numbers {
        fn start(&mut self, _: usize, action: &RobotAction<'_>) -> Result<(), String> {
            assert_eq!(action.name, "GoTo");
            self.0.clone_from(&action.arguments);
            Ok(())
        }
        fn progress(&mut self, _: usize) -> GologProgress {
            GologProgress::Succeeded
        }
        fn stop(&mut self, _: usize) {}
    }
    let mut numbers = Numbers(Vec::new());
    executor(text).tick(&mut numbers).unwrap();
    assert_eq!(numbers.0, [-2.0, -0.25, 5.0]);
}

#[test]
fn a_test_of_an_unknown_condition_waits() {
    let text = "condition ready action go procedure main { if ready { go } else { nil } }";
    let (mut executor, mut robot) = (executor(text), Robot::default());
    robot.ticks(&mut executor, 3);
    assert_eq!(executor.unknown_conditions().collect::<Vec<_>>(), ["ready"]);
    assert!(robot.log.is_empty() && executor.is_blocked());
    robot.set_condition("ready", true);
    robot.tick(&mut executor);
    assert_eq!(robot.log, ["start go"]);
}

#[test]
fn an_action_that_senses_sets_its_fluent() {
    let text =
        "domain door = front, back fluent is_open(door) action look(d: door) senses is_open(d) action go
        procedure main { look(front); look(back); if is_open(front) and not is_open(back) { go } }";
    let (mut executor, mut robot) = (executor(text), Robot::default());
    robot.failing.push("look(back)".into());
    assert_eq!(robot.ticks(&mut executor, 7), GologOutcome::Succeeded);
    assert_eq!(executor.fluent("is_open(back)").as_deref(), Some("false"));
    assert_eq!(robot.log.last().map(String::as_str), Some("end go"));
}

#[test]
fn a_failed_action_changes_what_its_theory_says() {
    let text = "fluent tries: 0..3 = 0 action grasp possible if tries < 2 if failed: tries becomes tries + 1
        action stow if failed: nothing
        procedure main { while tries < 2 { grasp }; stow }";
    let (mut executor, mut robot) = (executor(text), Robot::default());
    robot.failing.extend(["grasp".into(), "stow".into()]);
    assert_eq!(robot.ticks(&mut executor, 7), GologOutcome::Succeeded);
    assert_eq!(robot.log.iter().filter(|line| *line == "fail grasp").count(), 2);
}

#[test]
fn a_failure_that_no_theory_expects_ends_the_mission() {
    let (mut executor, mut robot) = (executor("action go\nprocedure main { go }"), Robot::default());
    robot.failing.push("go".into());
    robot.ticks(&mut executor, 2);
    let error = executor.tick(&mut robot).unwrap_err().to_string();
    assert_eq!(error, "line 1: the action `go` has failed; declare its effects on failure: `if failed: ...`");
    assert_eq!(executor.outcome(), GologOutcome::Failed);
}

#[test]
fn an_exogenous_action_occurs_when_its_condition_begins_to_hold() {
    let text = "domain door = front, back fluent shut(door) = false
        exogenous slam(d: door) possible if not shut(d) shut(d) becomes true
        procedure main { test all d: door (shut(d)) }";
    let (mut executor, mut robot) = (executor(text), Robot::default());
    robot.set_condition("slam(front)", true);
    robot.ticks(&mut executor, 2);
    assert_eq!(executor.fluent("shut(front)").as_deref(), Some("true"));
    assert!(!executor.occur("slam(front)").unwrap(), "it is not possible again");
    assert!(executor.occur("slam(back)").unwrap());
    assert_eq!(robot.tick(&mut executor), GologOutcome::Succeeded);
}

#[test]
fn a_program_that_nothing_can_continue_fails() {
    let (mut executor, mut robot) =
        (executor("fluent p = false procedure main { test p }"), Robot::default());
    assert_eq!(robot.tick(&mut executor), GologOutcome::Failed);
}

#[test]
fn a_loop_of_tests_leaves_the_tick() {
    let text = "condition c procedure main { while true { test true } }";
    let (mut executor, mut robot) = (executor(text), Robot::default());
    robot.ticks(&mut executor, 200);
    assert_eq!(executor.steps(), 200 * 64);
}
