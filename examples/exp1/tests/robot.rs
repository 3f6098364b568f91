//! EXP1's robot with sensors that fail.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::blackboard::interface::Value;
use slate::interfaces::{Pose2, SonarScan, WheelSpeeds};
use slate::mapek::{self, ExecuteBlock, Planned, ReactiveBlock};
use slate::module::math;
use slate::module::testing::Fixture;
use slate::runtime::configuration::{self, Configuration, Database};
use slate::runtime::{Agent, ExternalPorts, Options, Rate};
use slate_avoidance::{ReflexRules, SensorRule};
use slate_wheeled::actions::Leg;
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::rules::WheeledRules;

fn with(sets: &[&str]) -> configuration::Options {
    configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    }
}

fn read(text: &str, sets: &[&str]) -> Configuration {
    Configuration::from_text("exp1.toml", text, &with(sets)).unwrap()
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

/// The model of a robot at (1, 0), which looks that way.
fn looking(theta: f64) -> WheeledModel {
    let mut model = WheeledModel::load("pioneer_p3dx", "vrep").unwrap();
    model.robot.pose = Pose2 { x: 1.0, y: 0.0, theta };
    model
}

/// An Execute with the action to go to the origin from (1, 0), heading away from it.
fn execute() -> Fixture<ExecuteBlock<DifferentialActions>> {
    let mut execute = Fixture::new();
    execute.set("robot", looking(0.0));
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
    execute.set("robot", looking(std::f64::consts::PI));
    execute.advance(20_000_000);
    execute.tick();
    let status = execute.output::<mapek::ExecuteStatus>("status").unwrap();
    assert_eq!(status.tree.as_str(), "GoToOrigin > SetWheelSpeed", "without a cycle in between");
    assert!(execute.output::<WheelSpeeds>("wheels").unwrap().left > 0.0);
}

#[test]
fn robot_without_pose_does_not_drive() {
    let mut execute = execute();
    execute.tick();
    execute.expire("robot");
    execute.advance(20_000_000);
    execute.tick();
    assert_eq!(execute.output::<WheelSpeeds>("wheels"), None);
}

#[test]
fn a_nan_scan_neither_starts_nor_ends_a_reflex() {
    let mut avoid = Fixture::<ReactiveBlock<AvoidObstacleModel>>::new();
    let rule = SensorRule { distance: 0.1, sensor: slate::module::Text::new("sonar") };
    let avoid_obstacle = ReflexRules {
        drive_distance: 0.2,
        linear_velocity: 0.3,
        sensors: slate::module::Sequence::new(&[rule]),
        ..ReflexRules::default()
    };
    let rules = WheeledRules { avoid_obstacle, ..WheeledRules::default() };
    let mut scan = SonarScan { range_max: 1.0, field_of_view: 0.5, ..SonarScan::default() };
    let echo = slate::interfaces::Echo { range: f64::NAN, heard: true.into() };
    scan.echoes = slate::module::Sequence::new(&[echo; 16]);
    scan.placements = slate::module::Sequence::new(&[slate::interfaces::SonarPlacement::default(); 16]);
    avoid.set("sonar", scan);
    avoid.set("rules", rules);
    avoid.set("robot", WheeledModel::load("pioneer_p3dx", "vrep").unwrap());
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
fn a_robot_without_sonars_or_rules_stops_in_its_second_cycle() {
    let off = "modules.\"r2/sonar\".enabled=false";
    let laws = ["controller=slate", "controller=rocs", "controller=rocs-fixed"];
    let without_rules = ["links.\"r2/avoid_obstacle/rules\"=false"];
    let all = laws.map(|law| vec![law, off]).into_iter().chain([without_rules.to_vec()]);
    for sets in all {
        let mut agent = agent(&sets);
        // In the first cycle Knowledge has not yet said which robot it is.
        agent.step();
        while agent.now() < 3_000_000_000 {
            agent.step();
            assert_eq!(number(&agent, "r2/wheels/command/left"), 0.0, "{sets:?}, {} ns", agent.now());
        }
    }
}

#[test]
fn bridges_fill_no_port_of_a_block_that_may_not_read_outside() {
    let agent = agent(&["links.\"simulator/r2/wheels\"=false", "links.\"r2/planner/goal\"=false"]);
    let composer = agent.composer();
    let rule = "a Plan reads Analyzes, Knowledge and Execute's status: `/r2/planner/goal` can't read another program";
    let error = composer.external_input("r2/planner/goal").unwrap_err();
    assert!(error.reason.contains(rule) && error.help.contains("let a Sensor"), "{error}");
    // A person may set it.
    assert_eq!(composer.hand_refusal("r2/planner/goal"), None);
}

#[test]
fn bridges_carry_no_command_that_has_not_passed_its_gate() {
    let agent = agent(&[]);
    let composer = agent.composer();
    let (reason, help) = composer.output_refusal("r2/execute/wheels").unwrap();
    assert_eq!(reason, "`/r2/execute/wheels` is a command that has not passed its gate");
    assert!(help.contains("`<actuator>/command`"), "{help}");
    assert_eq!(composer.output_refusal("r2/wheels/command"), None);
}

#[test]
fn a_running_robot_takes_no_other_description() {
    let database = Database::from_text("exp1.toml", slate_exp1::CONFIGURATION, with(&[])).unwrap();
    let plugins = [slate::sim::plugin(), slate_wheeled::plugin()];
    let options = Options { rate: Rate::Max, armed: true, ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins, options).unwrap();
    let mut steps = || (0..5).for_each(|_| assert!(agent.step()));
    steps();
    for (parameter, value, says) in [
        ("robot", "", "no robot is named; expected one of pioneer_p3dx, summit_xl"),
        ("robot", "nothing", "no description of a robot `nothing`"),
        ("robot", "summit_xl", "the RobotModel of `r2` is that of a `summit_xl`"),
        ("profile", "nonsense", "no sensor has a profile `nonsense`"),
    ] {
        let path = format!("modules.\"r2/knowledge\".params.{parameter}");
        let refused = database.set(&[(path, format!("\"{value}\""))]).unwrap_err().to_string();
        assert!(refused.contains(says), "{parameter} = `{value}`: {refused}");
        steps();
    }
    let text = |path: &str| {
        let value = agent.board().read(path).unwrap().map(|(value, _)| value);
        value.as_ref().and_then(Value::as_str).map(str::to_owned)
    };
    for path in ["r2/knowledge/params/robot", "r2/knowledge/robot/chassis/model"] {
        assert_eq!(text(path).as_deref(), Some("pioneer_p3dx"), "{path}");
    }
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
    // The odometry takes the place of the positioning system and of the compass: two devices are others.
    let text = slate_exp1::CONFIGURATION
        .replace(
            "position = { kind = \"simulated_position\" }",
            "position = { kind = \"odometry_position\", params = { start_x = 0.6, start_y = 0.8 } }",
        )
        .replace("simulated_orientation", "odometry_orientation");
    // Odometry drifts by some percent of the way.
    let mut agent = loaded(&text, &["world.layout=authors", "modules.referee.params.goal_tolerance=0.2"]);
    let (mut drift, mut steps) = (0.0_f64, 0);
    let state = |agent: &Agent| agent.board().read("referee/verdict/state").unwrap().map(|(value, _)| value);
    while state(&agent).as_ref().and_then(Value::as_str).is_none_or(|state| state == "RUNNING") {
        agent.step();
        steps += 1;
        if steps > 5 {
            let off = |axis: &str| {
                number(&agent, &format!("r2/position/value/{axis}"))
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
