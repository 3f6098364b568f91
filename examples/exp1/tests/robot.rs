//! EXP1's robot: it is wired as the typed builder would, and keeps its nerve when sensors fail.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::collections::BTreeSet;

use slate::blackboard::interface::Value;
use slate::interfaces::{Chassis, Orientation, Point2, Position, SonarScan, WheelSpeeds};
use slate::mapek::{self, ExecuteBlock, Planned, ReactiveBlock, Robot};
use slate::module::math;
use slate::module::testing::Fixture;
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Options, Rate};
use slate_wheeled::actions::Leg;
use slate_wheeled::analyzes::{PassOrientation, PassPosition, PassRange};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::avoid_wall::AvoidWallModel;
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::go_to_origin::GoToOriginPlanner;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledModel};
use slate_wheeled::monitors::{OrientationMonitor, PositionMonitor, RangeMonitor};

fn read(text: &str, sets: &[&str]) -> Configuration {
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report", "controller", "pace"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    };
    Configuration::from_text("exp1.toml", text, &options).unwrap()
}

fn agent(sets: &[&str]) -> Agent {
    loaded(slate_exp1::CONFIGURATION, sets)
}

fn loaded(text: &str, sets: &[&str]) -> Agent {
    let plugins = [slate::sim::plugin(), slate_wheeled::plugin()];
    let options = Options { rate: Rate::Max, armed: true, ..Options::default() };
    Agent::load(&read(text, sets), &plugins, options).unwrap()
}

fn number(agent: &Agent, path: &str) -> f64 {
    agent.board().read(path).unwrap().and_then(|(value, _)| value.as_f64()).unwrap()
}

#[test]
fn the_configuration_says_what_the_typed_builder_says() {
    let robot = Robot::new("r2");
    let range_monitor = robot.monitor::<RangeMonitor>("range_monitor");
    let position_monitor = robot.monitor::<PositionMonitor>("position_monitor");
    let orientation_monitor = robot.monitor::<OrientationMonitor>("orientation_monitor");
    let pass_range = robot.analyze::<PassRange>("pass_range");
    let pass_position = robot.analyze::<PassPosition>("pass_position");
    let pass_orientation = robot.analyze::<PassOrientation>("pass_orientation");
    let planner = robot.plan::<GoToOriginPlanner>("planner");
    let execute = robot.execute::<DifferentialActions>("execute");
    let avoid_obstacle = robot.reactive::<AvoidObstacleModel>("avoid_obstacle");
    let avoid_wall = robot.reactive::<AvoidWallModel>("avoid_wall");
    let knowledge = robot.knowledge::<WheeledKnowledge>("knowledge");
    let (sonar, position, orientation) =
        ("/simulator/r2/sonar", "/simulator/r2/position", "/simulator/r2/orientation");
    range_monitor.watch("sonar", sonar);
    position_monitor.watch("position", position);
    orientation_monitor.watch("orientation", orientation);
    range_monitor.attach(&pass_range);
    position_monitor.attach(&pass_position);
    orientation_monitor.attach(&pass_orientation);
    pass_range.attach(&planner);
    pass_position.attach(&planner);
    pass_orientation.attach(&planner);
    planner.watch("goal", "knowledge/goal");
    avoid_wall.watch("sonar", sonar);
    avoid_obstacle.watch("sonar", sonar);
    avoid_obstacle.watch("position", position);
    avoid_obstacle.watch("orientation", orientation);
    avoid_obstacle.watch("goal", "knowledge/goal");
    avoid_obstacle.watch("robot", "knowledge/robot");
    execute.watch("position", position);
    execute.watch("orientation", orientation);
    execute.watch("robot", "knowledge/robot");
    knowledge.watch("position", position);
    knowledge.watch("orientation", orientation);
    knowledge.watch("chassis", "/simulator/r2/chassis");
    let built: BTreeSet<_> = robot
        .build()
        .unwrap()
        .links
        .into_iter()
        .map(|(to, from)| {
            let from = if from.starts_with('/') { from } else { format!("/r2/{from}") };
            (format!("r2/{to}"), from)
        })
        .collect();
    let configured: BTreeSet<_> = agent(&[])
        .composer()
        .links()
        .into_iter()
        .filter(|link| link.to.starts_with("r2/"))
        .map(|link| (link.to, link.from))
        .collect();
    assert_eq!(built, configured);
}

