//! Shortest paths of robots that steer as cars.

use proptest::prelude::*;
use slate_interfaces::Pose2;
use slate_module::math;
use slate_planning::{SteeringPath, dubins, reeds_shepp};

fn pose() -> impl Strategy<Value = Pose2> {
    (-6.0..6.0_f64, -6.0..6.0_f64, -3.1..3.1_f64).prop_map(|(x, y, theta)| Pose2 { x, y, theta })
}

/// Whether a path ends there, and no two of its poses are farther apart than it says.
fn leads_to(path: &SteeringPath, start: &Pose2, end: &Pose2) -> bool {
    let mut last = *start;
    for (pose, _) in path.poses(*start, 0.1) {
        if math::hypot(pose.x - last.x, pose.y - last.y) > 0.1 + 1e-9 {
            return false;
        }
        last = pose;
    }
    let is_there = math::hypot(last.x - end.x, last.y - end.y) < 1e-6;
    is_there && math::angle_between(last.theta, end.theta).abs() < 1e-6
}

fn distance(a: &Pose2, b: &Pose2) -> f64 {
    math::hypot(a.x - b.x, a.y - b.y)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn paths_lead_from_start_to_end(start in pose(), end in pose(), radius in 0.3..3.0_f64) {
        let (forward, both) = (dubins(&start, &end, radius), reeds_shepp(&start, &end, radius));
        prop_assert!(leads_to(&forward, &start, &end) && leads_to(&both, &start, &end));
        prop_assert!(forward.segments().all(|segment| segment.length > 0.0));
        // Reverse can only shorten, and nothing is shorter than a line.
        prop_assert!(both.length() <= forward.length() + 1e-6);
        prop_assert!(both.length() >= distance(&start, &end) - 1e-6);
    }

    #[test]
    fn reeds_shepp_paths_are_as_long_the_other_way(start in pose(), end in pose()) {
        let (there, back) = (reeds_shepp(&start, &end, 1.0).length(), reeds_shepp(&end, &start, 1.0).length());
        prop_assert!((there - back).abs() < 1e-6, "{there} {back}");
    }

    #[test]
    fn a_stop_on_the_way_makes_no_path_shorter(start in pose(), stop in pose(), end in pose()) {
        for path in [dubins, reeds_shepp] {
            let direct = path(&start, &end, 1.0).length();
            let around = path(&start, &stop, 1.0).length() + path(&stop, &end, 1.0).length();
            prop_assert!(direct <= around + 1e-6, "{direct} {around}");
        }
    }
}

#[test]
fn known_lengths_are_found() {
    use std::f64::consts::PI;
    let origin = Pose2::default();
    let at = |x: f64, y: f64, theta: f64| Pose2 { x, y, theta };
    // A half turn to the left; straight on; straight back; a turn on the spot by three arcs of 60 degrees.
    assert!((dubins(&origin, &at(0.0, 2.0, PI), 1.0).length() - PI).abs() < 1e-9);
    assert!((dubins(&origin, &at(5.0, 0.0, 0.0), 1.0).length() - 5.0).abs() < 1e-9);
    assert!((reeds_shepp(&origin, &at(-5.0, 0.0, 0.0), 1.0).length() - 5.0).abs() < 1e-9);
    assert!((reeds_shepp(&origin, &at(0.0, 0.0, PI), 1.0).length() - PI).abs() < 1e-9);
    assert_eq!(reeds_shepp(&origin, &origin, 1.0).length(), 0.0);
}
