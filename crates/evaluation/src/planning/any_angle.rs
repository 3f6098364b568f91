//! Shortest path of any angle, as a reference.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use slate_module::math::min;
use slate_planning::{AStar, CostGrid, GridCell, ThetaStar, line_cost};

/// Returns the length of the shortest any-angle path, cells.
/// It consists of straight lines between middles of cells; `None` if no path exists.
///
/// A* on the visibility graph of the start, the goal and the cells around convex corners of obstacles. Lines are free
/// as those of [`line_cost`] are. It is slow, and for references only.
pub fn shortest_any_angle(grid: &CostGrid, start: GridCell, goal: GridCell) -> Option<f64> {
    // No path that is longer than one that is known needs to be looked at.
    let steps = AStar::default().search(grid, start, goal)?.cost();
    let known = ThetaStar::default().search(grid, start, goal).map_or(steps, |path| min(path.cost(), steps));
    let mut cells: Vec<GridCell> = (0..grid.height())
        .flat_map(|row| (0..grid.width()).map(move |column| GridCell::new(column, row)))
        .filter(|cell| start.distance(*cell) + cell.distance(goal) <= known + 1e-9 && is_corner(grid, *cell))
        .collect();
    cells.push(goal);
    let mut costs = vec![f64::INFINITY; cells.len()];
    let mut open = BinaryHeap::new();
    let mut closed = vec![false; cells.len()];
    let mut visit =
        |from: GridCell, cost: f64, open: &mut BinaryHeap<Reverse<(QueueCost, usize)>>, closed: &[bool]| {
            for (at, cell) in cells.iter().enumerate() {
                let direct = cost + from.distance(*cell);
                let total = direct + cell.distance(goal);
                if !closed[at]
                    && direct < costs[at]
                    && total <= known + 1e-9
                    && line_cost(grid, from, *cell).is_some()
                {
                    costs[at] = direct;
                    open.push(Reverse((QueueCost(total), at)));
                }
            }
        };
    visit(start, 0.0, &mut open, &closed);
    while let Some(Reverse((QueueCost(total), at))) = open.pop() {
        let cell = cells[at];
        if at == cells.len() - 1 {
            return Some(total);
        }
        if !std::mem::replace(&mut closed[at], true) {
            visit(cell, total - cell.distance(goal), &mut open, &closed);
        }
    }
    None
}

/// Ordered by value.
#[derive(Clone, Copy, PartialEq)]
struct QueueCost(f64);

impl Eq for QueueCost {}

impl Ord for QueueCost {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for QueueCost {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// Returns true if the cell touches one at an obstacle's convex corner.
fn is_corner(grid: &CostGrid, cell: GridCell) -> bool {
    let near = |by: i32, of: i32| (by.wrapping_add(of)) as u32;
    let neighbors = (-1..=1).flat_map(|up| (-1..=1).map(move |right| (right, up)));
    grid.is_passable(cell)
        && neighbors
            .map(|(right, up)| GridCell::new(near(cell.column as i32, right), near(cell.row as i32, up)))
            .any(|cell| touches_corner(grid, cell))
}

fn touches_corner(grid: &CostGrid, cell: GridCell) -> bool {
    let at = |right: i32, up: i32| {
        GridCell::new(
            (cell.column as i32).wrapping_add(right) as u32,
            (cell.row as i32).wrapping_add(up) as u32,
        )
    };
    let is_free = |right: i32, up: i32| grid.is_passable(at(right, up));
    grid.is_passable(cell)
        && [(1, 1), (-1, 1), (-1, -1), (1, -1)]
            .into_iter()
            .any(|(right, up)| is_free(right, 0) && is_free(0, up) && !is_free(right, up))
}
