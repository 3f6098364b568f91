//! Knowledge of a wheeled robot about its own body and devices.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{
    Chassis, Odometry, Orientation, Pose2, Position, Sightings, SonarPlacement, SonarScan, Twist2,
};
use slate::mapek::{DeviceHealth, KnowledgeBlock, SensorBlock, Steering};
use slate::module::testing::Fixture;
use slate::module::{Sequence, Text};
use slate::sim::robot::RobotDescription;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::odometry_pose::{OdometryOrientation, OdometryPosition, OdometryStart};

type Knowing = Fixture<KnowledgeBlock<WheeledKnowledge>>;

fn params(robot: &str, profile: &str) -> WheeledKnowledgeParams {
    WheeledKnowledgeParams {
        robot: Text::new(robot),
        profile: Text::new(profile),
        ..WheeledKnowledgeParams::default()
    }
}

/// The model of a robot at (1, 2), facing 0.5 rad.
fn model(knowledge: &mut Knowing) -> WheeledModel {
    knowledge.set("position", Position { x: 1.0, y: 2.0, z: 0.0 });
    knowledge.set("orientation", Orientation { theta: 0.5 });
    knowledge.tick();
    knowledge.output("robot").unwrap()
}

#[test]
fn the_robot_model_is_that_of_the_description() {
    for (name, steering) in [("pioneer_p3dx", Steering::DIFFERENTIAL), ("summit_xl", Steering::SKID_STEER)] {
        let described = RobotDescription::named(name).unwrap().unwrap();
        let mut knowledge = Knowing::with(params(name, "vrep")).unwrap();
        let WheeledModel { robot, chassis, .. } = model(&mut knowledge);
        let expected: Chassis = described.chassis();
        assert_eq!(chassis, expected, "{name}");
        assert_eq!((robot.drive.steering, robot.drive.track), (steering, expected.track));
        assert_eq!(robot.pose, Pose2 { x: 1.0, y: 2.0, theta: 0.5 });
        let wheels = robot.actuator("wheels").unwrap();
        assert_eq!(
            (wheels.minimum, wheels.maximum),
            (-expected.maximum_wheel_speed, expected.maximum_wheel_speed)
        );
        let twist = Twist2 { linear: 0.3, angular: 0.2 };
        let back = robot.drive.twist_of(robot.drive.wheels_for(twist));
        assert!((back.linear - 0.3).abs() < 1e-12 && (back.angular - 0.2).abs() < 1e-12);
    }
}

#[test]
fn the_robot_model_has_the_mount_of_each_sonar() {
    for (name, profile) in [("pioneer_p3dx", "vrep"), ("pioneer_p3dx", "real"), ("summit_xl", "vrep")] {
        let described = RobotDescription::named(name).unwrap().unwrap();
        let expected = described.sonar[profile].placements.iter().map(|[x, y, degrees]| SonarPlacement {
            x: *x,
            y: *y,
            theta: degrees.to_radians(),
        });
        let expected: Vec<_> = expected.collect();
        let mut knowledge = Knowing::with(params(name, profile)).unwrap();
        assert_eq!(&model(&mut knowledge).sonars[..], expected, "{name}, {profile}");
        // Sonars that tell theirs know better.
        let own = SonarPlacement { x: 0.1, y: 0.0, theta: 0.0 };
        knowledge.set("sonar", SonarScan { placements: Sequence::new(&[own]), ..SonarScan::default() });
        assert_eq!(model(&mut knowledge).sonars[..], [own]);
    }
}

#[test]
fn sensors_that_are_there_are_listed_with_mount_limits_and_rate() {
    let mut knowledge = Knowing::with(params("summit_xl", "real")).unwrap();
    let names = |model: &WheeledModel| -> Vec<String> {
        model.robot.sensors.iter().map(|sensor| sensor.name.as_str().to_owned()).collect()
    };
    let before = model(&mut knowledge);
    assert_eq!(names(&before), ["position", "orientation", "sonar"], "the sonars have a rule");
    assert_eq!(before.robot.sensor("sonar").unwrap().health, DeviceHealth::UNKNOWN);
    knowledge.set("robot_sensor", Sightings::default());
    knowledge.set("sonar", SonarScan { range_min: 0.1, range_max: 4.0, ..SonarScan::default() });
    let model = model(&mut knowledge);
    assert_eq!(names(&model), ["position", "orientation", "sonar", "robot_sensor"]);
    let robots = model.robot.sensor("robot_sensor").unwrap();
    assert_eq!((robots.mount.x, robots.maximum, robots.rate), (0.2, 8.0, 10.0));
    let sonar = model.robot.sensor("sonar").unwrap();
    assert_eq!((sonar.minimum, sonar.maximum, sonar.health), (0.1, 4.0, DeviceHealth::FRESH));
    knowledge.advance(1_100_000_000);
    for _ in 0..2 {
        knowledge.advance(20_000_000);
        knowledge.set("position", Position::default());
        knowledge.set("orientation", Orientation::default());
        knowledge.set("robot_sensor", Sightings::default());
        knowledge.tick();
    }
    let model = knowledge.output::<WheeledModel>("robot").unwrap();
    assert!(model.robot.is_silent("sonar") && !model.robot.is_silent("robot_sensor"));
}

