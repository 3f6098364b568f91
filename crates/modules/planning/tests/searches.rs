//! Guarantees of the searches, on random grids.

use proptest::prelude::*;
use slate_module::math::min;
use slate_planning::{
    AStar, CostField, CostGrid, DStarLite, GridCell, GridPath, INSCRIBED, LETHAL, ThetaStar, UNKNOWN,
    line_cost,
};

const SIDE: u32 = 11;

fn costs() -> impl Strategy<Value = Vec<u8>> {
    let cost = prop_oneof![3 => Just(0), 2 => 1..INSCRIBED, 2 => Just(LETHAL), 1 => Just(UNKNOWN)];
    prop::collection::vec(cost, (SIDE * SIDE) as usize)
}

fn cell() -> impl Strategy<Value = GridCell> {
    (0..SIDE, 0..SIDE).prop_map(|(column, row)| GridCell::new(column, row))
}

fn grid(costs: &[u8], cost_factor: f64) -> CostGrid {
    CostGrid::new(SIDE, SIDE, |cell| costs[(cell.row * SIDE + cell.column) as usize])
        .unwrap()
        .with_cost_factor(cost_factor)
}

/// Cost of a step between neighbors; none where it leads to an impassable cell or cuts a corner.
fn step(grid: &CostGrid, a: GridCell, b: GridCell, cost_factor: f64) -> Option<f64> {
    let beside = [GridCell::new(a.column, b.row), GridCell::new(b.column, a.row), b];
    let is_near = a.column.abs_diff(b.column) <= 1 && a.row.abs_diff(b.row) <= 1 && a != b;
    let is_diagonal = a.column != b.column && a.row != b.row;
    let length = if is_diagonal { 2_f64.sqrt() } else { 1.0 };
    let is_free = is_near && beside.into_iter().all(|cell| grid.is_passable(cell));
    is_free.then(|| length * (1.0 + cost_factor * f64::from(grid.cost(b)) / 252.0))
}

/// Cost of the cheapest path, by relaxation until nothing changes (Bellman-Ford).
fn least(grid: &CostGrid, start: GridCell, goal: GridCell, cost_factor: f64) -> Option<f64> {
    let cells: Vec<GridCell> = (0..SIDE * SIDE).map(|k| GridCell::new(k % SIDE, k / SIDE)).collect();
    let index = |cell: GridCell| (cell.row * SIDE + cell.column) as usize;
    let mut costs = vec![f64::INFINITY; cells.len()];
    if grid.is_passable(start) {
        costs[index(start)] = 0.0;
    }
    loop {
        let before = costs.clone();
        for &a in &cells {
            for &b in &cells {
                if costs[index(a)].is_finite()
                    && let Some(step) = step(grid, a, b, cost_factor)
                {
                    costs[index(b)] = min(costs[index(b)], costs[index(a)] + step);
                }
            }
        }
        if costs == before {
            return Some(costs[index(goal)]).filter(|cost| cost.is_finite());
        }
    }
}

/// Sum of the path's steps.
fn total(grid: &CostGrid, path: &GridPath, cost_factor: f64) -> f64 {
    path.cells().windows(2).map(|pair| step(grid, pair[0], pair[1], cost_factor).unwrap()).sum()
}

