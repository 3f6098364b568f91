//! The referee of deliveries.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_navigation::{
    DeliveryMetrics, DeliveryReferee, DeliveryRefereeParams, NavigationGoal, NavigationMission,
};
use slate_plugin::interfaces::{Clearance, MissionOutcome, MissionState, Pose2, Verdict};
use slate_plugin::module::Sequence;
use slate_plugin::module::testing::Fixture;

/// A referee of two deliveries between two points 4 m apart.
fn referee() -> Fixture<DeliveryReferee> {
    let params = DeliveryRefereeParams { deliveries: 2, ..DeliveryRefereeParams::default() };
    let mut referee = Fixture::<DeliveryReferee>::with(params).unwrap();
    let goals = [0.0, 4.0].map(|x| NavigationGoal { x, ..NavigationGoal::default() });
    let mission =
        NavigationMission { number: 1, goals: Sequence::new(&goals), ..NavigationMission::default() };
    referee.set("mission", mission);
    referee.set("clearance", Clearance { distance: 0.5 });
    referee
}

fn at(referee: &mut Fixture<DeliveryReferee>, x: f64, seconds: u64) -> Verdict {
    referee.set("truth", Pose2 { x, y: 0.0, theta: 0.0 });
    referee.advance(seconds * 1_000_000_000);
    referee.tick();
    referee.output("verdict").unwrap()
}

#[test]
fn deliveries_in_time_succeed() {
    let mut referee = referee();
    at(&mut referee, 0.1, 10);
    assert_eq!(at(&mut referee, 3.9, 20).state, MissionState::RUNNING);
    // 30 s and 20 s for 4 m.
    let verdict = at(&mut referee, 0.0, 49);
    assert_eq!((verdict.state, verdict.outcome), (MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED));
    let metrics: DeliveryMetrics = referee.output("metrics").unwrap();
    assert_eq!((metrics.deliveries, metrics.in_time, metrics.longest_time), (2, 2, 49.0));
    assert!((metrics.path_length - 7.7).abs() < 1e-9, "{}", metrics.path_length);
}

#[test]
fn a_late_delivery_fails_the_mission() {
    let mut referee = referee();
    at(&mut referee, 0.0, 10);
    at(&mut referee, 4.0, 51);
    let verdict = at(&mut referee, 0.0, 10);
    assert_eq!((verdict.state, verdict.outcome), (MissionState::FAILED, MissionOutcome::TIMED_OUT));
    assert!(verdict.reason.as_str().starts_with("2 deliveries, 1 in time"), "{}", verdict.reason);
}
