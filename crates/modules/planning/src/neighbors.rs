//! Steps between neighboring cells.

use std::f64::consts::SQRT_2;

use crate::cost_grid::CostGrid;

/// Step to a neighbor.
#[derive(Clone, Copy)]
pub(crate) struct GridStep {
    pub to: u32,
    /// Columns to the right and rows up.
    pub columns: i32,
    pub rows: i32,
    /// Length of the step, in cells.
    pub length: f64,
}

/// Calls `visit` with each step that leaves the cell.
/// A diagonal step is valid only where both cells beside it are passable, so that no corner is cut.
#[inline(always)]
pub(crate) fn for_each_step(grid: &CostGrid, from: u32, mut visit: impl FnMut(GridStep)) {
    let stride = grid.stride();
    let is_open = |to: u32| grid.is_open(to);
    let (right, up, left, down) = (from + 1, from + stride, from - 1, from - stride);
    let (is_right, is_up, is_left, is_down) = (is_open(right), is_open(up), is_open(left), is_open(down));
    let mut offer = |is_free: bool, to: u32, columns: i32, rows: i32, length: f64| {
        if is_free {
            visit(GridStep { to, columns, rows, length });
        }
    };
    offer(is_right, right, 1, 0, 1.0);
    offer(is_up, up, 0, 1, 1.0);
    offer(is_left, left, -1, 0, 1.0);
    offer(is_down, down, 0, -1, 1.0);
    offer(is_right && is_up && is_open(up + 1), up + 1, 1, 1, SQRT_2);
    offer(is_left && is_up && is_open(up - 1), up - 1, -1, 1, SQRT_2);
    offer(is_left && is_down && is_open(down - 1), down - 1, -1, -1, SQRT_2);
    offer(is_right && is_down && is_open(down + 1), down + 1, 1, -1, SQRT_2);
}

/// Returns the octile distance: shortest path without obstacles, cells.
/// Steps lead to eight neighbors.
#[inline(always)]
pub(crate) fn octile(columns: i32, rows: i32) -> f64 {
    let (columns, rows) = (columns.unsigned_abs(), rows.unsigned_abs());
    f64::from(columns.max(rows)) + (SQRT_2 - 1.0) * f64::from(columns.min(rows))
}
