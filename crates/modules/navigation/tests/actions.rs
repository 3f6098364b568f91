//! Actions of a robot that navigates.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_navigation::{Dock, DockArguments, FollowPath, Halt, LocalPlan, NavigateTo, NavigateToArguments};
use slate_plugin::interfaces::{Pose2, Twist2};
use slate_plugin::module::math;
use slate_plugin::prelude::*;

use crate::common::Scene;

const START: Pose2 = Pose2 { x: 0.0, y: 0.0, theta: 0.0 };

fn to(x: f64, y: f64, heading: Option<f64>) -> ActionRequest {
    let has_heading = if heading.is_some() { 1.0 } else { 0.0 };
    NavigateTo::request(NavigateToArguments { x, y, theta: heading.unwrap_or(0.0), has_heading })
}

/// A robot with columns beside its path, 4 m to the east.
fn scene() -> Scene {
    let mut scene = Scene::new(START, &[[1.4, 0.3], [2.6, -0.35]]);
    scene.path = vec![[0.0, 0.0], [4.0, 0.0]];
    scene
}

#[test]
fn a_robot_navigates_to_a_pose_past_columns() {
    let mut scene = scene();
    scene.request(to(4.0, 0.0, Some(1.5)));
    assert_eq!(scene.run(500), Some(Ending::COMPLETED), "{:?}", scene.pose);
    let Pose2 { x, y, theta } = scene.pose;
    assert!(math::hypot(x - 4.0, y) < 0.31, "{:?}", scene.pose);
    assert!(math::angle_between(theta, 1.5).abs() < 0.2, "{:?}", scene.pose);
    assert!(scene.clearance > 0.02, "{}", scene.clearance);
}

#[test]
fn a_path_is_followed_to_its_end() {
    let mut scene = Scene::new(START, &[]);
    scene.path = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.2]];
    scene.request(FollowPath::request(()));
    assert_eq!(scene.run(300), Some(Ending::COMPLETED), "{:?}", scene.pose);
    assert!(math::hypot(scene.pose.x - 1.0, scene.pose.y - 1.2) < 0.2, "{:?}", scene.pose);
}

#[test]
fn a_local_plan_shows_what_was_compared_in_the_map_frame() {
    let mut scene = scene();
    scene.request(to(4.0, 0.0, None));
    for _ in 0..20 {
        scene.step();
    }
    let before = scene.pose;
    scene.step();
    let trajectories = scene.execute.read::<LocalPlan, _>("local_plan", |plan| {
        let steps = plan.steps as usize;
        assert_eq!((steps, plan.points.len() % steps), (14, 0));
        plan.points.chunks(steps).map(|points| (points[0], points[steps - 1])).collect::<Vec<_>>()
    });
    let trajectories = trajectories.unwrap();
    assert_eq!(trajectories.len(), 49);
    for (first, last) in &trajectories {
        assert!(math::hypot(first.x - before.x, first.y - before.y) < 0.1, "{first:?}, {before:?}");
        assert!(first.weight == last.weight && (0.0..=1.0).contains(&first.weight), "{first:?}");
    }
    let [planned, sampled @ ..] = &trajectories[..] else { unreachable!("48 are sampled") };
    assert!(planned.0.weight == 1.0 && planned.1.x > before.x + 0.5, "{planned:?}");
    assert!(sampled.iter().any(|(first, _)| first.weight > 0.0));
    // Beside a column some collide.
    let collides = |scene: &Scene| {
        let has = |plan: &LocalPlan| plan.points.iter().any(|point| point.weight == 0.0);
        scene.execute.read::<LocalPlan, _>("local_plan", has).unwrap()
    };
    assert!((0..60).any(|_| {
        scene.step();
        collides(&scene)
    }));
}

#[test]
fn a_missing_input_stops_the_robot_until_it_is_back() {
    for input in ["robot", "odometry", "obstacles", "path"] {
        let mut scene = scene();
        scene.request(to(4.0, 0.0, None));
        for _ in 0..30 {
            scene.step();
        }
        assert!(scene.twist.linear > 0.1, "{input}");
        for _ in 0..5 {
            scene.missing.push(input);
            assert_eq!(scene.step(), Twist2::ZERO, "{input}");
        }
        assert_eq!(scene.run(500), Some(Ending::COMPLETED), "{input}");
    }
}

#[test]
fn a_path_to_elsewhere_is_not_followed() {
    let mut scene = scene();
    scene.request(to(0.0, 4.0, None));
    for _ in 0..10 {
        assert_eq!(scene.step(), Twist2::ZERO);
    }
}

#[test]
fn a_robot_that_is_stuck_recovers_and_then_fails() {
    // A wall of columns without a gap.
    let wall: Vec<_> = (-8..=8).map(|k| [1.2, 0.25 * f64::from(k)]).collect();
    let mut scene = Scene::new(START, &wall);
    scene.path = vec![[0.0, 0.0], [4.0, 0.0]];
    scene.request(to(4.0, 0.0, None));
    let mut seen = Vec::new();
    let ending = (0..2_000).find_map(|_| {
        scene.step();
        let last = scene.tree().rsplit(" > ").next().unwrap_or_default().to_owned();
        if !seen.contains(&last) {
            seen.push(last);
        }
        scene.status().and_then(|status| status.ended.last().map(|ended| ended.ending))
    });
    assert_eq!(ending, Some(Ending::FAILED));
    assert!(scene.clearance > 0.0, "{}", scene.clearance);
    for action in ["FollowPath", "BackUp", "Spin", "Wait"] {
        assert!(seen.iter().any(|seen| seen == action), "{action}: {seen:?}");
    }
}

#[test]
fn an_action_goes_on_after_a_restart_as_without_one() {
    let mut scene = scene();
    scene.request(to(4.0, 0.0, None));
    for _ in 0..40 {
        scene.step();
    }
    let mut resumed = scene.resumed();
    for _ in 0..20 {
        assert_eq!(scene.step(), resumed.step());
    }
}

#[test]
fn docking_ends_within_two_centimeters_and_two_degrees() {
    for (y, theta) in [(0.05, 0.1), (-0.1, -0.15)] {
        let mut scene = Scene::new(Pose2 { x: 0.0, y, theta }, &[]);
        scene.request(Dock::request(DockArguments { x: 0.8, y: 0.0, theta: 0.0, speed: 0.1 }));
        assert_eq!(scene.run(600), Some(Ending::COMPLETED), "{:?}", scene.pose);
        let Pose2 { x, y, theta } = scene.pose;
        assert!(math::hypot(x - 0.8, y) < 0.02 && theta.abs() < 0.035, "{:?}", scene.pose);
    }
    // Beside the pose it can't.
    let mut scene = Scene::new(Pose2 { x: 0.8, y: 0.3, theta: 0.0 }, &[]);
    scene.request(Dock::request(DockArguments { x: 0.8, y: 0.0, theta: 0.0, speed: 0.1 }));
    assert_eq!(scene.run(10), Some(Ending::FAILED));
}

#[test]
fn a_halt_ends_after_its_time() {
    let mut scene = Scene::new(START, &[]);
    scene.request(Halt::request(0.2));
    assert_eq!(scene.run(10), Some(Ending::COMPLETED));
    assert_eq!(scene.pose, START);
}
