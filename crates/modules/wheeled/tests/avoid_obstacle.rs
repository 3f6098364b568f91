//! The reflex that avoids obstacles: a turn and a drive by the newest measurements and the rules.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::interfaces::{
    Echo, Odometry, Orientation, Pose2, Position, Sighting, Sightings, SonarPlacement, SonarScan, Twist2,
    WheelSpeeds,
};
use slate::mapek::{
    ActionKind, Device, DeviceHealth, ExecuteBlock, ExecuteStatus, KnowledgeBlock, ReactiveBlock, Reflex,
};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, Text};
use slate::sim::robot::RobotDescription;
use slate_avoidance::SensorRule;
use slate_wheeled::actions::{AvoidObstacle, Evasion, Turn, TurnAngle};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::rules::WheeledRules;

fn pioneer() -> WheeledModel {
    WheeledModel::load("pioneer_p3dx", "vrep").unwrap()
}

fn rule(sensor: &str, distance: f64) -> SensorRule {
    SensorRule { distance, sensor: Text::new(sensor) }
}

fn rules(sensors: &[SensorRule]) -> WheeledRules {
    let sensor_rules = Sequence::new(sensors);
    WheeledKnowledgeParams { sensor_rules, ..WheeledKnowledgeParams::default() }.rules()
}

/// The sonars of a Pioneer, of which these hear something at that range.
fn scan(heard: &[(usize, f64)]) -> SonarScan {
    let robot = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    let placements: Vec<_> = robot.sonar["vrep"]
        .placements
        .iter()
        .map(|[x, y, degrees]| SonarPlacement { x: *x, y: *y, theta: degrees.to_radians() })
        .collect();
    let mut echoes = [Echo { range: 1.0, ..Echo::default() }; 16];
    for (sonar, range) in heard {
        echoes[*sonar] = Echo { range: *range, heard: Bool::from(true) };
    }
    SonarScan {
        field_of_view: std::f64::consts::FRAC_PI_6,
        range_min: 0.0,
        range_max: 1.0,
        placements: Sequence::new(&placements),
        echoes: Sequence::new(&echoes),
    }
}

/// Angle and wheels of the reflex of a robot that stands, if there is one.
fn react(scan: SonarScan, rules: WheeledRules, robots: Option<Sightings>) -> Option<[f64; 3]> {
    react_at(scan, rules, robots, 0.0)
}

/// The same at a velocity, m/s.
fn react_at(
    scan: SonarScan,
    rules: WheeledRules,
    robots: Option<Sightings>,
    velocity: f64,
) -> Option<[f64; 3]> {
    react_in_motion(scan, rules, robots, Twist2 { linear: velocity, angular: 0.0 })
}

/// The same in any motion.
fn react_in_motion(
    scan: SonarScan,
    rules: WheeledRules,
    robots: Option<Sightings>,
    twist: Twist2,
) -> Option<[f64; 3]> {
    let mut model = Fixture::<ReactiveBlock<AvoidObstacleModel>>::new();
    model.set("odometry", Odometry { twist, ..Odometry::default() });
    model.set("robot", pioneer());
    model.set("rules", rules);
    model.set("sonar", scan);
    if let Some(robots) = robots {
        model.set("robots", robots);
    }
    model.tick();
    let sent = model.sent::<Reflex>("reflex");
    let arguments = sent.last()?.action.arguments;
    Some([arguments[0], arguments[1], arguments[2]])
}

const SONAR: &str = "sonar";

#[test]
fn it_turns_away_from_the_side_with_the_echo_and_drives_on() {
    let only_sonar = rules(&[rule(SONAR, 0.1)]);
    // The sonars at 10 and 30 degrees to the left, and the same on the right.
    let [right, left_wheel, right_wheel] = react(scan(&[(2, 0.1), (3, 0.09)]), only_sonar, None).unwrap();
    assert!(right < -0.1 && left_wheel > 0.0 && left_wheel == right_wheel, "{right} {left_wheel}");
    let [left, ..] = react(scan(&[(4, 0.09), (5, 0.1)]), only_sonar, None).unwrap();
    assert!(left > 0.1, "{left}");
    assert_eq!(react(scan(&[(2, 0.4), (3, 0.4)]), only_sonar, None), None, "that is far away");
    let farther = rules(&[rule(SONAR, 0.45)]);
    assert!(react(scan(&[(2, 0.4), (3, 0.4)]), farther, None).is_some(), "by the rule it is near");
    assert_eq!(react(scan(&[(3, 0.09)]), rules(&[]), None), Some([0.0; 3]), "without a rule it stands");
}

