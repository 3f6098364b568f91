//! What an actuator gets.

use crate::common;

use common::{complaint, lockstep, number};
use slate_blackboard::interface::Value;
use slate_runtime::{ControlsError, Teleoperation};

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
    agent.board().write("driver/enabled/value", &Value::Bool(false), 0).unwrap();
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

/// What a person at the controls says.
fn speed(value: f64) -> Value {
    Value::Table(vec![("value".into(), Value::Float(value))])
}

#[test]
fn a_person_at_the_controls_goes_before_the_plan_until_they_let_go() {
    let mut agent = lockstep(DRIVE);
    agent.step();
    let mut controls = agent.composer().take_controls("wheel", "a test").unwrap();
    controls.command(&speed(-4.0)).unwrap();
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), -4.0);
    assert_eq!(
        agent.board().read("wheel/gate/priority").unwrap().unwrap().0,
        Value::Text("TELEOPERATION".into())
    );
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), -4.0, "it is renewed in each cycle");
    controls.command(&speed(-40.0)).unwrap();
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), -5.0, "the limits hold for people too");
    controls.release();
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 5.0, "the plan has it again");
}

#[test]
fn a_command_of_a_person_who_is_gone_ends_by_itself() {
    let mut agent = lockstep(DRIVE);
    let mut controls = agent.composer().take_controls("wheel", "a test").unwrap();
    controls.command(&speed(-4.0)).unwrap();
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), -4.0);
    std::thread::sleep(Teleoperation::HOLD);
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    drop(controls);
}

#[test]
fn one_person_at_a_time_has_the_controls() {
    let agent = lockstep(DRIVE);
    let composer = agent.composer();
    let controls = composer.take_controls("wheel", "a test").unwrap();
    assert_eq!(
        composer.take_controls("wheel", "a test").unwrap_err(),
        ControlsError::Taken { name: "wheel".into(), by: "a test".into() }
    );
    drop(controls);
    let mut controls = composer.take_controls("wheel", "a test").unwrap();
    let text =
        controls.command(&Value::Table(vec![("speed".into(), Value::Float(1.0))])).unwrap_err().to_string();
    assert!(text.contains("speed"), "{text}");
    let text = composer.take_controls("arm", "a test").unwrap_err().to_string();
    assert!(text.contains("arm") && text.contains("wheel"), "{text}");
}

#[test]
fn a_stop_holds_against_a_person_too() {
    let mut agent = lockstep(DRIVE);
    agent.step();
    let mut controls = agent.composer().take_controls("wheel", "a test").unwrap();
    agent.stop_actuators("test");
    controls.command(&speed(3.0)).unwrap();
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    agent.reset();
    assert!(agent.arm());
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), 3.0);
}

#[test]
fn actuator_command_is_written_once_a_cycle() {
    let mut agent = lockstep(DRIVE);
    agent.step();
    let sequence =
        |agent: &slate_runtime::Agent| agent.board().read("wheel/command").unwrap().unwrap().1.sequence;
    let before = sequence(&agent);
    for _ in 0..10 {
        agent.step();
    }
    assert_eq!(sequence(&agent) - before, 10);
}