#[test]
fn a_robot_model_without_a_pose_tells_which_sensor_has_stopped() {
    for gone in ["position", "orientation"] {
        let mut knowledge = Knowing::with(params("pioneer_p3dx", "vrep")).unwrap();
        knowledge.set("sonar", SonarScan { range_max: 1.0, ..SonarScan::default() });
        assert!(model(&mut knowledge).robot.pose.is_known());
        for _ in 0..60 {
            knowledge.advance(20_000_000);
            knowledge.set("sonar", SonarScan { range_max: 1.0, ..SonarScan::default() });
            match gone {
                "position" => knowledge.set("orientation", Orientation::default()),
                _ => knowledge.set("position", Position::default()),
            }
            knowledge.tick();
        }
        let robot = knowledge.output::<WheeledModel>("robot").unwrap().robot;
        assert!(!robot.pose.is_known(), "{gone}: {:?}", robot.pose);
        assert!(robot.is_silent(gone) && robot.sensor("sonar").unwrap().health == DeviceHealth::FRESH);
        assert!(model(&mut knowledge).robot.sensor(gone).unwrap().health != DeviceHealth::SILENT);
    }
}

#[test]
fn an_unknown_robot_is_refused_with_the_known_ones() {
    for robot in ["pionier", "nowhere.toml"] {
        let refusal = Knowing::with(params(robot, "vrep")).err().unwrap().0;
        assert!(
            refusal.contains("pioneer_p3dx, summit_xl") && refusal.starts_with("params.robot: "),
            "{refusal}"
        );
    }
}

#[test]
fn an_unknown_profile_is_refused_with_the_known_ones() {
    let refusal = Knowing::with(params("pioneer_p3dx", "nonsense")).err().unwrap().0;
    assert!(refusal.contains("profile `nonsense`") && refusal.contains("real, vrep"), "{refusal}");
    let mut knowledge = Knowing::with(params("pioneer_p3dx", "real")).unwrap();
    assert_eq!(model(&mut knowledge).robot.sensor("position").unwrap().rate, 5.0);
}

#[test]
fn a_sensor_may_have_a_profile_of_its_own() {
    let mut own = params("summit_xl", "vrep");
    own.robot_sensor = Text::new("real");
    let mut knowledge = Knowing::with(own).unwrap();
    knowledge.set("robot_sensor", Sightings::default());
    let robot = model(&mut knowledge).robot;
    let seen = robot.sensor("robot_sensor").unwrap();
    assert_eq!((seen.mount.x, seen.rate, robot.sensor("position").unwrap().rate), (0.2, 10.0, 0.0));
}

#[test]
fn a_robot_without_a_description_has_no_model() {
    let mut knowledge = Knowing::new();
    knowledge.set("position", Position::default());
    knowledge.set("orientation", Orientation::default());
    knowledge.tick();
    assert!(!knowledge.wrote("robot"));
}

#[test]
fn a_running_robot_takes_another_profile_and_keeps_its_state() {
    let mut knowledge = Knowing::with(params("pioneer_p3dx", "vrep")).unwrap();
    assert_eq!(model(&mut knowledge).robot.sensor("position").unwrap().rate, 0.0);
    knowledge.params().profile = Text::new("real");
    assert_eq!(model(&mut knowledge).robot.sensor("position").unwrap().rate, 5.0);
    for (robot, profile) in
        [("", "real"), ("nothing", "real"), ("pioneer_p3dx", "nonsense"), ("summit_xl", "real")]
    {
        knowledge.params().robot = Text::new(robot);
        knowledge.params().profile = Text::new(profile);
        let model = model(&mut knowledge);
        let rate = model.robot.sensor("position").unwrap().rate;
        assert_eq!((model.chassis.model.as_str(), rate), ("pioneer_p3dx", 5.0), "`{robot}`, {profile}");
    }
    knowledge.params().profile = Text::new("real");
    let state = knowledge.save().unwrap();
    knowledge.restore(&state).unwrap();
    knowledge.params().robot = Text::new("pioneer_p3dx");
    assert_eq!(model(&mut knowledge).chassis.model.as_str(), "pioneer_p3dx");
}

#[test]
fn odometry_is_a_pose_relative_to_the_start() {
    let start = OdometryStart { start_x: 1.0, start_y: 2.0, start_theta: std::f64::consts::FRAC_PI_2 };
    let pose = Pose2 { x: 0.5, y: 0.0, theta: 0.25 };
    let odometry = Odometry { pose, ..Odometry::default() };
    let mut position = Fixture::<SensorBlock<OdometryPosition>>::with(start).unwrap();
    position.set("source", odometry);
    position.tick();
    let at = position.output::<Position>("value").unwrap();
    assert!((at.x - 1.0).abs() < 1e-12 && (at.y - 2.5).abs() < 1e-12, "{at:?}");
    let mut orientation = Fixture::<SensorBlock<OdometryOrientation>>::with(start).unwrap();
    orientation.set("source", odometry);
    orientation.tick();
    let heading = orientation.output::<Orientation>("value").unwrap().theta;
    assert!((heading - std::f64::consts::FRAC_PI_2 - 0.25).abs() < 1e-12, "{heading}");
}