#[test]
fn echo_at_the_minimum_range_counts_as_nearer() {
    let only_sonar = rules(&[rule(SONAR, 0.1)]);
    // The sonars behind hear nothing that is nearer than 0.1 m.
    let behind = |range: f64| SonarScan { range_min: 0.1, ..scan(&[(11, range), (12, range)]) };
    assert_eq!(react(behind(0.11), only_sonar, None), None, "it is that far away");
    let [angle, left, right] = react(behind(0.1), only_sonar, None).unwrap();
    assert!(angle == 0.0 && left > 0.0 && left == right, "it may almost touch: {angle} {left} {right}");
}

#[test]
fn without_memory_the_same_measurements_give_the_same_reflex() {
    let mut model = Fixture::<ReactiveBlock<AvoidObstacleModel>>::new();
    let mut answers = Vec::new();
    for near in [true, false, true] {
        model.set("robot", pioneer());
        model.set("rules", rules(&[rule(SONAR, 0.1)]));
        model.set("sonar", scan(if near { &[(2, 0.1), (3, 0.09)] } else { &[] }));
        model.advance(20_000_000);
        model.tick();
        answers.push(model.sent::<Reflex>("reflex").last().map(|reflex| reflex.action));
    }
    assert!(answers[0].is_some() && answers[0] == answers[2], "{answers:?}");
    assert_eq!(answers[1], None, "what was heard before is forgotten");
}

#[test]
fn a_sensor_that_stops_counts_as_near() {
    let mut model = Fixture::<ReactiveBlock<AvoidObstacleModel>>::new();
    model.set("robot", pioneer());
    model.set("rules", rules(&[rule(SONAR, 0.1)]));
    model.set("sonar", scan(&[]));
    model.tick();
    assert!(model.sent::<Reflex>("reflex").is_empty(), "nothing is near");
    model.advance(300_000_000);
    model.tick();
    let stop = model.sent::<Reflex>("reflex").last().unwrap().action;
    assert_eq!(&stop.arguments[..3], [0.0, 0.0, 0.0], "it stands");
    let both = rules(&[rule(SONAR, 0.1), rule("robot_sensor", 0.4)]);
    assert_eq!(react(scan(&[]), both, None), Some([0.0; 3]), "no robot sensor, no motion");
    assert_eq!(react(scan(&[]), both, Some(Sightings::default())), None);
}

#[test]
fn an_unknown_outline_or_stopped_encoders_make_the_robot_safe() {
    let mut model = Fixture::<ReactiveBlock<AvoidObstacleModel>>::new();
    model.set("robot", WheeledModel::default());
    model.set("rules", rules(&[rule(SONAR, 0.1)]));
    model.set("sonar", scan(&[]));
    model.tick();
    let stop = model.sent::<Reflex>("reflex").last().unwrap().action;
    assert_eq!(&stop.arguments[..3], [0.0, 0.0, 0.0], "without an outline it stands");
    // An echo beyond the threshold of a robot that stands, within that of the fastest one.
    let echo = scan(&[(3, 0.3), (4, 0.3)]);
    model.set("robot", pioneer());
    model.set("odometry", Odometry::default());
    model.set("sonar", echo);
    model.tick();
    assert!(model.sent::<Reflex>("reflex").is_empty());
    model.advance(500_000_000);
    model.set("sonar", echo);
    model.tick();
    let stop = model.sent::<Reflex>("reflex").last().unwrap().action;
    assert_eq!(&stop.arguments[..3], [0.0, 0.0, 0.0], "encoders that stop count as an obstacle that is near");
}

#[test]
fn encoders_that_never_measured_may_hide_any_speed() {
    let reflexes = |has_odometry: bool| {
        let mut model = Fixture::<ReactiveBlock<AvoidObstacleModel>>::new();
        model.set("robot", pioneer());
        model.set("rules", rules(&[rule(SONAR, 0.1)]));
        if has_odometry {
            model.set("odometry", Odometry::default());
        }
        model.set("sonar", scan(&[(3, 0.3), (4, 0.3)]));
        model.tick();
        model.sent::<Reflex>("reflex").len()
    };
    assert_eq!((reflexes(true), reflexes(false)), (0, 1));
}

