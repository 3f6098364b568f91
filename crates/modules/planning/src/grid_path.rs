//! Path of a search.

use crate::cost_grid::{CostGrid, GridCell};

/// Path on a grid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridPath {
    cells: Vec<GridCell>,
    cost: f64,
}

impl GridPath {
    /// Returns the cells from start to goal.
    /// They are neighbors, or ends of straight lines in paths of any angle.
    pub fn cells(&self) -> &[GridCell] {
        &self.cells
    }

    /// Returns the sum of the steps' costs; where all cells cost 0 the length, cells.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// Follows predecessors back from the goal; the start is its own.
    pub(crate) fn trace(&mut self, grid: &CostGrid, goal: u32, cost: f64, predecessor: impl Fn(u32) -> u32) {
        self.cells.clear();
        self.cost = cost;
        let mut here = goal;
        loop {
            self.cells.push(grid.cell(here));
            let before = predecessor(here);
            if before == here {
                break;
            }
            here = before;
        }
        self.cells.reverse();
    }

    /// Sets the cells and the cost of the path.
    pub(crate) fn set(&mut self, cells: impl Iterator<Item = GridCell>, cost: f64) {
        self.cells.clear();
        self.cells.extend(cells);
        self.cost = cost;
    }

    pub(crate) fn cells_mut(&mut self) -> &mut Vec<GridCell> {
        &mut self.cells
    }

    pub(crate) fn set_cost(&mut self, cost: f64) {
        self.cost = cost;
    }
}
