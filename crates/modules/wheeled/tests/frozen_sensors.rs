//! Sensors that repeat a measurement while the robot moves are frozen, and count as silent.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::interfaces::{Odometry, Orientation, Pose2, Position, Sighting, Sightings, Twist2};
use slate::mapek::{KnowledgeBlock, Monitor, MonitorBlock};
use slate::module::testing::Fixture;
use slate::module::{Interface, Outcome, Sequence, Text};
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::locate_robot::RobotMonitor;
use slate_wheeled::monitors::{OdometryMonitor, OrientationMonitor, PositionMonitor};

/// In how many of 50 cycles a Monitor is degraded, for measurements of a port and poses by the number of the cycle.
fn degraded<M: Monitor, T: Interface + Copy>(
    port: &str,
    measured: impl Fn(u32) -> T,
    poses: impl Fn(u32) -> Pose2,
) -> usize {
    let mut monitor = Fixture::<MonitorBlock<M>>::new();
    let cycles = (0..50).filter(|cycle| {
        monitor.advance(20_000_000);
        if port != "odometry" {
            monitor.set("odometry", Odometry { pose: poses(*cycle), ..Odometry::default() });
        }
        monitor.set(port, measured(*cycle));
        let outcome = monitor.tick();
        assert_eq!(monitor.wrote("percept"), outcome == Outcome::Ok, "what is frozen is not a percept");
        outcome != Outcome::Ok
    });
    cycles.count()
}

fn ahead(cycle: u32) -> Pose2 {
    Pose2 { x: 0.01 * f64::from(cycle), ..Pose2::default() }
}

fn turn(cycle: u32) -> Pose2 {
    Pose2 { theta: 0.01 * f64::from(cycle), ..Pose2::default() }
}

fn stand(_: u32) -> Pose2 {
    Pose2::default()
}

fn position(_: u32) -> Position {
    Position { x: 1.0, y: 2.0, z: 0.0 }
}

fn heading(_: u32) -> Orientation {
    Orientation { theta: 0.5 }
}

fn seen(range: f64) -> Sightings {
    Sightings { list: Sequence::new(&[Sighting { range, bearing: 0.1, name: Text::new("r2") }]) }
}

/// Odometry at a place (m) with a twist (m/s, rad/s).
fn odometry(x: f64, linear: f64, angular: f64) -> Odometry {
    Odometry { pose: Pose2 { x, ..Pose2::default() }, twist: Twist2 { linear, angular } }
}

#[test]
fn measurements_that_stay_on_the_move_degrade_their_monitor() {
    // Named after 0.1 m or 0.1 rad, 11 cycles, and not before 0.2 s.
    assert_eq!(degraded::<PositionMonitor, _>("position", position, ahead), 39);
    assert_eq!(degraded::<OrientationMonitor, _>("orientation", heading, turn), 39);
    assert_eq!(degraded::<RobotMonitor, _>("robots", |_| seen(1.4), ahead), 39);
    assert_eq!(degraded::<RobotMonitor, _>("robots", |_| seen(1.4), turn), 39);
}

#[test]
fn odometry_that_contradicts_its_twist_degrades_its_monitor() {
    assert_eq!(degraded::<OdometryMonitor, _>("odometry", |_| odometry(1.0, 0.5, 0.0), stand), 39);
    assert_eq!(degraded::<OdometryMonitor, _>("odometry", |_| odometry(1.0, 0.0, -0.5), stand), 39);
    assert_eq!(
        degraded::<OdometryMonitor, _>("odometry", |_| odometry(1.0, 0.0, 0.0), stand),
        0,
        "it stands"
    );
    let works = |cycle| odometry(0.01 * f64::from(cycle), 0.5, 0.0);
    assert_eq!(degraded::<OdometryMonitor, _>("odometry", works, stand), 0);
}

#[test]
fn measurements_with_a_reason_to_repeat_are_not_frozen() {
    assert_eq!(degraded::<PositionMonitor, _>("position", position, stand), 0, "the robot stands");
    assert_eq!(degraded::<PositionMonitor, _>("position", position, turn), 0, "it turns on the spot");
    assert_eq!(degraded::<OrientationMonitor, _>("orientation", heading, ahead), 0, "it drives straight on");
    let drifting = |cycle| Pose2 { theta: 0.05 * ahead(10 * cycle).x, ..ahead(10 * cycle) };
    assert_eq!(degraded::<OrientationMonitor, _>("orientation", heading, drifting), 0, "the odometry errs");
    assert_eq!(degraded::<RobotMonitor, _>("robots", |_| seen(1.4), stand), 0, "both robots stand");
    let nothing = |_| Sightings::default();
    assert_eq!(degraded::<RobotMonitor, _>("robots", nothing, ahead), 0, "it detects nothing");
    let near = |cycle| seen(1.4 - 0.01 * f64::from(cycle));
    assert_eq!(degraded::<RobotMonitor, _>("robots", near, ahead), 0, "it works");
}

#[test]
fn odometry_that_was_late_tells_of_no_frozen_sensor() {
    let mut monitor = Fixture::<MonitorBlock<OrientationMonitor>>::new();
    for cycle in 0..50 {
        monitor.advance(20_000_000);
        // Of the motion before the robot stood, half a second ago.
        if cycle % 25 == 0 {
            monitor.set("odometry", Odometry { pose: turn(cycle), ..Odometry::default() });
        }
        monitor.set("orientation", heading(cycle));
        assert_eq!(monitor.tick(), Outcome::Ok, "in cycle {cycle}");
    }
}

#[test]
fn a_frozen_sensor_works_again_with_another_measurement() {
    let thaws = |cycle| Position { x: if cycle < 20 { 1.0 } else { f64::from(cycle) }, y: 2.0, z: 0.0 };
    assert_eq!(degraded::<PositionMonitor, _>("position", thaws, ahead), 9);
}

#[test]
fn frozen_sensors_are_silent_in_the_robot_model() {
    let params =
        WheeledKnowledgeParams { robot: Text::new("summit_xl"), ..WheeledKnowledgeParams::default() };
    let mut knowledge = Fixture::<KnowledgeBlock<WheeledKnowledge>>::with(params).unwrap();
    let mut silent = |cycle: u32, twist: f64| {
        let Pose2 { x, .. } = ahead(cycle);
        knowledge.advance(20_000_000);
        knowledge.set("position", position(cycle));
        knowledge.set("orientation", heading(cycle));
        let pose = Pose2 { x, theta: turn(cycle).theta * 2.0, ..Pose2::default() };
        let moving = Odometry { pose, ..Odometry::default() };
        knowledge.set("odometry", if twist == 0.0 { moving } else { odometry(9.0, twist, 0.0) });
        knowledge.set("robot_sensor", seen(1.4));
        knowledge.tick();
        let model = knowledge.output::<WheeledModel>("robot").unwrap();
        ["position", "orientation", "odometry", "robot_sensor"].map(|name| model.robot.is_silent(name))
    };
    for cycle in 0..40 {
        let is_frozen = cycle > 10;
        assert_eq!(silent(cycle, 0.0), [is_frozen, is_frozen, false, is_frozen], "in cycle {cycle}");
    }
    let last = (40..60).map(|cycle| silent(cycle, 0.5)).last().unwrap();
    assert!(last[2], "the odometry");
}