#[test]
fn a_late_sensor_is_near_until_it_measures_in_time_again() {
    let reflexes = |health: DeviceHealth| {
        let mut model = Fixture::<ReactiveBlock<AvoidObstacleModel>>::new();
        let mut robot = pioneer();
        robot.robot.sensors =
            Sequence::new(&[Device { name: Text::new(SONAR), health, ..Device::default() }]);
        model.set("robot", robot);
        model.set("rules", rules(&[rule(SONAR, 0.1)]));
        model.set("odometry", Odometry::default());
        model.set("sonar", scan(&[]));
        model.tick();
        model.sent::<Reflex>("reflex").len()
    };
    assert_eq!(reflexes(DeviceHealth::FRESH), 0);
    assert_eq!(reflexes(DeviceHealth::LATE), 1, "with each measurement it would drive on for a moment");
}

#[test]
fn it_stops_for_a_robot_ahead() {
    let both = rules(&[rule(SONAR, 0.1), rule("robot_sensor", 0.4)]);
    let sees = |range, bearing, velocity| {
        let seen = Sighting { range, bearing, name: Text::new("r1") };
        react_at(scan(&[]), both, Some(Sightings { list: Sequence::new(&[seen]) }), velocity)
    };
    assert_eq!(sees(0.8, 0.0, 0.1), Some([0.0; 3]));
    assert_eq!(sees(0.8, 1.6, 0.1), None, "that is beside");
    assert_eq!(sees(1.5, 0.0, 0.1), None, "that is far away");
    assert_eq!(sees(1.5, 0.0, 3.0), Some([0.0; 3]), "for a fast robot it is not");
    assert_eq!(sees(f64::NAN, 0.0, 0.1), None);
    for velocity in [0.0, -0.2] {
        assert_eq!(sees(0.8, 0.0, velocity), None, "it may back off");
    }
    assert_eq!(sees(0.8, 3.1, -0.1), Some([0.0; 3]), "not towards another one");
}

#[test]
fn it_stops_for_a_robot_that_its_outline_sweeps() {
    let both = rules(&[rule(SONAR, 0.1), rule("robot_sensor", 0.25)]);
    let turns = |angular| {
        let behind = Sighting { range: 0.58, bearing: 2.094, name: Text::new("r1") };
        let robots = Some(Sightings { list: Sequence::new(&[behind]) });
        react_in_motion(scan(&[]), both, robots, Twist2 { linear: 0.0, angular })
    };
    assert_eq!(turns(-2.0), Some([0.0; 3]), "its back swings to the robot behind on the left");
    assert_eq!(turns(2.0), None, "it swings away");
    assert_eq!(turns(0.0), None, "it stands");
}

#[test]
fn wrong_rules_are_refused_with_the_place_of_the_rule() {
    let with = |rules: &[SensorRule]| {
        let params = WheeledKnowledgeParams {
            robot: Text::new("pioneer_p3dx"),
            sensor_rules: Sequence::new(rules),
            ..WheeledKnowledgeParams::default()
        };
        Fixture::<KnowledgeBlock<WheeledKnowledge>>::with(params)
    };
    let refused = |rules: &[SensorRule], words: &[&str]| {
        let text = with(rules).err().unwrap().to_string();
        assert!(words.iter().all(|word| text.contains(word)), "{words:?}: {text}");
    };
    refused(
        &[rule(SONAR, 0.1), rule("robot_sensor", -1.0)],
        &["params.sensor_rules.1: expected a distance of the sensor `robot_sensor` from 0 to 10 m, found -1"],
    );
    refused(&[rule("whiskers", 0.1)], &["params.sensor_rules.0: ", "`whiskers`", "expected one of", "sonar"]);
    refused(&[], &["params.sensor_rules: ", "expected a rule such as", "found none", "disable the reflex"]);
    refused(
        &[rule(SONAR, 0.1), rule(SONAR, 0.3)],
        &["params.sensor_rules.1: `sensor_rules.0` is of the sensor `sonar` already", "keep one"],
    );
    let mut knowledge = with(&[rule(SONAR, 0.1)]).unwrap();
    knowledge.set("sonar", scan(&[]));
    let mut known = |sensor: &str, distance| {
        knowledge.params().sensor_rules = Sequence::new(&[rule(sensor, distance)]);
        knowledge.set("position", Position::default());
        knowledge.set("orientation", Orientation::default());
        knowledge.advance(20_000_000);
        knowledge.tick();
        let rules = knowledge.output::<WheeledRules>("rules");
        rules.map(|rules| rules.avoid_obstacle.sensors[0].distance)
    };
    assert_eq!(known(SONAR, 0.2), Some(0.2), "rules may change while it runs");
    assert_eq!(known(SONAR, 11.0), None, "the rules that hold stay");
    assert_eq!(known("whiskers", 0.1), None);
    assert_eq!(known("laser", 0.1), None, "no reflex reads it");
    assert_eq!(known("odometry", 0.1), None);
    assert_eq!(known("robot_sensor", 0.1), None, "the description has it, and this robot does not");
    assert_eq!(known(SONAR, 0.3), Some(0.3));
}

