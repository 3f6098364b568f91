//! Robots with omni wheels.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_sim::drive::{Velocity, Wheels};
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::world::World;
use slate_sim::{Placement, Simulation};

const STEP: u64 = 10_000_000;
const ROBOTINO: &str = include_str!("../../../robots/robotino.toml");

fn robotino() -> RobotDescription {
    let mut description = RobotDescription::parse("robotino.toml", ROBOTINO).unwrap();
    let noise = &mut description.noise;
    (noise.wheel_radius_bias, noise.track_bias, noise.wheel_speed) = (0.0, 0.0, 0.0);
    description
}

fn simulation(description: RobotDescription, theta: f64) -> Simulation {
    let pose = Pose { x: 0.5, y: -0.5, theta };
    let robot = Placement { name: "r".into(), description, sonar: "vrep".into(), pose, script: None };
    Simulation::new(&World::named("rocs_arena").unwrap().unwrap(), &[robot], 0, STEP).unwrap()
}

/// Where it is after some time, in the frame in which it began.
fn moved(simulation: &Simulation, theta: f64) -> Pose {
    let begin = Pose { x: 0.5, y: -0.5, theta }.frame();
    let pose = simulation.pose(0);
    let place = begin.local(pose.point());
    Pose { x: place.x, y: place.y, theta: slate_module::math::wrap_angle(pose.theta - theta) }
}

#[test]
fn a_robot_with_omni_wheels_moves_in_all_directions() {
    for (forward, left, turn) in [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (-0.2, 0.2, 0.0), (0.0, 0.0, 0.8)] {
        for theta in [0.0, 2.0] {
            let mut simulation = simulation(robotino(), theta);
            simulation.command_velocity(0, Velocity { forward, left, turn });
            (0..200).for_each(|_| simulation.step());
            let pose = moved(&simulation, theta);
            // It takes some tenths of a second to be as fast.
            let is_near = |value: f64, speed: f64| {
                (value - 2.0 * speed).abs() < 0.3 * speed.abs() + 1e-6 && value * speed >= 0.0
            };
            assert!(is_near(pose.x, forward) && is_near(pose.y, left), "{forward} {left} {turn} {pose:?}");
            assert!(is_near(pose.theta, turn), "{forward} {left} {turn} {pose:?}");
            let odometry = simulation.odometry(0).0;
            assert!((odometry.x - pose.x).abs() < 1e-3 && (odometry.y - pose.y).abs() < 1e-3, "{odometry:?}");
        }
    }
}

#[test]
fn equal_wheels_turn_a_robot_on_the_spot() {
    let mut simulation = simulation(robotino(), 0.0);
    simulation.command_omni(0, [2.0; 4]);
    (0..200).for_each(|_| simulation.step());
    let pose = moved(&simulation, 0.0);
    let expected = 2.0 * 0.04 / 0.13 * 2.0;
    assert!(pose.x.abs() < 1e-6 && pose.y.abs() < 1e-6, "{pose:?}");
    assert!((pose.theta - expected).abs() < 0.1, "{pose:?} {expected}");
}

#[test]
fn a_velocity_that_is_too_fast_keeps_its_direction() {
    let mut simulation = simulation(robotino(), 0.0);
    simulation.command_velocity(0, Velocity { forward: -6.0, left: 3.0, turn: 0.0 });
    (0..100).for_each(|_| simulation.step());
    let pose = moved(&simulation, 0.0);
    assert!((pose.x + 2.0 * pose.y).abs() < 0.06 * pose.y.abs() && pose.y > 0.2, "{pose:?}");
    assert!(pose.theta.abs() < 0.05, "{pose:?}");
    simulation.command_velocity(0, Velocity { forward: f64::NAN, left: 0.0, turn: 0.0 });
    (0..200).for_each(|_| simulation.step());
    let stopped = simulation.pose(0);
    (0..100).for_each(|_| simulation.step());
    assert_eq!(simulation.pose(0), stopped);
}

#[test]
fn a_command_of_two_sides_drives_omni_wheels_too() {
    let mut simulation = simulation(robotino(), 0.0);
    simulation.command(0, Wheels { left: 5.0, right: 5.0 });
    (0..200).for_each(|_| simulation.step());
    let pose = moved(&simulation, 0.0);
    assert!(pose.x > 0.3 && pose.y.abs() < 1e-6 && pose.theta.abs() < 1e-6, "{pose:?}");
}

#[test]
fn four_omni_wheels_drive_as_three() {
    let text = ROBOTINO.replace("[60, 180, 300]", "[45, 135, 225, 315]");
    let mut description = RobotDescription::parse("robotino.toml", &text).unwrap();
    description.noise = robotino().noise;
    let mut simulation = simulation(description, 1.0);
    simulation.command_velocity(0, Velocity { forward: 0.2, left: -0.2, turn: 0.0 });
    (0..200).for_each(|_| simulation.step());
    let pose = moved(&simulation, 1.0);
    assert!((pose.x + pose.y).abs() < 1e-6 && pose.x > 0.3 && pose.theta.abs() < 1e-6, "{pose:?}");
}

#[test]
fn omni_wheels_that_can_not_drive_are_refused_at_the_key() {
    let error = |from: &str, to: &str| {
        RobotDescription::parse("r.toml", &ROBOTINO.replacen(from, to, 1)).unwrap_err().to_string()
    };
    let angles = "wheel_angles = [60, 180, 300]";
    for (to, words) in [
        ("wheel_angles = [60, 180]", "3 or 4 wheels"),
        ("wheel_angles = [60, 60, 60]", "three directions"),
        ("", "needs `wheel_angles`"),
        ("wheel_angles = [60, 180, nan]", "3 or 4 wheels"),
    ] {
        let error = error(angles, to);
        assert!(error.contains(words) && error.starts_with("r.toml, line "), "{error}");
    }
    let skids = error("kind = \"omni\"", "");
    assert!(skids.contains("`wheel_angles` is of kind = \"omni\" only"), "{skids}");
    let base = error("track = 0.26", "track = 0.26\nwheelbase = 0.2");
    assert!(base.contains("skid_steer"), "{base}");
}
