//! What an actuator gets.

mod common;

use common::{complaint, lockstep, number};

const DRIVE: &str = r#"
[modules.counter]
[modules.driver]
[modules.relay]
[links]
"driver/input" = "counter/number"
"relay/input" = "wheel/command"
[actuators.wheel]
command = "driver/wheel"
limits = { value = [-5.0, 5.0] }
"#;

#[test]
fn a_command_within_its_limits_passes() {
    let mut agent = lockstep(DRIVE);
    agent.step();
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 2.0);
}

#[test]
fn a_command_out_of_limits_is_held_at_the_limit() {
    let mut agent = lockstep(DRIVE);
    for _ in 0..9 {
        agent.step();
    }
    assert_eq!(number(&agent, "counter/number/value"), 9.0);
    assert_eq!(number(&agent, "wheel/command/value"), 5.0);
    assert_eq!(number(&agent, "wheel/gate/limited"), 4.0);
}

#[test]
fn a_sensor_that_returns_nan_leaves_the_actuator_safe() {
    let mut agent = lockstep(&DRIVE.replace("[modules.counter]", "[modules.counter]\nparams.nan_at = 2"));
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 1.0);
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 3.0);
}

#[test]
fn a_command_that_is_not_renewed_ends_within_a_tick() {
    let mut agent = lockstep(DRIVE);
    agent.step();
    agent.board().write("driver/enabled/value", &slate_blackboard::interface::Value::Bool(false), 0).unwrap();
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
}

#[test]
fn a_stop_holds_until_reset_and_arming() {
    let mut agent = lockstep(DRIVE);
    agent.step();
    agent.stop_actuators("test");
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    agent.reset();
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 0.0, "a reset alone arms nothing");
    assert!(agent.arm());
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 4.0);
}

#[test]
fn a_limit_on_a_field_that_is_not_there_is_refused() {
    let text = complaint(&DRIVE.replace("value = [", "speed = ["));
    assert!(text.contains("test.toml") && text.contains("speed") && text.contains("value"), "{text}");
}

#[test]
fn nobody_gets_a_command_past_its_gate() {
    let text =
        complaint(&DRIVE.replace(r#""relay/input" = "wheel/command""#, r#""relay/input" = "driver/wheel""#));
    assert!(text.contains("has not passed its gate") && text.contains("<actuator>/command"), "{text}");
}
