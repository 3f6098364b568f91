//! Limits of a person, a tool or a configuration: none bypasses the gate, Execute and Knowledge of a robot.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{Running, wait_for};

/// EXP1 in its own time.
const EXP1: [&str; 5] = ["run", "exp1", "--headless", "--rate", "1"];

/// Checks EXP1 with settings; the findings have all those words.
#[track_caller]
fn check_fails(running: &Running, sets: &[&str], words: &[&str]) {
    let mut arguments = vec!["check", "exp1"];
    sets.iter().for_each(|set| arguments.extend(["--set", set]));
    running.fails(7, &arguments, words);
}

#[test]
fn a_safe_command_is_within_the_limits_of_the_robot_model() {
    let running = Running::new("gates-safe");
    let safe = "robots.r2.actuators.wheels.safe={ left = 99.0, right = 0.0 }";
    check_fails(&running, &[safe], &["the safe `left` is out of the limits of the RobotModel"]);
}

fn x(running: &Running) -> f64 {
    running.read("exp1", "/simulator/r2/truth/x").as_f64().unwrap()
}

#[test]
fn nothing_drives_a_robot_past_its_gate_and_its_stop() {
    let mut running = Running::new("gates-command");
    running.start("exp1", &EXP1);
    wait_for("motion", || running.read("exp1", "/r2/wheels/command/left") != 0.0);
    let linked = ["is linked, from /r2/motors/wheels", "slate teleop", "slate goal"];
    running.fails(5, &["set", "simulator/r2/wheels", "{ left = 1.0, right = 1.0 }"], &linked);
    running.done(&["stop"]);
    running.done(&["unlink", "r2/motors/command"]);
    running.done(&["unlink", "simulator/r2/wheels"]);
    wait_for("standstill", || {
        let before = x(&running);
        std::thread::sleep(std::time::Duration::from_millis(100));
        x(&running) == before
    });
    let stands = x(&running);
    let speeds = "{ left = -8.1, right = -8.1 }";
    let past = "as it moves robot `r2` past its gate";
    running.fails(5, &["set", "r2/motors/command", speeds], &["`/r2/motors/command` can't be set", past]);
    running.fails(5, &["set", "simulator/r2/wheels", speeds], &["`/simulator/r2/wheels` can't be set", past]);
    let setting = "modules.\"r2/motors\".inputs.command={left=-8.1,right=-8.1}";
    running.fails(5, &["config", "set", setting], &["`/r2/motors/command` can't be set"]);
    let only = "only Execute reaches actuators, through their gates: `/simulator/r2/wheels`";
    running.fails(5, &["link", "simulator/r2/wheels", "simulator/r1/wheels"], &[only, "set by hand"]);
    let half = ["link", "simulator/r2/wheels", "r2/motors/wheels", "--when", "left > 1"];
    running.fails(5, &half, &["could withhold a stop"]);
    assert_eq!(x(&running), stands);
    running.done(&["link", "r2/motors/command", "r2/wheels/command"]);
    running.done(&["link", "simulator/r2/wheels", "r2/motors/wheels"]);

    let wheels = "modules.simulator.inputs.\"r2/wheels\"={left=3.0,right=3.0}";
    let cut = "links.\"simulator/r2/wheels\"=false";
    check_fails(&running, &[cut, wheels], &["`/simulator/r2/wheels` can't be set", past, "teleoperation"]);
    let command = "robots.r2.modules.motors.inputs.command={left=3.0,right=3.0}";
    check_fails(&running, &[command], &["`/r2/motors/command` can't be set"]);
}

#[test]
fn a_forbidden_link_into_a_block_is_refused_and_cuts_nothing() {
    let mut running = Running::new("gates-cut");
    running.start("exp1", &EXP1);
    let reads = || running.done(&["link", "r2/knowledge/position"]).contains("/r2/position/value  inferred");
    assert!(reads());
    let rule = "a Plan reads Analyzes, Knowledge and Execute's status: `/r2/planner/goal`";
    running.fails(5, &["link", "r2/planner/goal", "r2/knowledge/position"], &[rule, "of a Sensor"]);
    assert!(reads());
    let set = "robots.r2.links.\"planner/goal\"=\"position_monitor/position\"";
    check_fails(&running, &[set], &[rule, "of a Sensor"]);
}

#[test]
fn rules_of_reflexes_and_robot_model_are_set_in_knowledge_alone() {
    let mut running = Running::new("gates-rules");
    let rules = "robots.r2.modules.avoid_obstacle.inputs.rules={sensors=[{sensor=\"lidar\",distance=-5.0}]}";
    let says = ["`/r2/avoid_obstacle/rules` can't be set past Knowledge: `/r2/knowledge/rules` has it"];
    check_fails(&running, &[rules], &says);
    check_fails(&running, &[rules, "links.\"r2/avoid_obstacle/rules\"=false"], &says);
    let model = "robots.r2.modules.execute.inputs.robot={accuracy={position_stddev=1.0}}";
    check_fails(&running, &[model], &["`/r2/execute/robot` can't be set past Knowledge"]);
    running.start("exp1", &EXP1);
    running.done(&["unlink", "r2/avoid_obstacle/rules"]);
    running.fails(5, &["set", "r2/avoid_obstacle/rules", "{ avoid_obstacle = { sensors = [] } }"], &says);
    let past = "`/r2/avoid_obstacle/rules` can't be filled past Knowledge";
    running.done(&["unlink", "r2/avoid_wall/rules"]);
    let link = ["link", "r2/avoid_obstacle/rules", "r2/avoid_wall/rules"];
    running.fails(5, &link, &[past, "set by hand"]);
    running.done(&["link", "r2/avoid_obstacle/rules", "r2/knowledge/rules"]);
}

#[test]
fn no_tool_sends_actions_to_execute() {
    let mut running = Running::new("gates-actions");
    running.start("exp1", &EXP1);
    let reflex = "{ rank = 9, action = { kind = \"SetWheelSpeed\", arguments = [5, 5, 3] } }";
    let says = ["/r2/execute/reflexes takes messages of ReactiveModels alone", "slate teleop"];
    running.fails(5, &["send", "r2/execute/reflexes", reflex], &says);
    running.fails(5, &["send", "r2/execute/reflexes", reflex, "--dry-run"], &says);
    let plan = "{ action = { kind = \"SetWheelSpeed\", arguments = [5, 5, 3] } }";
    running.fails(
        5,
        &["send", "r2/execute/plan", plan],
        &["/r2/execute/plan takes messages of the Plan alone"],
    );
}