#[test]
fn sonars_that_are_missing_have_their_rule_and_count_as_near() {
    let params =
        WheeledKnowledgeParams { robot: Text::new("pioneer_p3dx"), ..WheeledKnowledgeParams::default() };
    let mut knowledge = Fixture::<KnowledgeBlock<WheeledKnowledge>>::with(params).unwrap();
    knowledge.set("position", Position::default());
    knowledge.set("orientation", Orientation::default());
    knowledge.tick();
    let known = knowledge.output::<WheeledRules>("rules").unwrap();
    assert_eq!(known.avoid_obstacle.distance(SONAR), Some(0.1));
    let mut model = Fixture::<ReactiveBlock<AvoidObstacleModel>>::new();
    model.set("robot", pioneer());
    model.tick();
    assert_eq!(model.sent::<Reflex>("reflex").len(), 1, "without rules it stops");
    model.set("rules", known);
    model.tick();
    assert_eq!(model.sent::<Reflex>("reflex").len(), 1, "and without a scan");
    model.set("sonar", scan(&[]));
    model.tick();
    assert!(model.sent::<Reflex>("reflex").is_empty(), "nothing is near");
    model.set("rules", WheeledRules::default());
    model.set("sonar", scan(&[]));
    model.tick();
    assert_eq!(model.sent::<Reflex>("reflex").len(), 1, "and with rules that have none for the sonars");
}

#[test]
fn a_rule_for_another_sensor_leaves_the_sonars_theirs() {
    for (sensor, others) in [("bumper", false), ("robot_sensor", true)] {
        let params = WheeledKnowledgeParams {
            robot: Text::new(if others { "summit_xl" } else { "pioneer_p3dx" }),
            sensor_rules: Sequence::new(&[rule(sensor, 0.2)]),
            ..WheeledKnowledgeParams::default()
        };
        let mut knowledge = Fixture::<KnowledgeBlock<WheeledKnowledge>>::with(params).unwrap();
        knowledge.set("position", Position::default());
        knowledge.set("orientation", Orientation::default());
        knowledge.tick();
        let known = knowledge.output::<WheeledRules>("rules").unwrap();
        assert_eq!(known.avoid_obstacle.distance(sensor), Some(0.2));
        assert_eq!(known.avoid_obstacle.distance(SONAR), Some(0.1), "{sensor}");
        let listed: WheeledModel = knowledge.output("robot").unwrap();
        assert!(listed.robot.sensor(SONAR).is_some(), "sonars that never measure count as near");
        let near = scan(&[(2, 0.1), (3, 0.09)]);
        assert!(react(near, known, None).is_some(), "{sensor}: the reflex by sonars is on");
    }
}

/// An Execute with a turn by that angle and a drive.
fn execute(angle: f64) -> Fixture<ExecuteBlock<DifferentialActions>> {
    let mut execute = Fixture::new();
    send(&mut execute, angle, 0.0);
    execute
}

/// Sends the reflex at a heading; returns the tree of actions and the wheels.
fn send(
    execute: &mut Fixture<ExecuteBlock<DifferentialActions>>,
    angle: f64,
    theta: f64,
) -> (String, WheelSpeeds) {
    let action = AvoidObstacle::request(Evasion { angle, left: 3.0, right: 3.0, duration: 0.5 });
    execute.push("reflexes", Reflex { action, rank: 0 });
    step(execute, theta)
}

