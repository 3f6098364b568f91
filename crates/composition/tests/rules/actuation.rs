//! Commands that move a robot.

use super::scene::{allowed, catalogue, check, refused};

/// A driver of a robot of plain modules, and one of a robot with blocks.
const PLAIN: &str = r#"robots.r4.modules.base.kind="world""#;
const OWN: &str = r#"robots.r2.modules.base.kind="world""#;
/// No Sensor is left to choose between the simulator and that driver.
const GATE: &str = r#"robots.r4.actuators.wheels.command="/plain/wheels""#;

#[track_caller]
fn refused_all(sets: &[&str], parts: &[&str]) {
    let complaint = check(sets, &catalogue()).err().unwrap_or_else(|| panic!("{sets:?} should be refused"));
    for part in parts {
        assert!(complaint.contains(part), "no `{part}` for {sets:?} in\n{complaint}");
    }
}

#[track_caller]
fn allowed_all(sets: &[&str]) {
    check(sets, &catalogue()).unwrap_or_else(|complaint| panic!("{sets:?}: {complaint}"));
}

#[test]
fn nobody_sets_what_moves_a_robot_past_its_gate() {
    let command = r#"robots.r2.modules.motors.inputs.command={linear=1.0,angular=0.0}"#;
    let cut = r#"robots.r2.links."motors/command"=false"#;
    let says = ["`/r2/motors/command` can't be set, as it moves robot `r2` past its gate", "teleoperation"];
    refused_all(&[command], &says);
    refused_all(&[command, cut], &says);
    // Also where neither the driver nor its port is named after the robot.
    let wheels = r#"modules.simulator.inputs.wheels={linear=1.0,angular=0.0}"#;
    refused_all(&[wheels], &["`/simulator/wheels` can't be set", "a robot past its gate"]);
    let own = r#"robots.r2.modules.base.inputs.wheels={linear=1.0,angular=0.0}"#;
    refused_all(&[OWN, own], &["`/r2/base/wheels` can't be set"]);
    // A robot of plain modules: freely without a gate.
    let plain = r#"robots.r4.modules.base.inputs.wheels={linear=1.0,angular=0.0}"#;
    allowed_all(&[PLAIN, plain]);
    refused_all(&[PLAIN, plain, GATE], &["`/r4/base/wheels` can't be set", "\"/r4/wheels/command\""]);
}

#[test]
fn a_value_set_by_hand_moves_no_robot_through_a_link() {
    let only = "only Execute reaches actuators, through their gates";
    for from in ["/plain/speed", "/plain/twist"] {
        refused(&format!(r#"links."/simulator/wheels"="{from}""#), &[only, "to its gate"]);
        let own = format!(r#"links."/r2/base/wheels"="{from}""#);
        refused_all(&[OWN, &own], &[only, "\"/r2/wheels/command\""]);
        let plain = format!(r#"links."/r4/base/wheels"="{from}""#);
        allowed_all(&[PLAIN, &plain]);
        refused_all(&[PLAIN, &plain, GATE], &["only a gate reaches actuators: `/r4/base/wheels`"]);
    }
    // The input of another driver, and parts of values.
    refused_all(&[PLAIN, r#"links."/simulator/wheels"="/r4/base/wheels""#], &[only, "set by hand"]);
    refused(r#"links."/simulator/wheels/linear"="/plain/params/speed""#, &[only, "set by hand"]);
}

#[test]
fn a_robot_is_moved_by_its_own_gate() {
    let other = "robot `r2` is moved by its own gate: `/r2/base/wheels` can't read `/r4/wheels/command`, of another robot";
    let foreign = r#"links."/r2/base/wheels"="/r4/wheels/command""#;
    refused_all(&[OWN, PLAIN, GATE, foreign], &[other, "\"/r2/wheels/command\""]);
    let of_none =
        [OWN, r#"actuators.wheels.command="/plain/wheels""#, r#"links."/r2/base/wheels"="/wheels/command""#];
    refused_all(&of_none, &["robot `r2` is moved by its own gate"]);
    let command = r#"links."/r2/motors/command"="/r4/wheels/command""#;
    refused_all(&[PLAIN, GATE, command], &["`/r2/motors/command` can't read `/r4/wheels/command`"]);
    let actuator = r#"links."/r4/base/wheels"="/r2/motors/moved""#;
    refused_all(&[PLAIN, GATE, actuator], &["robot `r4` is moved by its own gate"]);
    for from in ["/r2/wheels/command", "/r2/motors/moved"] {
        allowed_all(&[OWN, &format!(r#"links."/r2/base/wheels"="{from}""#)]);
    }
    allowed_all(&[PLAIN, GATE, r#"links."/r4/base/wheels"="/r4/wheels/command""#]);
    // A driver between the gate and another one, of a robot of plain modules.
    let driver = r#"links."/plain/speed"="/r4/wheels/command""#;
    allowed_all(&[PLAIN, GATE, driver, r#"links."/r4/base/wheels"="/plain/twist""#]);
}

#[test]
fn blocks_of_no_robot_move_the_robot_that_a_port_names() {
    let blocks = [
        r#"modules.execute.kind="execute""#,
        r#"modules.motors.kind="motor""#,
        r#"actuators.wheels.command="execute/wheels""#,
        r#"links."/motors/command"="/wheels/command""#,
        PLAIN,
    ];
    let with = |from: &str| {
        let link = format!(r#"links."/r4/base/wheels"="{from}""#);
        let sets: Vec<&str> = blocks.iter().copied().chain([link.as_str()]).collect();
        check(&sets, &catalogue())
    };
    with("/motors/moved").unwrap();
    with("/wheels/command").unwrap();
    for from in ["/plain/twist", "/plain/speed"] {
        assert!(with(from).unwrap_err().contains("only Execute reaches actuators"), "{from}");
    }
}

#[test]
fn no_link_withholds_a_stop() {
    let says = ["`/simulator/wheels` moves a robot, and its link could withhold a stop", "without `every`"];
    for options in ["every=2", r#"when="linear > 0.1""#] {
        let link = format!(r#"links."/simulator/wheels"={{from="/r2/wheels/command",{options}}}"#);
        refused(&link, &says);
        let link = format!(r#"links."/r2/motors/command"={{from="/r2/wheels/command",{options}}}"#);
        refused(&link, &["`/r2/motors/command` moves robot `r2`, and its link could withhold a stop"]);
        let hop = format!(r#"links."/plain/speed"={{from="/r2/wheels/command",{options}}}"#);
        refused_all(&[&hop, r#"links."/simulator/wheels"="/plain/speed""#], &says);
    }
    allowed(r#"links."/simulator/wheels"={from="/r2/wheels/command",previous=true}"#);
}
