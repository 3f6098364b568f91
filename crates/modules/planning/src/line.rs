//! Straight lines between cells.

use crate::cost_grid::{CostGrid, GridCell};

/// Returns the cost of the straight line between the middles of two cells.
/// It is its length in cells, each part of it times the factor of the cell it crosses; `None` if it crosses an
/// impassable one or goes through a corner of one.
///
/// Cells are found in exact arithmetic (after Amanatides and Woo, 1987, *A fast voxel traversal algorithm for ray
/// tracing*).
pub fn line_cost(grid: &CostGrid, from: GridCell, to: GridCell) -> Option<f64> {
    if !grid.is_passable(from) || !grid.is_passable(to) {
        return None;
    }
    let columns = i64::from(to.column) - i64::from(from.column);
    let rows = i64::from(to.row) - i64::from(from.row);
    let (across, up) = (columns.abs(), rows.abs());
    let right = columns.signum() as i32;
    let above = rows.signum() as i32 * grid.stride() as i32;
    let step = |cell: u32, by: i32| cell.wrapping_add_signed(by);
    let length = (((across * across) + (up * up)) as f64).sqrt();
    // Borders between columns are crossed at (2 k + 1) / (2 across) of the line, those between rows likewise; times 2
    // across up they are whole numbers.
    let (mut next_column, mut next_row) = (up, across);
    let whole = 2 * across * up;
    let end = match (across, up) {
        (0, 0) => return Some(0.0),
        (0, rows) | (rows, 0) => {
            return straight(grid, grid.index(from), if across == 0 { above } else { right }, rows);
        }
        _ => whole,
    };
    let mut cell = grid.index(from);
    let (mut sum, mut last) = (0.0, 0);
    loop {
        let next = next_column.min(next_row).min(end);
        sum += (next - last) as f64 * grid.factor(cell);
        last = next;
        if next == end {
            break;
        }
        if next_column == next_row {
            if !grid.is_open(step(cell, right)) || !grid.is_open(step(cell, above)) {
                return None;
            }
            cell = step(step(cell, right), above);
            next_column += 2 * up;
            next_row += 2 * across;
        } else if next_column < next_row {
            cell = step(cell, right);
            next_column += 2 * up;
        } else {
            cell = step(cell, above);
            next_row += 2 * across;
        }
        if !grid.is_open(cell) {
            return None;
        }
    }
    Some(sum * length / whole as f64)
}

/// Returns the line along a row or a column.
fn straight(grid: &CostGrid, from: u32, by: i32, steps: i64) -> Option<f64> {
    let mut cell = from;
    let mut sum = 0.5 * grid.factor(cell);
    for step in 1..=steps {
        cell = cell.wrapping_add_signed(by);
        let factor = grid.factor(cell);
        if factor == f64::INFINITY {
            return None;
        }
        sum += if step == steps { 0.5 * factor } else { factor };
    }
    Some(sum)
}
