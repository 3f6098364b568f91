//! A robot that is stuck.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_interfaces::Pose2;
use slate_local_planning::{
    PlanarVelocity, ProgressChecker, RecoveryBehavior, RecoveryCommand, RecoverySequence,
};

const HERE: Pose2 = Pose2 { x: 0.0, y: 0.0, theta: 0.0 };

#[test]
fn a_robot_that_stays_within_the_radius_is_stuck() {
    let mut checker = ProgressChecker::new(0.5, 10.0).unwrap();
    for time in 0..=10 {
        assert!(checker.check(&Pose2 { x: 0.04 * f64::from(time), ..HERE }, f64::from(time)));
    }
    assert!(!checker.check(&Pose2 { x: 0.4, ..HERE }, 10.1));
    assert!(checker.check(&Pose2 { x: 0.6, ..HERE }, 10.2));
    assert!(checker.check(&Pose2 { x: 0.6, ..HERE }, 20.0));
    assert!(!checker.check(&Pose2 { x: 0.6, ..HERE }, 20.3));
    checker.reset();
    assert!(checker.check(&Pose2 { x: 0.6, ..HERE }, 20.4));
    assert_eq!(ProgressChecker::new(0.5, f64::NAN).unwrap_err().name, "movement_time_allowance");
}

#[test]
fn behaviors_run_one_after_the_other() {
    let spin = RecoveryBehavior::Spin { angle: -1.0, speed: 0.5 };
    let back_up = RecoveryBehavior::BackUp { distance: 0.2, speed: 0.1 };
    let wait = RecoveryBehavior::Wait { duration: 1.0 };
    let mut sequence =
        RecoverySequence::new(vec![RecoveryBehavior::ClearCostmap, back_up, spin, wait]).unwrap();
    let moved = |vx: f64, wz: f64| RecoveryCommand::Move(PlanarVelocity { vx, vy: 0.0, wz });
    assert_eq!(sequence.step(&HERE, 0.0, |_| true), RecoveryCommand::Done);
    assert_eq!(sequence.start(&HERE, 0.0), Some(RecoveryBehavior::ClearCostmap));
    assert_eq!(sequence.step(&HERE, 0.0, |_| true), RecoveryCommand::ClearCostmap);
    assert!(!sequence.is_running());
    assert_eq!(sequence.start(&HERE, 1.0), Some(back_up));
    assert_eq!(sequence.step(&Pose2 { x: -0.1, ..HERE }, 2.0, |_| true), moved(-0.1, 0.0));
    assert_eq!(sequence.step(&Pose2 { x: -0.21, ..HERE }, 3.0, |_| true), RecoveryCommand::Done);
    assert_eq!(sequence.start(&HERE, 3.0), Some(spin));
    assert_eq!(sequence.step(&Pose2 { theta: -0.6, ..HERE }, 4.0, |_| true), moved(0.0, -0.5));
    assert_eq!(sequence.step(&Pose2 { theta: -1.1, ..HERE }, 5.0, |_| true), RecoveryCommand::Done);
    assert_eq!(sequence.start(&HERE, 5.0), Some(wait));
    assert_eq!(sequence.step(&HERE, 5.5, |_| false), moved(0.0, 0.0));
    assert_eq!(sequence.step(&HERE, 6.0, |_| true), RecoveryCommand::Done);
    assert_eq!(sequence.start(&HERE, 7.0), Some(RecoveryBehavior::ClearCostmap));
    sequence.reset();
    assert_eq!(sequence.start(&HERE, 8.0), Some(RecoveryBehavior::ClearCostmap));
    assert_eq!(RecoverySequence::new(Vec::new()).unwrap().start(&HERE, 0.0), None);
}

#[test]
fn a_motion_ends_before_it_touches_or_where_it_gets_nowhere() {
    let mut sequence =
        RecoverySequence::new(vec![RecoveryBehavior::BackUp { distance: 0.2, speed: 0.1 }]).unwrap();
    sequence.start(&HERE, 0.0);
    assert_eq!(sequence.step(&HERE, 0.1, |velocity| velocity.vx >= 0.0), RecoveryCommand::Done);
    sequence.start(&HERE, 1.0);
    assert!(matches!(sequence.step(&HERE, 6.9, |_| true), RecoveryCommand::Move(_)));
    assert_eq!(sequence.step(&HERE, 7.1, |_| true), RecoveryCommand::Done);
}

#[test]
fn behaviors_that_never_end_are_refused() {
    let refused = |behavior| RecoverySequence::new(vec![behavior]).unwrap_err().name;
    assert_eq!(refused(RecoveryBehavior::BackUp { distance: 0.2, speed: 0.0 }), "speed");
    assert_eq!(refused(RecoveryBehavior::BackUp { distance: 0.2, speed: -0.1 }), "speed");
    assert_eq!(refused(RecoveryBehavior::BackUp { distance: 1e9, speed: 0.1 }), "distance");
    assert_eq!(refused(RecoveryBehavior::Spin { angle: f64::NAN, speed: 0.1 }), "angle");
    assert_eq!(refused(RecoveryBehavior::Wait { duration: f64::NAN }), "duration");
    let mut sequence = RecoverySequence::new(vec![RecoveryBehavior::Wait { duration: 1.0 }]).unwrap();
    sequence.start(&HERE, 0.0);
    assert_eq!(sequence.step(&HERE, f64::NAN, |_| true), RecoveryCommand::Done);
}

#[test]
fn a_robot_whose_first_pose_is_unknown_makes_progress_later() {
    let mut checker = ProgressChecker::new(0.5, 10.0).unwrap();
    assert!(checker.check(&Pose2 { x: f64::NAN, ..HERE }, 0.0));
    assert!(checker.check(&HERE, 9.0) && checker.check(&HERE, 18.0));
    assert!(!checker.check(&HERE, 19.1));
}
