//! Layers of a costmap.

use proptest::prelude::*;
use slate_grid::Geometry;
use slate_interfaces::Pose2;
use slate_planning::{Costmap, GridCell, INSCRIBED, Inflation, LETHAL, UNKNOWN};

const SIDE: usize = 20;

fn costmap() -> Costmap {
    let geometry = Geometry::new([0.0, 0.0], [2.0, 2.0], 0.1, 10_000).unwrap();
    Costmap::new(
        geometry,
        Inflation { inscribed_radius: 0.25, inflation_radius: 0.6, cost_scaling_factor: 4.0 },
    )
    .unwrap()
}

fn cell(index: usize) -> GridCell {
    GridCell::new((index % SIDE) as u32, (index / SIDE) as u32)
}

#[test]
fn a_beam_clears_what_it_goes_through_and_marks_where_it_ends() {
    let mut costmap = costmap();
    costmap.set_static(|index| if index == 16 * SIDE + 6 { 100 } else { -1 });
    assert_eq!(costmap.update().cost(GridCell::new(6, 10)), UNKNOWN);
    let sensor = Pose2 { x: 0.25, y: 1.05, theta: 0.0 };
    costmap.insert_scan(&sensor, &[[1.5, 0.0]], &[]);
    let grid = costmap.update();
    assert_eq!(grid.cost(GridCell::new(6, 10)), 0);
    assert_eq!(grid.cost(GridCell::new(17, 10)), LETHAL);
    // It is gone, and the laser sees nothing there.
    costmap.insert_scan(&sensor, &[], &[[1.7, 0.0]]);
    assert_eq!(costmap.update().cost(GridCell::new(17, 10)), 0);
    // A wall of the map stays, whatever goes through it.
    costmap.insert_scan(&Pose2 { x: 0.25, y: 1.65, theta: 0.0 }, &[], &[[1.0, 0.0]]);
    assert_eq!(costmap.update().cost(GridCell::new(6, 16)), LETHAL);
    costmap.clear_observations();
    assert_eq!(costmap.update().cost(GridCell::new(6, 10)), UNKNOWN);
}

#[test]
fn a_robot_keeps_out_of_zones_and_unseen_cells_stay_unknown() {
    let mut costmap = costmap();
    costmap.set_static(|index| if index / SIDE < 10 { 0 } else { -1 });
    costmap.keep_out(|index| cell(index) == GridCell::new(3, 3));
    let grid = costmap.update();
    assert_eq!(grid.cost(GridCell::new(3, 3)), LETHAL);
    assert_eq!(grid.cost(GridCell::new(4, 3)), INSCRIBED);
    assert_eq!((grid.cost(GridCell::new(15, 9)), grid.cost(GridCell::new(15, 10))), (0, UNKNOWN));
    assert!(!grid.is_passable(GridCell::new(15, 10)));
}

#[test]
fn beams_that_are_no_numbers_or_endless_change_nothing() {
    let mut costmap = costmap();
    costmap.set_static(|_| 0);
    let sensor = Pose2 { x: 1.0, y: 1.0, theta: 0.0 };
    costmap.insert_scan(&sensor, &[[f64::NAN, 0.0], [1e300, 0.0]], &[[f64::INFINITY, 0.0], [1e12, 0.0]]);
    for x in [f64::NAN, 1e18, -1e300] {
        costmap.insert_scan(&Pose2 { x, ..sensor }, &[[1.0, 0.0]], &[]);
    }
    let grid = costmap.update();
    assert!((0..SIDE * SIDE).all(|index| grid.cost(cell(index)) == 0));
}

proptest! {
    #[test]
    fn costs_fall_with_the_distance_to_the_nearest_obstacle(
        obstacles in prop::collection::btree_set(0..SIDE * SIDE, 0..12),
    ) {
        let mut costmap = costmap();
        let inflation = Inflation { inscribed_radius: 0.25, inflation_radius: 0.6, cost_scaling_factor: 4.0 };
        costmap.set_static(|index| if obstacles.contains(&index) { 100 } else { 0 });
        let grid = costmap.update();
        for index in 0..SIDE * SIDE {
            let nearest = obstacles
                .iter()
                .map(|other| {
                    let (a, b) = (cell(index), cell(*other));
                    let (columns, rows) = (a.column.abs_diff(b.column), a.row.abs_diff(b.row));
                    u64::from(columns * columns + rows * rows)
                })
                .min();
            let wanted = nearest.map_or(0, |square| inflation.cost((square as f64).sqrt() * 0.1));
            prop_assert_eq!(grid.cost(cell(index)), wanted);
        }
    }
}