/// The body that the simulator tells of.
fn chassis() -> Chassis {
    let described = slate::sim::robot::RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    described.chassis()
}

/// An Execute that is told to go to the origin from (1, 0), looking away from it.
fn execute() -> Fixture<ExecuteBlock<DifferentialActions>> {
    let mut execute = Fixture::new();
    execute.set("position", Position { x: 1.0, y: 0.0, z: 0.0 });
    execute.set("orientation", Orientation { theta: 0.0 });
    execute.set("robot", WheeledModel { chassis: chassis(), ..WheeledModel::default() });
    let action = <slate_wheeled::actions::GoToOrigin as mapek::ActionKind>::request(Leg {
        x: 0.0,
        y: 0.0,
        speed: 0.4,
        tolerance: 0.05,
    });
    execute.push("plan", Planned { ticket: 1, action, ..Planned::default() });
    execute
}

#[test]
fn going_to_the_origin_decomposes_as_in_table_2() {
    let mut execute = execute();
    execute.tick();
    let status = execute.output::<mapek::ExecuteStatus>("status").unwrap();
    assert_eq!(status.tree.as_str(), "GoToOrigin > TurnToOrigin > TurnAngle");
    let wheels = execute.output::<WheelSpeeds>("wheels").unwrap();
    assert!(wheels.left == -wheels.right && wheels.left != 0.0, "it turns on the spot: {wheels:?}");
    execute.set("orientation", Orientation { theta: std::f64::consts::PI });
    execute.advance(20_000_000);
    execute.tick();
    let status = execute.output::<mapek::ExecuteStatus>("status").unwrap();
    assert_eq!(status.tree.as_str(), "GoToOrigin > SetWheelSpeed", "without a cycle in between");
    assert!(execute.output::<WheelSpeeds>("wheels").unwrap().left > 0.0);
}

#[test]
fn who_does_not_know_where_it_is_does_not_drive() {
    let mut execute = execute();
    execute.tick();
    execute.expire("position");
    execute.advance(20_000_000);
    execute.tick();
    assert_eq!(execute.output::<WheelSpeeds>("wheels"), None);
}

#[test]
fn a_nan_scan_neither_starts_nor_ends_a_reflex() {
    let mut avoid = Fixture::<ReactiveBlock<AvoidObstacleModel>>::new();
    let mut scan = SonarScan { range_max: 1.0, field_of_view: 0.5, ..SonarScan::default() };
    let echo = slate::interfaces::Echo { range: f64::NAN, heard: true.into() };
    scan.echoes = slate::module::Sequence::new(&[echo; 16]);
    scan.placements = slate::module::Sequence::new(&[slate::interfaces::SonarPlacement::default(); 16]);
    avoid.set("sonar", scan);
    avoid.set("position", Position { x: f64::NAN, y: 0.0, z: 0.0 });
    avoid.set("orientation", Orientation { theta: 0.0 });
    avoid.set("goal", Point2 { x: 0.0, y: 0.0 });
    avoid.set("robot", WheeledModel { chassis: chassis(), ..WheeledModel::default() });
    avoid.tick();
    for reflex in avoid.sent::<mapek::Reflex>("reflex") {
        assert!(reflex.action.arguments.iter().all(|argument| argument.is_finite()), "{reflex:?}");
    }
}

