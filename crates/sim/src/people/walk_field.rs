use super::walk_grid::WalkGrid;
use crate::geometry::Point;

/// Path steps among which a person looks for the farthest visible point.
const LOOK_AHEAD: usize = 32;
/// Search radius for the next path after a person was pushed off all paths, cells.
const OFF_PATH: usize = 4;

/// Mark of a cell without a path to the place.
const UNREACHABLE: u8 = u8::MAX;
/// Mark of the place's own cell, as the side that is the cell itself.
const ARRIVED: u8 = 4;
/// Costs of steps to the neighbors: 5 along an axis, 7 along a diagonal.
/// 7/5 is 1 % less than the square root of 2.
const STEPS: [usize; 9] = [7, 5, 7, 5, 0, 5, 7, 5, 7];

/// Shortest paths from everywhere to a place.
#[derive(Debug)]
pub(super) struct WalkField {
    /// Side of each cell on which its path continues.
    next: Vec<u8>,
}

impl WalkField {
    /// Computes the paths to a place.
    /// Dijkstra's algorithm with a bucket for each cost (Dial, 1969).
    pub fn new(grid: &WalkGrid, place: usize) -> Self {
        let mut next = vec![UNREACHABLE; grid.len()];
        let mut costs = vec![usize::MAX; grid.len()];
        let mut buckets: [Vec<usize>; 8] = Default::default();
        let mut left = 1;
        (next[place], costs[place]) = (ARRIVED, 0);
        buckets[0].push(place);
        let mut cost = 0;
        while left > 0 {
            while let Some(cell) = buckets[cost % 8].pop() {
                left -= 1;
                if costs[cell] != cost {
                    continue;
                }
                for side in (0..9).filter(|side| *side != ARRIVED) {
                    let Some(other) = grid.beside(cell, side).filter(|other| grid.is_free(*other)) else {
                        continue;
                    };
                    let other_cost = cost + STEPS[usize::from(side)];
                    if other_cost < costs[other] && !cuts_corner(grid, cell, side) {
                        // The path leads back to where the search came from.
                        (costs[other], next[other]) = (other_cost, 8 - side);
                        buckets[other_cost % 8].push(other);
                        left += 1;
                    }
                }
            }
            cost += 1;
        }
        Self { next }
    }

    /// Returns the next waypoint from a point.
    /// It is the farthest visible point of the path, up to some meters ahead.
    pub fn ahead(&self, grid: &WalkGrid, from: Point) -> Option<Point> {
        let mut cell = self.on_path(grid, from)?;
        let mut path = [cell; LOOK_AHEAD];
        for step in &mut path {
            *step = cell;
            cell = grid.beside(cell, self.next[cell]).unwrap_or(cell);
        }
        let mut points = path.iter().rev().map(|cell| grid.center(*cell));
        points.find(|point| grid.is_straight(from, *point)).or_else(|| Some(grid.center(path[0])))
    }

    /// Returns the nearest cell with a path to the place, near a point.
    fn on_path(&self, grid: &WalkGrid, point: Point) -> Option<usize> {
        let own = grid.cell(point)?;
        if self.next[own] != UNREACHABLE {
            return Some(own);
        }
        let width = grid.width();
        let (column, row) = (own % width, own / width);
        let rows = row.saturating_sub(OFF_PATH)..=(row + OFF_PATH).min(grid.len() / width - 1);
        let columns = column.saturating_sub(OFF_PATH)..=(column + OFF_PATH).min(width - 1);
        let around = rows.flat_map(|row| columns.clone().map(move |column| row * width + column));
        let distance = |cell: &usize| grid.center(*cell).minus(point).norm();
        around
            .filter(|cell| self.next[*cell] != UNREACHABLE)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

/// Returns whether a diagonal step passes a cell that is not free.
fn cuts_corner(grid: &WalkGrid, cell: usize, side: u8) -> bool {
    let (right, up) = (side % 3, side / 3);
    let is_free = |side: u8| grid.beside(cell, side).is_some_and(|other| grid.is_free(other));
    right != 1 && up != 1 && !(is_free(3 + right) && is_free(3 * up + 1))
}
