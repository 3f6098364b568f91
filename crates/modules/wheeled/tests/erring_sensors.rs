//! How a robot copes with sensors that err: it bridges missed detections, reacts farther away, and weaves.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{
    Odometry, Orientation, Pose2, Position, SensorAccuracy, Sighting, Sightings, SonarScan, WheelSpeeds,
};
use slate::mapek::{ActionKind, ExecuteBlock, KnowledgeBlock, Planned, SensorBlock};
use slate::module::testing::Fixture;
use slate::module::{Sequence, Text};
use slate_avoidance::SensorRule;
use slate_wheeled::actions::{GoToOrigin, Leg};
use slate_wheeled::differential::DifferentialActions;
use slate_wheeled::held_robot_sensor::HeldRobotSensor;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::rules::WheeledRules;

/// Errors of sonars and of the detector of robots.
const ERRING: SensorAccuracy = SensorAccuracy {
    position_stddev: 0.0,
    orientation_stddev: 0.0,
    odometry_translation_stddev: 0.0,
    odometry_rotation_stddev: 0.0,
    sonar_outliers: 0.015,
    sighting_range_stddev: 0.03,
    sighting_range_relative_stddev: 0.01,
    sighting_bearing_stddev: 0.02,
};

/// What the detector reports after so many milliseconds, at a heading.
fn report(
    sensor: &mut Fixture<SensorBlock<HeldRobotSensor>>,
    later: u64,
    theta: f64,
    seen: &[Sighting],
) -> Vec<(f64, f64)> {
    sensor.advance(later * 1_000_000);
    sensor.set("odometry", Odometry { pose: Pose2 { theta, ..Pose2::default() }, ..Odometry::default() });
    sensor.set("source", Sightings { list: Sequence::new(seen) });
    sensor.tick();
    let sightings = sensor.output::<Sightings>("value").unwrap();
    sightings.list.iter().map(|seen| (seen.range, seen.bearing)).collect()
}

#[test]
fn overlooked_robot_is_reported_where_it_was_for_a_while() {
    let seen = Sighting { range: 1.5, bearing: 0.3, name: Text::new("r1") };
    let mut sensor = Fixture::<SensorBlock<HeldRobotSensor>>::new();
    assert_eq!(report(&mut sensor, 100, 0.0, &[seen]).len(), 1);
    assert!(report(&mut sensor, 100, 0.0, &[]).is_empty(), "an exact detector overlooks none");
    sensor.set("accuracy", ERRING);
    report(&mut sensor, 100, 0.0, &[seen]);
    let held = report(&mut sensor, 100, 0.2, &[])[0];
    assert!((held.0 - 1.5).abs() < 1e-9 && (held.1 - 0.1).abs() < 1e-9, "this robot has turned: {held:?}");
    assert!(report(&mut sensor, 1000, 0.2, &[]).is_empty(), "it has left");
}

#[test]
fn rules_of_sonars_that_err_are_wider() {
    let rules = |accuracy: SensorAccuracy, sensor_rules| {
        let params = WheeledKnowledgeParams {
            robot: Text::new("pioneer_p3dx"),
            sensor_rules,
            error_distance: 0.25,
            error_clearance: 0.02,
            ..WheeledKnowledgeParams::default()
        };
        let mut knowledge = Fixture::<KnowledgeBlock<WheeledKnowledge>>::with(params).unwrap();
        knowledge.set("accuracy", accuracy);
        knowledge.set("sonar", SonarScan::default());
        knowledge.set("position", Position::default());
        knowledge.set("orientation", Orientation::default());
        knowledge.tick();
        let rules = knowledge.output::<WheeledRules>("rules").unwrap().avoid_obstacle;
        [rules.sensors[0].distance, rules.side_clearance, rules.min_clearance]
    };
    let default = WheeledKnowledgeParams::default().sensor_rules;
    assert_eq!(rules(SensorAccuracy::default(), default), [0.1, 0.03, 0.03]);
    assert_eq!(rules(ERRING, default), [0.35, 0.05, 0.05]);
    // The rule that sonars have without one of their own is theirs, too.
    let bumper = Sequence::new(&[SensorRule { distance: 0.5, sensor: "bumper".into() }]);
    assert_eq!(rules(ERRING, bumper), [0.35, 0.05, 0.05]);
}

/// How the robot turns that drives to a place so far ahead of it.
fn turns(distance: f64, accuracy: SensorAccuracy) -> f64 {
    let mut execute = Fixture::<ExecuteBlock<DifferentialActions>>::new();
    let robot = WheeledModel { accuracy, ..WheeledModel::load("pioneer_p3dx", "real").unwrap() };
    execute.set("robot", robot);
    let action = GoToOrigin::request(Leg { x: distance, y: 0.0, speed: 0.3, tolerance: 0.05 });
    execute.push("plan", Planned { ticket: 1, action, ..Planned::default() });
    execute.tick();
    let WheelSpeeds { left, right } = execute.output("wheels").unwrap();
    assert!(left + right > 0.0, "it drives: {left} {right}");
    right - left
}

#[test]
fn robot_weaves_where_its_sonars_err() {
    let sides: Vec<f64> = (0..9).map(|step| turns(1.0 + 0.1 * f64::from(step), ERRING)).collect();
    assert!(sides.iter().any(|side| *side > 1.0) && sides.iter().any(|side| *side < -1.0), "{sides:?}");
    assert_eq!(turns(1.2, SensorAccuracy::default()), 0.0, "with exact ones it goes straight");
    assert_eq!(turns(0.3, ERRING), 0.0, "and near the goal");
}
