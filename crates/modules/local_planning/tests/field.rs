//! Distance field, footprint and memory of scans.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use proptest::prelude::*;
use slate_interfaces::Pose2;
use slate_local_planning::{CertaintyGrid, FootprintPoints, ObservationBuffer, ObstacleField};
use slate_module::math;

use crate::common::footprint;

proptest! {
    #[test]
    fn distances_are_exact_up_to_a_cell(
        obstacles in prop::collection::vec((-1.9..1.9_f64, -1.9..1.9_f64), 1..12),
        center in (-50.0..50.0_f64, -50.0..50.0_f64), x in -1.9..1.9_f64, y in -1.9..1.9_f64,
    ) {
        let mut field = ObstacleField::new(4.0, 0.05).unwrap();
        let points: Vec<[f64; 2]> = obstacles.iter().map(|(x, y)| [center.0 + x, center.1 + y]).collect();
        field.update([center.0, center.1], points.iter().copied());
        let from = [center.0 + x, center.1 + y];
        let wanted = points.iter().map(|[x, y]| math::hypot(x - from[0], y - from[1])).fold(99.0, math::min);
        let found = field.distance(from[0], from[1]);
        // Both ends are moved to the middle of their cell.
        prop_assert!((found - wanted).abs() < 0.0708, "{found} {wanted}");
    }

    #[test]
    fn a_footprint_touches_what_is_inside_of_it(
        x in -0.24..0.24_f64, y in -0.19..0.19_f64, theta in -3.0..3.0_f64,
    ) {
        let pose = Pose2 { x: 3.0, y: -2.0, theta };
        let (sine, cosine) = (math::sin(theta), math::cos(theta));
        let mut field = ObstacleField::new(4.0, 0.05).unwrap();
        let inside = [pose.x + x * cosine - y * sine, pose.y + x * sine + y * cosine];
        field.update([pose.x, pose.y], std::iter::once(inside));
        let distance = FootprintPoints::new(&footprint()).distance(&field, &pose);
        // Beside the inscribed circle a point is up to 5 cm from the outline, whose points are a cell apart.
        prop_assert!(distance < 0.126, "{distance}");
    }
}

#[test]
fn a_field_without_obstacles_is_free_everywhere() {
    let mut field = ObstacleField::new(4.0, 0.05).unwrap();
    field.update([0.0, 0.0], [[f64::NAN, 0.0], [9.0, 0.0], [f64::INFINITY, 1.0]].into_iter());
    assert!(field.distance(0.0, 0.0) > 100.0 && field.distance(50.0, 0.0) > 100.0);
}

#[test]
fn points_of_earlier_scans_are_kept_for_their_time() {
    let mut memory = ObservationBuffer::new(2.0, 0.5);
    let at = |x: f64| Pose2 { x, y: 0.0, theta: std::f64::consts::FRAC_PI_2 };
    for step in 0..40_i32 {
        memory.insert(0.1 * f64::from(step), &at(f64::from(step)), &[[1.0, 0.0]]);
    }
    let mut seen: Vec<i64> = memory.points().map(|[x, _]| x.round() as i64).collect();
    assert!(memory.points().all(|[_, y]| (y - 1.0).abs() < 1e-9));
    seen.sort_unstable();
    assert_eq!(seen, [20, 25, 30, 35, 39]);
    memory.clear();
    assert_eq!(memory.points().count(), 1);
}

#[test]
fn a_single_cell_at_the_front_is_seen_wherever_it_is() {
    let points = FootprintPoints::new(&footprint());
    let mut field = ObstacleField::new(4.0, 0.05).unwrap();
    for offset in -18..=18 {
        // Just inside of the front.
        field.update([0.0, 0.0], std::iter::once([0.245, 0.01 * f64::from(offset)]));
        let distance = points.distance(&field, &Pose2 { x: -0.005, y: 0.0, theta: 0.0 });
        assert!(distance < 0.02, "{offset}: {distance}");
    }
}

#[test]
fn nothing_is_free_outside_of_a_field() {
    let points = FootprintPoints::new(&footprint());
    let mut field = ObstacleField::new(4.0, 0.05).unwrap();
    let at = |x: f64| Pose2 { x, y: 0.0, theta: 0.0 };
    assert!(points.distance(&field, &at(1.6)) > 1.0);
    assert_eq!(points.distance(&field, &at(1.8)), 0.0);
    assert!(field.contains(1.9, -1.9) && !field.contains(2.1, 0.0));
    field.update([f64::NAN, 0.0], std::iter::empty());
    assert!(!field.contains(0.0, 0.0) && points.distance(&field, &at(0.0)) == 0.0);
}

#[test]
fn a_scan_from_nowhere_leaves_earlier_ones() {
    let mut memory = ObservationBuffer::new(2.0, 0.0);
    memory.insert(0.0, &Pose2 { x: 0.0, y: 0.0, theta: 0.0 }, &[[1.0, 0.0]]);
    memory.insert(1.0, &Pose2 { x: f64::NAN, y: 0.0, theta: 0.0 }, &[[2.0, 0.0]]);
    memory.insert(f64::NAN, &Pose2 { x: 0.0, y: 0.0, theta: 0.0 }, &[[3.0, 0.0]]);
    assert!(memory.points().eq([[1.0, 0.0]]));
    // Time goes back.
    memory.insert(-5.0, &Pose2 { x: 0.0, y: 0.0, theta: 0.0 }, &[[4.0, 0.0]]);
    assert!(memory.points().eq([[4.0, 0.0]]));
}

#[test]
fn sonar_echoes_stay_while_the_pose_is_unknown() {
    let mut grid = CertaintyGrid::new(4.0, 0.1, 5.0).unwrap();
    grid.insert_cone(&Pose2 { x: 0.0, y: 0.0, theta: 0.0 }, 0.5, 1.0, true);
    let before = grid.cells().count();
    grid.advance(&Pose2 { x: f64::NAN, y: 0.0, theta: 0.0 }, 0.1);
    grid.advance(&Pose2 { x: 0.0, y: 0.0, theta: 0.0 }, f64::NAN);
    assert!(before > 0 && grid.cells().count() == before);
}
