//! What a robot that was put together says.

use crate::common;

use slate_mapek::{BuildError, Robot, Wiring};

use common::{Actions, AvoidNear, NearMonitor, Wanderer, WayIsFree};

fn names(wiring: &Wiring) -> Vec<(&str, &str)> {
    wiring.modules.iter().map(|(name, kind)| (name.as_str(), kind.name())).collect()
}

#[test]
fn a_robot_says_what_its_configuration_would() {
    let robot = Robot::new("r2");
    let monitor = robot.monitor::<NearMonitor>("near");
    let analyze = robot.analyze::<WayIsFree>("way");
    let plan = robot.plan::<Wanderer>("planner");
    robot.execute::<Actions>("execute");
    let avoid = robot.reactive::<AvoidNear>("avoid");
    monitor.attach(&analyze);
    analyze.attach(&plan);
    monitor.watch("range", "sonar/value");
    avoid.watch("range", "sonar/value");
    let wiring = robot.build().unwrap();
    assert_eq!(wiring.name, "r2");
    let modules = [
        ("near", "near_monitor"),
        ("way", "way_is_free"),
        ("planner", "wanderer"),
        ("execute", "execute"),
        ("avoid", "avoid_near"),
    ];
    assert_eq!(names(&wiring), modules);
    let links = [
        ("way/near", "near/percept"),
        ("planner/free", "way/change"),
        ("near/range", "sonar/value"),
        ("avoid/range", "sonar/value"),
        ("execute/plan", "planner/plan"),
        ("planner/situation", "execute/status"),
        ("execute/reflexes", "avoid/reflex"),
    ];
    let own: Vec<_> = wiring.links.iter().map(|(to, from)| (to.as_str(), from.as_str())).collect();
    assert_eq!(own, links);
}

#[test]
fn a_second_plan_is_an_error() {
    let robot = Robot::new("r2");
    robot.plan::<Wanderer>("planner");
    robot.plan::<Wanderer>("another");
    let error = robot.build().unwrap_err();
    assert_eq!(error.to_string(), "robot `r2` has one Plan, and `planner` is it already; remove `another`");
}

#[test]
fn a_second_execute_is_an_error() {
    let robot = Robot::new("r2");
    robot.execute::<Actions>("execute");
    robot.execute::<Actions>("another");
    assert!(matches!(robot.build(), Err(BuildError::Second { part: "Execute", .. })));
}

#[test]
fn actions_without_an_execute_are_an_error() {
    let robot = Robot::new("r2");
    robot.reactive::<AvoidNear>("avoid");
    let error = robot.build().unwrap_err();
    assert_eq!(error.to_string(), "robot `r2` has no Execute, which `avoid` needs");
}

#[test]
fn two_modules_of_one_name_are_an_error() {
    let robot = Robot::new("r2");
    robot.monitor::<NearMonitor>("near");
    robot.analyze::<WayIsFree>("near");
    assert!(matches!(robot.build(), Err(BuildError::SameName { name, .. }) if name == "near"));
}

#[test]
fn two_monitors_on_one_port_are_an_error() {
    let robot = Robot::new("r2");
    let analyze = robot.analyze::<WayIsFree>("way");
    robot.monitor::<NearMonitor>("left").attach(&analyze);
    robot.monitor::<NearMonitor>("right").attach(&analyze);
    let error = robot.build().unwrap_err();
    assert_eq!(
        error.to_string(),
        "robot `r2`: `way/near` reads `left/percept` already and can't read `right/percept` too"
    );
}
