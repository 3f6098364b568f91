//! Paths of a robot that steers as a car, with its footprint.

use slate_avoidance::Footprint;
use slate_grid::Geometry;
use slate_interfaces::Pose2;
use slate_module::{Random, math};
use slate_planning::{
    DriveModel, DrivenPose, FootprintGrid, HybridAStar, HybridAStarParameters, HybridSearchError, dubins,
    reeds_shepp,
};

const RESOLUTION: f64 = 0.1;

/// Origin between the rear wheels.
fn footprint() -> Footprint {
    Footprint::new(&[[-0.15, -0.2], [0.65, -0.2], [0.65, 0.2], [-0.15, 0.2]]).unwrap()
}

/// A grid from (0, 0) with walls, each from its lower left to its upper right corner.
fn grid(size: [f64; 2], walls: &[[f64; 4]]) -> FootprintGrid {
    let geometry = Geometry::new([0.0, 0.0], size, RESOLUTION, 1_000_000).unwrap();
    FootprintGrid::new(geometry, |cell| {
        let center = geometry.center(cell % geometry.width, cell / geometry.width);
        walls.iter().any(|[left, low, right, high]| {
            (*left..*right).contains(&center.x) && (*low..*high).contains(&center.y)
        })
    })
}

fn planner(parameters: HybridAStarParameters) -> HybridAStar {
    HybridAStar::new(parameters, footprint()).unwrap()
}

/// Without penalties, so that the shortest path is the cheapest.
fn shortest() -> HybridAStarParameters {
    HybridAStarParameters {
        minimum_turning_radius: 0.6,
        reverse_penalty: 1.0,
        non_straight_penalty: 1.0,
        ..HybridAStarParameters::default()
    }
}

fn pose(x: f64, y: f64, theta: f64) -> Pose2 {
    Pose2 { x, y, theta }
}

/// Checks ends, steps, turns and obstacles of a path; returns its length, and how often it changes direction.
fn check(path: &[DrivenPose], start: Pose2, goal: Pose2, walls: &[[f64; 4]], radius: f64) -> (f64, usize) {
    let near = |a: &Pose2, b: &Pose2| {
        math::hypot(a.x - b.x, a.y - b.y) < 1e-6 && math::angle_between(a.theta, b.theta).abs() < 1e-6
    };
    assert!(near(&path[0].pose, &start) && near(&path.last().unwrap().pose, &goal));
    let mut length = 0.0;
    for pair in path.windows(2) {
        let (from, to) = (pair[0].pose, pair[1].pose);
        let (step, turn) =
            (math::hypot(to.x - from.x, to.y - from.y), math::angle_between(from.theta, to.theta));
        assert!(step < 0.051 && turn.abs() <= step * 1.001 / radius + 1e-9, "{step} {turn}");
        // Along the heading, ahead or back.
        let along = math::angle_between(from.theta + 0.5 * turn, math::atan2(to.y - from.y, to.x - from.x));
        assert!(step < 1e-9 || (along.abs() < 1e-3) != pair[1].is_reverse);
        length += step;
    }
    let outline: Vec<[f64; 2]> = footprint().outline().collect();
    for DrivenPose { pose, .. } in path {
        for [left, low, right, high] in walls {
            // Points of the outline, 1 cm inside of the wall.
            let is_hit = (0..4).flat_map(|side| (0..10).map(move |part| (side, f64::from(part) / 10.0))).any(
                |(side, share)| {
                    let (a, b) = (outline[side], outline[(side + 1) % 4]);
                    let (x, y) = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]));
                    let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
                    let (x, y) = (pose.x + x * cosine - y * sine, pose.y + x * sine + y * cosine);
                    x > left + 0.01 && x < right - 0.01 && y > low + 0.01 && y < high - 0.01
                },
            );
            assert!(!is_hit, "{pose:?}");
        }
    }
    (length, path.windows(2).skip(1).filter(|pair| pair[0].is_reverse != pair[1].is_reverse).count())
}

#[test]
fn paths_in_free_space_are_the_shortest() {
    let grid = grid([8.0, 8.0], &[]);
    let mut random = Random::new(1, "poses");
    for _ in 0..20 {
        let mut any = || pose(random.uniform(2.0, 6.0), random.uniform(2.0, 6.0), random.uniform(-3.0, 3.0));
        let (start, goal) = (any(), any());
        let mut both = planner(shortest());
        let path = both.search(&grid, start, goal).unwrap();
        let (length, _) = check(path, start, goal, &[], 0.6);
        let least = reeds_shepp(&start, &goal, 0.6).length();
        assert!((both.cost() - least).abs() < 1e-6 && length <= least, "{} {least}", both.cost());
        let mut forward = planner(HybridAStarParameters { drive_model: DriveModel::Dubins, ..shortest() });
        let path = forward.search(&grid, start, goal).unwrap();
        assert!(path.iter().all(|pose| !pose.is_reverse));
        let least = dubins(&start, &goal, 0.6).length();
        assert!((forward.cost() - least).abs() < 1e-6);
    }
}

