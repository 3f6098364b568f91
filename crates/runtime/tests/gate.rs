//! Commands that an actuator receives.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use crate::common;

use std::sync::Arc;
use std::time::{Duration, Instant};

use common::hanging::{Hanging, Lags, hangs, read_by_a_module};
use common::{Number, complaint, load, lockstep, number};
use slate_blackboard::interface::Value;
use slate_module::Plugin;
use slate_module::aspect::{Actuators, Aspect};
use slate_module::prelude::*;
use slate_runtime::{Control, ControlsError, ExternalPorts, Mode, Options, Teleoperation};

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
fn no_command_bypasses_its_gate() {
    let text =
        complaint(&DRIVE.replace(r#""relay/input" = "wheel/command""#, r#""relay/input" = "driver/wheel""#));
    assert!(text.contains("has not passed its gate") && text.contains("<actuator>/command"), "{text}");
}

#[ports]
pub struct MotorIo {
    #[role("actuation")]
    speed: Input<Number>,
    seen: Output<Number>,
}

/// A driver.
pub struct Motor;

#[module(stage = ActExec)]
impl Module for Motor {
    type Io = MotorIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &MotorIo, _: &(), _: &Tick) -> Outcome {
        io.seen.set(io.speed.get().copied().unwrap_or_default());
        Outcome::Ok
    }
}

#[test]
fn an_input_past_a_gate_takes_nothing_from_outside() {
    let error = |text: &str| {
        let options = Options { rate: slate_runtime::Rate::Max, ..Options::default() };
        let agent = load(text, &[Plugin::linked::<Motor>()], options).unwrap();
        agent.composer().external_input("motor/speed").err()
    };
    let bare = "[modules.counter]\n[modules.driver]\n[modules.motor]\n[links]\n\"driver/input\" = \"counter/number\"\n";
    // Without a gate another program may drive, such as a node of ROS.
    assert_eq!(error(bare), None);
    let gate = format!("{bare}[actuators.wheel]\ncommand = \"driver/wheel\"\n");
    let refused = error(&gate).unwrap();
    assert!(refused.reason.contains("`/motor/speed` can't be set"), "{refused}");
    assert!(refused.reason.contains("past its gate") && !refused.help.is_empty(), "{refused}");
}

/// What a person at the controls says.
fn speed(value: f64) -> Value {
    Value::Table(vec![("value".into(), Value::Float(value))])
}

#[test]
fn a_person_at_the_controls_overrides_the_plan_until_release() {
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
fn command_of_disconnected_operator_expires() {
    let mut agent = lockstep(DRIVE);
    let mut controls = agent.composer().take_controls("wheel", "a test").unwrap();
    controls.command(&speed(-4.0)).unwrap();
    agent.step();
    assert_eq!(number(&agent, "wheel/command/value"), -4.0);
    std::thread::sleep(Teleoperation::COMMAND_DURATION);
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
    let text = controls.command(&Value::Table(Vec::new())).unwrap_err().to_string();
    assert!(text.contains("it lacks value"), "{text}");
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

/// A loop that hangs for 600 ms before the driver's step of a cycle, and for 400 ms after it.
const HANGING: &str = r#"
loop = { period = "5ms", hang = "3s" }
[modules.counter]
params = { hang_at = 40, hang_ms = 600 }
[modules.driver]
[modules.tail]
kind = "counter"
stage = "PostLoop"
params = { hang_at = 40, hang_ms = 400 }
[links]
"driver/input" = "counter/number"
[actuators.wheel]
command = "driver/wheel"
time_to_live = "100ms"
"#;

/// What another thread sees of the wheel's command, each with its time in milliseconds, until it was above 45.
fn seen_from_outside(mut meanwhile: impl FnMut(&slate_runtime::Composer, f64)) -> Vec<(u64, f64)> {
    let options = Options { armed: true, ..Options::default() };
    let mut agent = load(HANGING, &[], options).unwrap();
    let (composer, stopper) = (agent.composer(), agent.stopper());
    let board = Arc::clone(agent.board());
    let running = std::thread::spawn(move || agent.run(Box::new(|_| Control::Continue)));
    let (begin, mut seen) = (Instant::now(), Vec::new());
    while begin.elapsed() < Duration::from_secs(20) {
        let value = board.read("wheel/command/value").unwrap().and_then(|(value, _)| value.as_f64());
        let value = value.unwrap_or(0.0);
        seen.push((begin.elapsed().as_millis() as u64, value));
        meanwhile(&composer, value);
        if value > 45.0 {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    stopper.stop();
    running.join().unwrap().unwrap();
    seen
}

#[test]
fn time_to_live_holds_while_a_module_hangs_the_loop() {
    let seen = seen_from_outside(|_, _| {});
    let last = seen.iter().rposition(|(_, value)| *value == 39.0).expect("it drove until the hang");
    let renewed = seen.iter().position(|(_, value)| *value == 39.0).unwrap();
    // The gate's 100 ms, and what a busy machine may add.
    let held = seen[last].0 - seen[renewed].0;
    assert!(held < 500, "the command was seen for {held} ms");
    let back = seen.iter().position(|(_, value)| *value > 40.0).expect("it drives again");
    assert!(seen[back].0 - seen[last].0 > 600, "{:?}", &seen[last..=back]);
    // Also when the driver's step, which belongs to the time before the hang, came late.
    assert!(seen[last + 1..back].iter().all(|(_, value)| *value == 0.0), "{:?}", &seen[last..=back]);
}

#[test]
fn controls_given_back_end_while_the_loop_hangs() {
    let mut controls = None;
    let mut let_go = None;
    let begin = Instant::now();
    let seen = seen_from_outside(|composer, _| {
        // The loop hangs in its fortieth cycle.
        let cycles = composer.cycles();
        if (1..40).contains(&cycles) {
            let controls = controls.get_or_insert_with(|| composer.take_controls("wheel", "a test").unwrap());
            controls.command(&speed(-4.0)).unwrap();
        } else if let Some(mut controls) = controls.take() {
            controls.release();
            let_go = Some(begin.elapsed().as_millis() as u64);
        }
    });
    let last = seen.iter().filter(|(_, value)| *value == -4.0).map(|(at, _)| *at).max().unwrap();
    // The gate's 100 ms, and what a busy machine may add.
    let turned = last.saturating_sub(let_go.unwrap());
    assert!(turned < 400, "the wheel turned for {turned} ms more");
}

#[test]
fn time_to_live_holds_for_reader_on_another_thread() {
    let (hanging, mut lags) = (Hanging::start("", "", Mode::Staged), Lags::default());
    let enough = hanging.until("wheel/command/value", |at, command| {
        lags.see(at, command);
        lags.count() >= hangs()
    });
    assert!(enough, "it did not end so often");
    drop(hanging);
    lags.check("another thread");
}

#[test]
fn time_to_live_holds_for_module_on_its_own_thread() {
    read_by_a_module("", "a module on a thread of its own");
}

#[ports]
pub struct SluggishIo {
    wheel: Command<Number>,
    actuators: Aspect<Actuators>,
}

/// Commands two actuators, by its port and by name, and takes 150 ms for each step.
pub struct Sluggish;

#[module(stage = Act, every = "1ms")]
impl Module for Sluggish {
    type Io = SluggishIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SluggishIo, _: &(), _: &Tick) -> Outcome {
        io.wheel.send(Number { value: 3.0 }, Priority::Reflex);
        io.actuators.offer("arm", Priority::Reflex, &Number { value: 3.0 }).unwrap();
        std::thread::sleep(Duration::from_millis(150));
        Outcome::Ok
    }
}

const SLUGGISH: &str = r#"
loop = { period = "5ms", hang = "3s" }
[modules.sluggish]
[modules.counter]
[modules.driver]
enabled = false
[links]
"driver/input" = "counter/number"
[actuators.wheel]
command = "sluggish/wheel"
time_to_live = "50ms"
[actuators.arm]
command = "driver/wheel"
modules = ["sluggish"]
time_to_live = "50ms"
"#;

#[test]
fn command_older_than_time_to_live_is_dropped_in_each_mode() {
    for mode in [Mode::Staged, Mode::Threaded] {
        let options = Options { mode, armed: true, ..Options::default() };
        let mut agent = load(SLUGGISH, &[Plugin::linked::<Sluggish>()], options).unwrap();
        let (board, stopper) = (Arc::clone(agent.board()), agent.stopper());
        let running = std::thread::spawn(move || agent.run(Box::new(|_| Control::Continue)));
        let read = |path: &str| board.read(path).unwrap().and_then(|(value, _)| value.as_f64());
        for actuator in ["wheel", "arm"] {
            let begin = Instant::now();
            while read(&format!("{actuator}/gate/expired")).unwrap_or(0.0) < 2.0 {
                assert!(begin.elapsed() < Duration::from_secs(30), "no command to {actuator} is dropped");
                assert_eq!(read(&format!("{actuator}/command/value")).unwrap_or(0.0), 0.0, "{mode:?}");
                std::thread::sleep(Duration::from_millis(1));
            }
            assert_eq!(read(&format!("{actuator}/gate/passed")), Some(0.0), "{actuator}, {mode:?}");
        }
        stopper.stop();
        running.join().unwrap().unwrap();
    }
}
