//! Sonars that repeat an echo while the robot moves are frozen, and count as silent.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::interfaces::{Echo, Odometry, Orientation, Pose2, Position, SonarPlacement, SonarScan};
use slate::mapek::{KnowledgeBlock, MonitorBlock};
use slate::module::testing::Fixture;
use slate::module::{Outcome, Sequence, Text};
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::monitors::RangeMonitor;

/// A sonar ahead and one on the left, with what they hear; zero for nothing.
fn scan(ranges: [f64; 2]) -> SonarScan {
    let echo = |range: f64| match range {
        0.0 => Echo { range: 1.0, heard: false.into() },
        range => Echo { range, heard: true.into() },
    };
    let mount = |theta| SonarPlacement { x: 0.1, y: 0.0, theta };
    SonarScan {
        field_of_view: std::f64::consts::FRAC_PI_6,
        range_min: 0.0,
        range_max: 1.0,
        placements: Sequence::new(&[mount(0.0), mount(std::f64::consts::FRAC_PI_2)]),
        echoes: Sequence::new(&ranges.map(echo)),
    }
}

/// In how many of 50 cycles the Monitor is degraded, for scans and poses by the number of the cycle.
fn degraded(scans: impl Fn(u32) -> [f64; 2], poses: impl Fn(u32) -> Pose2) -> usize {
    let mut monitor = Fixture::<MonitorBlock<RangeMonitor>>::new();
    let cycles = (0..50).filter(|cycle| {
        monitor.advance(20_000_000);
        monitor.set("odometry", Odometry { pose: poses(*cycle), ..Odometry::default() });
        monitor.set("sonar", scan(scans(*cycle)));
        let outcome = monitor.tick();
        assert_eq!(monitor.wrote("percept"), outcome == Outcome::Ok, "a frozen scan is not a percept");
        outcome != Outcome::Ok
    });
    cycles.count()
}

fn ahead(cycle: u32) -> Pose2 {
    Pose2 { x: 0.005 * f64::from(cycle), ..Pose2::default() }
}

fn turn(cycle: u32) -> Pose2 {
    Pose2 { theta: 0.01 * f64::from(cycle), ..Pose2::default() }
}

#[test]
fn echoes_that_stay_while_the_robot_moves_degrade_the_monitor() {
    // Named after 0.05 m or 0.1 rad, 11 cycles, and not before 0.2 s.
    assert_eq!(degraded(|_| [0.5, 0.3], ahead), 39);
    assert_eq!(degraded(|_| [0.0, 0.3], turn), 39);
    assert_eq!(degraded(|_| [0.5, 0.3], |cycle| ahead(10 * cycle)), 39, "however fast it is");
}

#[test]
fn one_frozen_transducer_degrades_the_monitor() {
    let beside = |cycle: u32| 0.3 + 0.001 * f64::from(cycle);
    assert_eq!(degraded(|cycle| [0.5, beside(cycle)], ahead), 39);
}

#[test]
fn sonars_with_a_reason_to_repeat_are_not_frozen() {
    assert_eq!(degraded(|_| [0.5, 0.3], |_| Pose2::default()), 0, "the robot stands");
    assert_eq!(degraded(|_| [0.0, 0.0], ahead), 0, "they hear nothing");
    assert_eq!(degraded(|_| [0.0, 0.3], ahead), 0, "a wall along the way");
    assert_eq!(degraded(|cycle| [0.5 - 0.005 * f64::from(cycle), 0.3], ahead), 0, "they work");
}

#[test]
fn a_frozen_ring_is_over_with_the_first_other_echo() {
    assert_eq!(
        degraded(|cycle| [if cycle < 20 { 0.5 } else { 0.4 - 0.001 * f64::from(cycle) }, 0.0], ahead),
        9
    );
}

#[test]
fn frozen_sonars_are_silent_in_the_robot_model() {
    let params =
        WheeledKnowledgeParams { robot: Text::new("pioneer_p3dx"), ..WheeledKnowledgeParams::default() };
    let mut knowledge = Fixture::<KnowledgeBlock<WheeledKnowledge>>::with(params).unwrap();
    let mut is_silent = |cycle: u32, range: f64| {
        knowledge.advance(20_000_000);
        knowledge.set("position", Position::default());
        knowledge.set("orientation", Orientation::default());
        knowledge.set("odometry", Odometry { pose: ahead(cycle), ..Odometry::default() });
        knowledge.set("sonar", scan([range, 0.0]));
        knowledge.tick();
        knowledge.output::<WheeledModel>("robot").unwrap().robot.is_silent("sonar")
    };
    let silent: Vec<_> = (0..20).map(|cycle| is_silent(cycle, 0.5)).collect();
    assert_eq!(silent.iter().position(|silent| *silent), Some(11));
    assert!(!is_silent(20, 0.4));
}