/// A street with a gap between two parked cars on its right.
const STREET: [[f64; 4]; 4] =
    [[0.0, 0.0, 4.0, 0.2], [0.0, 1.8, 4.0, 2.0], [0.0, 0.0, 1.2, 0.7], [2.6, 0.0, 4.0, 0.7]];

#[test]
fn a_robot_parks_between_two_others() {
    let grid = grid([4.0, 2.0], &STREET);
    let (start, goal) = (pose(1.0, 1.2, 0.0), pose(1.6, 0.45, 0.0));
    let mut planner = planner(shortest());
    let path = planner.search(&grid, start, goal).unwrap();
    let (length, changes) = check(path, start, goal, &STREET, 0.6);
    assert!(path.iter().any(|pose| pose.is_reverse) && changes >= 1);
    assert!(length < 6.0, "{length}");
}

#[test]
fn a_robot_turns_round_in_a_dead_end() {
    // Too narrow for a half circle.
    let walls = [[0.0, 0.0, 4.0, 0.2], [0.0, 1.5, 4.0, 1.7], [3.8, 0.0, 4.0, 1.7]];
    let grid = grid([4.0, 1.7], &walls);
    let (start, goal) = (pose(1.5, 0.85, 0.0), pose(1.5, 0.85, math::wrap_angle(std::f64::consts::PI)));
    let mut planner = planner(shortest());
    let path = planner.search(&grid, start, goal).unwrap();
    let (length, changes) = check(path, start, goal, &walls, 0.6);
    assert!(changes >= 2 && length < 6.0, "{changes} {length}");
}

#[test]
fn without_reverse_no_robot_turns_in_a_dead_end() {
    let walls = [[0.0, 0.0, 4.0, 0.2], [0.0, 1.5, 4.0, 1.7], [3.8, 0.0, 4.0, 1.7]];
    let grid = grid([4.0, 1.7], &walls);
    let mut planner = planner(HybridAStarParameters { drive_model: DriveModel::Dubins, ..shortest() });
    let found = planner.search(&grid, pose(1.5, 0.85, 0.0), pose(1.5, 0.85, 3.0)).map(<[DrivenPose]>::len);
    assert_eq!(found, Err(HybridSearchError::NoPath));
}

#[test]
fn a_path_leads_round_a_wall() {
    let walls = [[2.0, 0.0, 2.2, 3.0]];
    let grid = grid([4.0, 4.5], &walls);
    let (start, goal) = (pose(1.0, 1.0, 1.5), pose(3.2, 1.0, -1.5));
    let mut planner = planner(HybridAStarParameters { reverse_penalty: 3.0, ..shortest() });
    let path = planner.search(&grid, start, goal).unwrap();
    let (length, _) = check(path, start, goal, &walls, 0.6);
    assert!((5.0..9.0).contains(&length), "{length}");
    assert!(path.iter().filter(|pose| pose.is_reverse).count() * 4 < path.len());
}

#[test]
fn reverse_is_used_where_it_pays() {
    let grid = grid([6.0, 4.0], &[]);
    let (start, goal) = (pose(3.0, 2.0, 0.0), pose(2.0, 2.0, 0.0));
    let mut planner = planner(HybridAStarParameters { reverse_penalty: 2.0, ..shortest() });
    let path = planner.search(&grid, start, goal).unwrap();
    assert!(path.iter().all(|pose| pose.is_reverse));
    assert!((planner.cost() - 2.0).abs() < 1e-6);
}

#[test]
fn unreachable_cells_are_reported() {
    let walls = [[2.0, 0.0, 2.2, 4.0]];
    let grid = grid([4.0, 4.0], &walls);
    let mut planner = planner(shortest());
    let mut search = |start, goal| planner.search(&grid, start, goal).map(<[DrivenPose]>::len);
    let free = pose(1.0, 2.0, 1.5);
    assert_eq!(search(pose(2.1, 2.0, 0.0), free), Err(HybridSearchError::StartOccupied));
    assert_eq!(search(free, pose(1.5, 2.0, 0.0)), Err(HybridSearchError::GoalOccupied));
    assert_eq!(search(free, pose(-1.0, 2.0, 0.0)), Err(HybridSearchError::GoalOccupied));
    assert_eq!(search(free, Pose2::UNKNOWN), Err(HybridSearchError::GoalOccupied));
    assert_eq!(search(free, pose(3.0, 2.0, 1.5)), Err(HybridSearchError::NoPath));
    assert_eq!(search(free, free), Ok(1));
}

#[test]
fn a_search_gives_up_after_its_iterations() {
    let grid = grid([4.0, 2.0], &STREET);
    let mut planner = planner(HybridAStarParameters { max_iterations: 5, ..shortest() });
    let found = planner.search(&grid, pose(1.0, 1.2, 0.0), pose(1.6, 0.45, 0.0)).map(<[DrivenPose]>::len);
    assert_eq!(found, Err(HybridSearchError::GaveUp(5)));
}

#[test]
fn invalid_search_parameters_are_refused_by_name() {
    let wrong = HybridAStarParameters { minimum_turning_radius: 0.0, ..shortest() };
    let refused = HybridAStar::new(wrong, footprint()).unwrap_err().to_string();
    assert!(refused.contains("minimum_turning_radius"), "{refused}");
}
