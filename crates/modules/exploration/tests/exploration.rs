//! Frontiers and goals.

use proptest::prelude::*;
use slate_exploration::{
    Exploration, ExplorationParameters, FrontierDetector, GoalSelection, InformationGain,
};
use slate_grid::{Geometry, OccupancyMap, UNKNOWN_CELL};
use slate_planning::{CostGrid, GridCell, LETHAL, UNKNOWN};

fn map(rows: &[&str]) -> OccupancyMap {
    let (width, height) = (rows[0].len(), rows.len());
    let geometry =
        Geometry::new([0.0, 0.0], [0.1 * width as f64, 0.1 * height as f64], 0.1, 100_000).unwrap();
    let cell = |text: u8| match text {
        b'.' => 0,
        b'#' => 100,
        _ => UNKNOWN_CELL,
    };
    // The last line is the lowest row.
    OccupancyMap { geometry, cells: rows.iter().rev().flat_map(|row| row.bytes().map(cell)).collect() }
}

fn costs(map: &OccupancyMap) -> CostGrid {
    let Geometry { width, height, .. } = map.geometry;
    let cost = |cell: GridCell| match map.cells[cell.row as usize * width + cell.column as usize] {
        0 => 0,
        UNKNOWN_CELL => UNKNOWN,
        _ => LETHAL,
    };
    CostGrid::new(width as u32, height as u32, cost).unwrap()
}

fn exploration(goal_selection: GoalSelection) -> Exploration {
    let min_frontier_size = 0.0;
    Exploration::new(ExplorationParameters {
        goal_selection,
        min_frontier_size,
        ..ExplorationParameters::default()
    })
}

/// A room with a small unknown corner behind a wall near the robot, and a door to the unknown at the far end.
const ROOM: [&str; 5] = [
    "##############??????",
    "?..#.........#??????",
    "#..#.........???????",
    "#............#??????",
    "##############??????",
];

#[test]
fn frontiers_are_free_cells_beside_unknown_ones() {
    let mut detector = FrontierDetector::default();
    detector.update(&map(&ROOM));
    let found: Vec<Vec<GridCell>> =
        detector.frontiers(1).into_iter().map(|frontier| frontier.cells).collect();
    assert_eq!(found, [[GridCell::new(12, 2)], [GridCell::new(1, 3)]]);
    assert!(detector.frontiers(2).is_empty());
}

#[test]
fn the_nearest_frontier_is_not_the_best_view() {
    let map = map(&ROOM);
    let robot = GridCell::new(4, 2);
    let near = exploration(GoalSelection::NearestFrontier).next_goal(&map, &costs(&map), robot).unwrap();
    assert_eq!(near.cell, GridCell::new(1, 3));
    let far = exploration(GoalSelection::InformationGain).next_goal(&map, &costs(&map), robot).unwrap();
    assert_eq!(far.frontier.cells, [GridCell::new(12, 2)]);
    assert!(far.information_gain > near.information_gain);
    let view = exploration(GoalSelection::NextBestView).next_goal(&map, &costs(&map), robot).unwrap();
    assert!(view.utility >= far.utility);
}

#[test]
fn a_goal_on_the_blacklist_is_left_out_until_it_is_cleared() {
    let map = map(&ROOM);
    let robot = GridCell::new(4, 2);
    let mut exploration = exploration(GoalSelection::NearestFrontier);
    let first = exploration.next_goal(&map, &costs(&map), robot).unwrap();
    exploration.blacklist(&first);
    let second = exploration.next_goal(&map, &costs(&map), robot).unwrap();
    assert_eq!(second.cell, GridCell::new(12, 2));
    exploration.blacklist(&second);
    assert!(exploration.next_goal(&map, &costs(&map), robot).is_none());
    exploration.clear_blacklist();
    assert_eq!(exploration.next_goal(&map, &costs(&map), robot).unwrap().cell, first.cell);
}

#[test]
fn a_goal_is_kept_while_another_is_little_better() {
    // Two doors of the same kind, one on each side.
    let map = map(&["####################", "?..................?", "####################"]);
    let mut exploration = Exploration::new(ExplorationParameters {
        goal_selection: GoalSelection::InformationGain,
        min_frontier_size: 0.0,
        path_cost_exponent: 1.0,
        ..ExplorationParameters::default()
    });
    let left = exploration.next_goal(&map, &costs(&map), GridCell::new(9, 1)).unwrap();
    assert_eq!(left.cell, GridCell::new(1, 1));
    // The other one is nearer now, but only just.
    let kept = exploration.next_goal(&map, &costs(&map), GridCell::new(10, 1)).unwrap();
    assert_eq!(kept.cell, left.cell);
    let changed = exploration.next_goal(&map, &costs(&map), GridCell::new(15, 1)).unwrap();
    assert_eq!(changed.cell, GridCell::new(18, 1));
}

#[test]
fn a_map_that_is_known_or_that_hides_the_robot_has_no_goal() {
    let known = map(&["####", "#..#", "####"]);
    let robot = GridCell::new(1, 1);
    assert!(exploration(GoalSelection::NextBestView).next_goal(&known, &costs(&known), robot).is_none());
    let shut_in = map(&["#####", "#.#.?", "#####"]);
    assert!(exploration(GoalSelection::NextBestView).next_goal(&shut_in, &costs(&shut_in), robot).is_none());
}

#[test]
fn a_robot_too_near_a_wall_explores_from_the_nearest_free_cell() {
    let map = map(&ROOM);
    let (wall, beside) = (GridCell::new(4, 0), GridCell::new(4, 1));
    let goal = |robot| exploration(GoalSelection::NearestFrontier).next_goal(&map, &costs(&map), robot);
    assert_eq!(goal(wall), goal(beside));
    assert!(goal(wall).is_some());
}

#[test]
fn walls_hide_the_unknown() {
    let mut gain = InformationGain::new(7.0);
    let open = map(&["...?", "...?", "...?"]);
    let shut = map(&["..#?", "..#?", "..#?"]);
    let robot = GridCell::new(0, 1);
    assert!((gain.area(&open, robot) - 0.03).abs() < 1e-9);
    assert_eq!(gain.area(&shut, robot), 0.0);
}

proptest! {
    #[test]
    fn frontiers_after_changes_are_those_of_the_whole_map(
        before in prop::collection::vec(prop_oneof![Just(0_i8), Just(100), Just(UNKNOWN_CELL)], 63),
        after in prop::collection::vec(prop_oneof![Just(0_i8), Just(100), Just(UNKNOWN_CELL)], 63),
    ) {
        let geometry = Geometry::new([0.0, 0.0], [0.9, 0.7], 0.1, 100).unwrap();
        let mut changed = FrontierDetector::default();
        changed.update(&OccupancyMap { geometry, cells: before });
        let map = OccupancyMap { geometry, cells: after };
        changed.update(&map);
        let mut whole = FrontierDetector::default();
        whole.update(&map);
        prop_assert_eq!(changed.frontiers(1), whole.frontiers(1));
    }
}