fn step(execute: &mut Fixture<ExecuteBlock<DifferentialActions>>, theta: f64) -> (String, WheelSpeeds) {
    let mut model = pioneer();
    model.robot.pose.theta = theta;
    execute.set("robot", model);
    execute.advance(20_000_000);
    execute.tick();
    let tree = execute.output::<ExecuteStatus>("status").map(|status| status.tree.as_str().to_owned());
    (tree.unwrap_or_default(), execute.output::<WheelSpeeds>("wheels").unwrap_or_default())
}

#[test]
fn avoiding_decomposes_into_a_turn_and_a_drive() {
    let mut execute = execute(0.6);
    let (_, turns) = step(&mut execute, 0.2);
    assert!(turns.left < 0.0 && turns.right == -turns.left, "{turns:?}");
    let (tree, drives) = step(&mut execute, 0.6);
    assert_eq!(tree, "AvoidObstacle > SetWheelSpeed");
    assert_eq!((drives.left, drives.right), (3.0, 3.0));
}

#[test]
fn a_turn_with_a_contradicting_speed_is_refused() {
    for speed in [-1.0, 0.0] {
        let mut execute = Fixture::<ExecuteBlock<DifferentialActions>>::new();
        let action = TurnAngle::request(Turn { angle: 1.0, speed });
        execute.push("reflexes", Reflex { action, rank: 0 });
        step(&mut execute, 0.0);
        let status = execute.output::<ExecuteStatus>("status").unwrap();
        assert_eq!((status.failed, status.running.as_str()), (1, ""), "speed {speed}");
    }
}

#[test]
fn a_turn_is_finished_before_one_to_the_other_side() {
    let mut execute = execute(0.6);
    let (_, wheels) = send(&mut execute, -0.4, 0.1);
    assert!(wheels.right > 0.0, "still to the left: {wheels:?}");
    let (_, wheels) = send(&mut execute, 0.0, 0.1);
    assert_eq!((wheels.left, wheels.right), (3.0, 3.0), "a reflex without a turn ends it");
}

/// The odometry at a heading, radians.
fn odometry(theta: f64) -> Odometry {
    Odometry { pose: Pose2 { theta, ..Pose2::default() }, ..Odometry::default() }
}

/// Steps on while the pose is unknown; returns what runs, and the wheels.
fn blind(execute: &mut Fixture<ExecuteBlock<DifferentialActions>>) -> (String, WheelSpeeds) {
    execute.expire("robot");
    execute.advance(110_000_000);
    execute.tick();
    let status = execute.output::<ExecuteStatus>("status");
    let tree = status.map(|status| status.tree.as_str().to_owned()).unwrap_or_default();
    (tree, execute.output::<WheelSpeeds>("wheels").unwrap_or_default())
}

#[test]
fn a_turn_goes_on_by_the_odometry_without_a_pose() {
    let mut execute = Fixture::new();
    execute.set("odometry", odometry(3.0));
    send(&mut execute, 1.0, 0.0);
    for heading in [3.1, -2.9, -2.6] {
        execute.set("odometry", odometry(heading));
        let (_, wheels) = blind(&mut execute);
        assert!(wheels.right > 0.0 && wheels.left == -wheels.right, "at {heading}: {wheels:?}");
    }
    // The pose is known again, with another heading.
    let (_, wheels) = step(&mut execute, 1.5);
    assert!(wheels.right > 0.0, "it has turned by 0.68 rad: {wheels:?}");
    let (tree, _) = step(&mut execute, 1.75);
    assert_eq!(tree, "AvoidObstacle > SetWheelSpeed");
}

#[test]
fn a_turn_goes_on_by_its_commands_without_pose_and_odometry() {
    for angle in [1.0, -1.0] {
        let mut execute = execute(angle);
        let turns = std::iter::from_fn(|| {
            let (tree, wheels) = blind(&mut execute);
            (!tree.contains("SetWheelSpeed")).then_some(wheels)
        });
        let turns: Vec<_> = turns.take(30).collect();
        assert!(turns.iter().all(|wheels| wheels.right * angle > 0.0 && wheels.left == -wheels.right));
        // 1 rad/s, and slower at the end.
        assert!((8..15).contains(&turns.len()), "{} of 0.11 s", turns.len());
    }
}
