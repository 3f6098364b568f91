//! Vector field histogram of a ring of sonars.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_interfaces::{Point2, Pose2};
use slate_local_planning::{CertaintyGrid, PlanarVelocity, VfhPlus, VfhPlusParameters};
use slate_module::{Random, math};

use crate::common::{PERIOD, RADIUS, drive, standing};

const CONE: f64 = 0.52;
const RANGE: f64 = 3.0;

/// Inserts what sixteen sonars all round the robot hear.
fn hear(grid: &mut CertaintyGrid, pose: &Pose2, columns: &[[f64; 2]]) {
    for k in 0..16 {
        let theta = pose.theta + f64::from(k) * std::f64::consts::PI / 8.0;
        let sonar = Pose2 { x: pose.x + 0.2 * math::cos(theta), y: pose.y + 0.2 * math::sin(theta), theta };
        let range = columns
            .iter()
            .map(|[x, y]| (x - sonar.x, y - sonar.y))
            .filter(|(across, up)| math::angle_between(theta, math::atan2(*up, *across)).abs() < 0.5 * CONE)
            .map(|(across, up)| math::hypot(across, up) - RADIUS)
            .fold(RANGE, math::min);
        grid.insert_cone(&sonar, CONE, range, range < RANGE);
    }
}

#[test]
fn a_ring_of_sonars_leads_round_columns() {
    let columns = [[1.5, 0.1], [2.8, -0.5], [3.0, 1.2]];
    let mut grid = CertaintyGrid::new(5.0, 0.1, 1.5).unwrap();
    let mut planner = VfhPlus::new(VfhPlusParameters::default()).unwrap();
    let target = Point2 { x: 4.5, y: 0.0 };
    let ride = drive(standing(0.0, 0.0, 0.0), &columns, [4.5, 0.0], 40.0, |state, _| {
        grid.advance(&state.pose, PERIOD);
        hear(&mut grid, &state.pose, &columns);
        planner.plan(state, target, &grid).unwrap_or(PlanarVelocity::ZERO)
    });
    assert!(ride.has_arrived && ride.clearance > 0.0, "{ride:?}");
}

#[test]
fn echoes_fade_within_their_memory() {
    let mut grid = CertaintyGrid::new(5.0, 0.1, 1.0).unwrap();
    let here = Pose2 { x: 7.0, y: -3.0, theta: 0.0 };
    grid.advance(&here, 0.0);
    for _ in 0..3 {
        grid.insert_cone(&here, CONE, 1.0, true);
    }
    assert!(grid.cells().count() > 3);
    let nearest = grid.cells().map(|(middle, _)| middle.x - 7.0).fold(9.0, math::min);
    assert!((0.7..1.1).contains(&nearest), "{nearest}");
    grid.advance(&here, 5.0);
    assert_eq!(grid.cells().count(), 0);
}

#[test]
fn a_cone_without_an_echo_clears_what_is_in_it() {
    let mut grid = CertaintyGrid::new(5.0, 0.1, 100.0).unwrap();
    let here = Pose2 { x: 0.0, y: 0.0, theta: 1.0 };
    grid.insert_cone(&here, CONE, 1.0, true);
    (0..4).for_each(|_| grid.insert_cone(&here, CONE, RANGE, false));
    assert_eq!(grid.cells().count(), 0);
}

#[test]
fn a_robot_that_is_shut_in_gets_no_direction() {
    let columns: Vec<[f64; 2]> =
        (0..24).map(|k| 0.2618 * f64::from(k)).map(|a| [0.8 * math::cos(a), 0.8 * math::sin(a)]).collect();
    let mut grid = CertaintyGrid::new(5.0, 0.1, 1.5).unwrap();
    let state = standing(0.0, 0.0, 0.0);
    (0..5).for_each(|_| hear(&mut grid, &state.pose, &columns));
    let mut planner = VfhPlus::new(VfhPlusParameters::default()).unwrap();
    assert!(planner.plan(&state, Point2 { x: 4.0, y: 0.0 }, &grid).is_none());
}

#[test]
fn parameters_that_no_histogram_can_have_are_named() {
    let refused = |parameters: VfhPlusParameters| VfhPlus::new(parameters).unwrap_err().name;
    assert_eq!(refused(VfhPlusParameters { sectors: 0, ..VfhPlusParameters::default() }), "sectors");
    let low = VfhPlusParameters { threshold_low: 9.0, ..VfhPlusParameters::default() };
    assert_eq!(refused(low), "threshold_low");
    assert_eq!(CertaintyGrid::new(5.0, 0.0, 1.0).unwrap_err().name, "resolution");
}

#[test]
fn random_fields_of_columns_are_crossed_without_a_touch() {
    let mut arrived = 0;
    for seed in 0..20 {
        let mut random = Random::new(seed, "columns");
        let mut columns: Vec<[f64; 2]> = Vec::new();
        for _ in 0..60 {
            let next = [random.uniform(1.0, 5.0), random.uniform(-2.0, 2.0)];
            // Passages are at least 1.2 m wide.
            if columns.iter().all(|[x, y]| math::hypot(next[0] - x, next[1] - y) > 1.4) {
                columns.push(next);
            }
        }
        let mut grid = CertaintyGrid::new(5.0, 0.1, 1.5).unwrap();
        let mut planner = VfhPlus::new(VfhPlusParameters::default()).unwrap();
        let target = Point2 { x: 6.0, y: 0.0 };
        let ride = drive(standing(0.0, 0.0, 0.0), &columns, [6.0, 0.0], 60.0, |state, _| {
            grid.advance(&state.pose, PERIOD);
            hear(&mut grid, &state.pose, &columns);
            planner.plan(state, target, &grid).unwrap_or(PlanarVelocity::ZERO)
        });
        arrived += usize::from(ride.has_arrived);
        assert!(ride.clearance > 0.0, "seed {seed}: {ride:?}");
    }
    assert!(arrived >= 18, "{arrived} of 20");
}