#[test]
fn a_sensor_that_stops_stops_the_robot_and_both_come_back() {
    let mut agent = agent(&[]);
    let run = |agent: &mut Agent, seconds: f64| {
        for _ in 0..(seconds * 50.0) as usize {
            agent.step();
        }
    };
    run(&mut agent, 3.0);
    // The simulator is switched off, so nothing is measured any more.
    agent.board().write("simulator/enabled/value", &Value::Bool(false), 0).unwrap();
    run(&mut agent, 0.5);
    assert_eq!(number(&agent, "r2/wheels/command/left"), 0.0);
    assert_eq!(number(&agent, "r2/wheels/command/right"), 0.0);
    agent.board().write("simulator/enabled/value", &Value::Bool(true), 0).unwrap();
    run(&mut agent, 60.0);
    let verdict = agent.board().read("referee/verdict/state").unwrap().unwrap().0;
    assert_eq!(verdict.as_str(), Some("SUCCEEDED"));
}

#[test]
fn a_reflex_clears_the_plan_which_is_made_anew() {
    let mut agent = agent(&[]);
    let mut replanned = false;
    for _ in 0..2000 {
        agent.step();
        let route = agent.board().read("r2/execute/status/route").unwrap().map(|(value, _)| value);
        let epoch = number(&agent, "r2/execute/status/epoch");
        replanned |= epoch > 0.0 && route.as_ref().and_then(Value::as_str) == Some("DELIBERATIVE");
    }
    assert!(replanned, "after a reflex the plan had the robot again");
    assert!(number(&agent, "r2/execute/status/cancelled") > 0.0);
}

#[test]
fn twenty_seeds_reach_the_goal_and_cause_no_contact() {
    for seed in 1..=20 {
        let mut agent = agent(&[&format!("agent.seed={seed}")]);
        let state =
            |agent: &Agent| agent.board().read("referee/verdict/state").unwrap().map(|(value, _)| value);
        while state(&agent).as_ref().and_then(Value::as_str).is_none_or(|state| state == "RUNNING") {
            agent.step();
        }
        assert_eq!(state(&agent).as_ref().and_then(Value::as_str), Some("SUCCEEDED"), "seed {seed}");
        assert_eq!(number(&agent, "referee/metrics/collisions_caused"), 0.0, "seed {seed}");
    }
}

#[test]
fn odometry_alone_reaches_the_goal_with_unchanged_blocks() {
    // The odometry takes the place of the positioning system and of the compass, whoever reads them.
    let modules = "odometry_monitor = {}\nlocalize = { params = { start_x = 0.6, start_y = 0.8 } }\n";
    let mut links = String::new();
    for (sensor, monitor) in [("position", "position_monitor"), ("orientation", "orientation_monitor")] {
        for reader in [monitor, "avoid_obstacle", "knowledge", "execute"] {
            links += &format!("\"{reader}/{sensor}\" = \"localize/{sensor}\"\n");
        }
    }
    let text = slate_exp1::CONFIGURATION.replace(
        "[robots.r2.modules]\n",
        &format!("[robots.r2.links]\n{links}[robots.r2.modules]\n{modules}"),
    );
    // Odometry drifts by some percent of the way.
    let mut agent = loaded(&text, &["world.layout=authors", "modules.referee.params.goal_tolerance=0.2"]);
    let (mut drift, mut steps) = (0.0_f64, 0);
    let state = |agent: &Agent| agent.board().read("referee/verdict/state").unwrap().map(|(value, _)| value);
    while state(&agent).as_ref().and_then(Value::as_str).is_none_or(|state| state == "RUNNING") {
        agent.step();
        steps += 1;
        if steps > 5 {
            let off = |axis: &str| {
                number(&agent, &format!("r2/localize/position/{axis}"))
                    - number(&agent, &format!("simulator/r2/truth/{axis}"))
            };
            drift = math::max(drift, math::hypot(off("x"), off("y")));
        }
    }
    assert_eq!(state(&agent).as_ref().and_then(Value::as_str), Some("SUCCEEDED"));
    assert!(
        drift > 0.001 && drift < 0.2,
        "it is the odometry that it goes by, and that is not exact: {drift}"
    );
}