/// A line by many points on it: none is in an impassable cell, nor is one beside it.
fn is_clear(grid: &CostGrid, a: GridCell, b: GridCell) -> bool {
    let at =
        |from: u32, to: u32, share: f64| f64::from(from) + 0.5 + share * (f64::from(to) - f64::from(from));
    (0..=2_000).all(|k| {
        let share = f64::from(k) / 2_000.0;
        let (x, y) = (at(a.column, b.column, share), at(a.row, b.row, share));
        let near = 1e-9;
        [(x - near, y - near), (x + near, y - near), (x - near, y + near), (x + near, y + near)]
            .into_iter()
            .all(|(x, y)| grid.is_passable(GridCell::new(x as u32, y as u32)))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn no_passable_cell_is_nearer_than_the_nearest(costs in costs(), from in cell(), reach in 0..SIDE) {
        let grid = grid(&costs, 0.0);
        let is_near = |cell: &GridCell| {
            cell.column.abs_diff(from.column) <= reach && cell.row.abs_diff(from.row) <= reach
        };
        let cells = (0..SIDE * SIDE).map(|k| GridCell::new(k % SIDE, k / SIDE));
        let distances = cells.filter(is_near).filter(|cell| grid.is_passable(*cell)).map(|cell| cell.distance(from));
        let nearest = grid.nearest_passable(from, reach);
        prop_assert!(nearest.is_none_or(|cell| is_near(&cell) && grid.is_passable(cell)));
        prop_assert_eq!(nearest.map(|cell| cell.distance(from)), distances.min_by(f64::total_cmp));
    }

    #[test]
    fn no_path_is_cheaper_than_a_stars(costs in costs(), start in cell(), goal in cell(), cost_factor in 0.0..9.0_f64) {
        let grid = grid(&costs, cost_factor);
        let mut planner = AStar::default();
        // Buffers of another search change nothing.
        planner.search(&grid, goal, start);
        let found = planner.search(&grid, start, goal);
        let least = least(&grid, start, goal, cost_factor);
        prop_assert_eq!(found.is_some(), least.is_some());
        if let (Some(path), Some(least)) = (found, least) {
            prop_assert_eq!((path.cells()[0], *path.cells().last().unwrap()), (start, goal));
            prop_assert!((path.cost() - least).abs() < 1e-9, "{} {least}", path.cost());
            prop_assert!((total(&grid, path, cost_factor) - least).abs() < 1e-9);
        }
    }

    #[test]
    fn a_cost_field_has_the_cheapest_paths(costs in costs(), start in cell(), goal in cell(), cost_factor in 0.0..9.0_f64) {
        let grid = grid(&costs, cost_factor);
        let mut field = CostField::default();
        prop_assert_eq!(field.cost(&grid, goal), f64::INFINITY);
        field.compute(&grid, goal);
        field.compute(&grid, start);
        let least = least(&grid, start, goal, cost_factor);
        prop_assert!(least.map_or(field.cost(&grid, goal) == f64::INFINITY, |least| (field.cost(&grid, goal) - least).abs() < 1e-9));
        let path = field.path(&grid, goal);
        prop_assert_eq!(path.is_some(), least.is_some());
        if let (Some(path), Some(least)) = (path, least) {
            prop_assert_eq!((path.cells()[0], *path.cells().last().unwrap()), (start, goal));
            prop_assert!((total(&grid, path, cost_factor) - least).abs() < 1e-9);
        }
    }

    #[test]
    fn lines_of_theta_star_are_clear_and_not_longer_than_steps(costs in costs(), start in cell(), goal in cell()) {
        let grid = grid(&costs, 0.0);
        let (mut planner, mut a_star) = (ThetaStar::default(), AStar::default());
        let found = planner.search(&grid, start, goal);
        let steps = a_star.search(&grid, start, goal);
        prop_assert_eq!(found.is_some(), steps.is_some());
        if let (Some(path), Some(steps)) = (found, steps) {
            prop_assert_eq!((path.cells()[0], *path.cells().last().unwrap()), (start, goal));
            prop_assert!(path.cost() <= steps.cost() + 1e-9);
            let lines: f64 = path.cells().windows(2).map(|pair| line_cost(&grid, pair[0], pair[1]).unwrap()).sum();
            prop_assert!((lines - path.cost()).abs() < 1e-9);
            prop_assert!(path.cells().windows(2).all(|pair| is_clear(&grid, pair[0], pair[1])));
        }
    }

    #[test]
    fn theta_star_goes_round_dear_cells(costs in costs(), start in cell(), goal in cell(), cost_factor in 0.5..9.0_f64) {
        let grid = grid(&costs, cost_factor);
        let mut planner = ThetaStar::default();
        if let Some(path) = planner.search(&grid, start, goal) {
            let direct = line_cost(&grid, start, goal);
            prop_assert!(direct.is_none_or(|direct| path.cost() <= direct + 1e-9), "{direct:?} {}", path.cost());
        }
    }

    #[test]
    fn d_star_lite_is_as_cheap_as_a_search_anew(
        costs in costs(), start in cell(), goal in cell(), cost_factor in 0.0..9.0_f64,
        changes in prop::collection::vec((prop::collection::vec((cell(), prop_oneof![Just(0), 1..INSCRIBED, Just(LETHAL)]), 0..6), 0..4_usize), 0..8),
    ) {
        let mut planner = DStarLite::new(grid(&costs, cost_factor), start, goal);
        let mut a_star = AStar::default();
        let mut here = start;
        for (cells, steps) in changes {
            for (cell, cost) in cells {
                planner.set_cost(cell, cost);
            }
            let exact = a_star.search(planner.grid(), here, goal).map(GridPath::cost);
            let grid = planner.grid().clone();
            let found = planner.plan();
            prop_assert_eq!(found.is_some(), exact.is_some());
            if let (Some(path), Some(exact)) = (found, exact) {
                prop_assert!((path.cost() - exact).abs() < 1e-9, "{} {exact}", path.cost());
                prop_assert!((total(&grid, path, cost_factor) - exact).abs() < 1e-9);
                here = path.cells()[steps.min(path.cells().len() - 1)];
                planner.move_to(here);
            }
        }
    }
}

#[test]
fn unknown_cells_are_crossed_where_that_is_allowed() {
    let grid = CostGrid::new(3, 1, |cell| if cell.column == 1 { UNKNOWN } else { 0 }).unwrap();
    let ends = (GridCell::new(0, 0), GridCell::new(2, 0));
    assert!(AStar::default().search(&grid, ends.0, ends.1).is_none());
    let grid = grid.with_cost_factor(252.0).allow_unknown(3);
    assert_eq!(AStar::default().search(&grid, ends.0, ends.1).unwrap().cost(), 5.0);
}

#[test]
fn cells_outside_of_the_grid_are_impassable() {
    let grid = CostGrid::new(2, 2, |_| 0).unwrap();
    let outside = GridCell::new(2, 0);
    assert!(AStar::default().search(&grid, outside, GridCell::new(0, 0)).is_none());
    assert!(ThetaStar::default().search(&grid, GridCell::new(0, 0), outside).is_none());
    assert!(DStarLite::new(grid.clone(), GridCell::new(0, 0), outside).plan().is_none());
    assert!(DStarLite::new(grid, outside, GridCell::new(0, 0)).plan().is_none());
}

#[test]
fn a_robot_that_is_shut_in_has_no_path_until_it_is_free_again() {
    let mut planner =
        DStarLite::new(CostGrid::new(3, 1, |_| 0).unwrap(), GridCell::new(0, 0), GridCell::new(2, 0));
    assert!(planner.plan().is_some());
    planner.set_cost(GridCell::new(0, 0), LETHAL);
    assert!(planner.plan().is_none());
    planner.set_cost(GridCell::new(1, 0), LETHAL);
    assert!(planner.plan().is_none());
    planner.set_cost(GridCell::new(0, 0), 0);
    planner.set_cost(GridCell::new(1, 0), 0);
    assert_eq!(planner.plan().unwrap().cost(), 2.0);
    assert!(!planner.move_to(GridCell::new(3, 0)));
}

#[test]
fn a_grid_that_is_too_large_is_refused_with_its_memory() {
    let refused = CostGrid::new(20_000, 20_000, |_| 0).unwrap_err().to_string();
    assert!(refused.contains("20000 x 20000 cells, which takes 11600 MB"), "{refused}");
    assert!(CostGrid::new(u32::MAX, u32::MAX, |_| 0).is_err());
    assert!(CostGrid::new(0, 5, |_| 0).is_err());
}

#[test]
fn a_robot_at_its_goal_searches_nothing() {
    let grid = CostGrid::new(3, 3, |_| 0).unwrap().allow_unknown(0).with_cost_factor(f64::NAN);
    let cell = GridCell::new(1, 1);
    for path in [AStar::default().search(&grid, cell, cell), ThetaStar::default().search(&grid, cell, cell)] {
        assert_eq!((path.unwrap().cells(), path.unwrap().cost()), (&[cell][..], 0.0));
    }
}
