//! The software stop of an agent that runs: what is said, what the actuators get, and what is refused.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod common;

use std::time::Duration;

use common::Running;

const STOPPED: &str = "all actuators are stopped, until `slate reset` and `slate arm`\n";

fn wheels(running: &Running) -> [f64; 2] {
    let command = running.read("exp1", "/r2/wheels/command");
    ["left", "right"].map(|side| command[side].as_f64().unwrap())
}

fn mode(running: &Running) -> String {
    running.read("exp1", "/r2/wheels/gate")["mode"].as_str().unwrap().into()
}

/// Whether it comes to be so within some seconds.
fn soon(mut so: impl FnMut() -> bool) -> bool {
    (0..1000).any(|_| {
        std::thread::sleep(Duration::from_millis(10));
        so()
    })
}

/// Waits until the robot drives.
#[track_caller]
fn drives(running: &Running) {
    assert!(soon(|| wheels(running) != [0.0; 2]), "it stands: {}", mode(running));
}

/// That the robot stands, now and for a while.
#[track_caller]
fn stands(running: &Running, how: &str) {
    for _ in 0..20 {
        assert_eq!((wheels(running), mode(running).as_str()), ([0.0; 2], how));
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_stopped_robot_stands_until_it_is_reset_and_armed() {
    let mut running = Running::new("stop");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    drives(&running);
    assert_eq!(running.done(&["stop", "a child ran by"]), STOPPED);
    stands(&running, "STOPPED");
    let log = || running.read("exp1", "/log/tail").to_string();
    assert!(soon(|| log().contains("the actuators are stopped: a child ran by")), "{}", log());
    for arm in [&["arm"][..], &["arm", "r2/wheels"]] {
        let words = ["still stopped: `r2/wheels` (a child ran by)", "`slate reset`, then `slate arm`"];
        running.fails(5, arm, &words);
    }
    // What stopped it first is why it stands.
    assert_eq!(running.done(&["stop"]), STOPPED);
    running.fails(5, &["arm"], &["a child ran by"]);
    stands(&running, "STOPPED");

    assert_eq!(running.done(&["reset"]), "the stop is over; `slate arm` lets commands through\n");
    // It is shown with the next cycle.
    assert!(soon(|| mode(&running) == "DISARMED"));
    stands(&running, "DISARMED");
    assert!(running.done(&["reset"]).contains("no actuator was stopped"));
    stands(&running, "DISARMED");
    running.fails(4, &["arm", "r2/whels"], &["no actuator is called `r2/whels`", "did you mean r2/wheels?"]);
    running.fails(4, &["arm", "gripper"], &["no actuator is called `gripper`"]);
    stands(&running, "DISARMED");
    assert_eq!(running.done(&["arm", "r2/wheels"]), "r2/wheels is armed\n");
    drives(&running);

    // A reset of what is not stopped disarms nothing.
    assert!(running.done(&["reset"]).contains("no actuator was stopped"));
    drives(&running);
    assert_eq!(running.done(&["stop", "--agent", "exp1"]), STOPPED);
    running.done(&["reset", "--agent", "exp1"]);
    assert_eq!(running.done(&["arm", "--agent", "exp1"]), "the actuators are armed\n");
    drives(&running);
    running.fails(3, &["stop", "--agent", "exp7"], &["no agent `exp7`", "there are: exp1"]);
    drives(&running);
}

#[test]
fn without_an_agent_there_is_nothing_to_stop() {
    let running = Running::new("nobody");
    for command in ["stop", "reset", "arm"] {
        running.fails(3, &[command], &["no agent runs here", "slate run"]);
        running.fails(3, &[command, "--agent", "exp1"], &["no agent `exp1`", "slate run"]);
    }
}
