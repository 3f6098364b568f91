//! Costs from one cell to all others.

use std::f64::consts::SQRT_2;

use crate::bucket_queue::BucketQueue;
use crate::cost_grid::{CostGrid, GridCell};
use crate::grid_path::GridPath;
use crate::neighbors::for_each_step;

/// Costs of the cheapest paths from one cell to every other (Dijkstra).
/// Steps to eight neighbors cut no corner (Dijkstra, 1959, *A note on two problems in connexion with graphs*).
#[derive(Clone, Debug, Default)]
pub struct CostField {
    nodes: Vec<FieldNode>,
    open: BucketQueue,
    path: GridPath,
}

#[derive(Clone, Copy, Debug)]
struct FieldNode {
    /// Cost from the start.
    cost: f64,
    predecessor: u32,
}

impl CostField {
    /// Computes the costs from a cell; from an impassable one no cell is reached.
    pub fn compute(&mut self, grid: &CostGrid, start: GridCell) {
        self.nodes.clear();
        self.nodes.resize(grid.cells(), FieldNode { cost: f64::INFINITY, predecessor: u32::MAX });
        if !grid.is_passable(start) {
            return;
        }
        let from = grid.index(start);
        self.nodes[from as usize] = FieldNode { cost: 0.0, predecessor: from };
        self.open.clear(grid.cells(), 0.0, SQRT_2 * grid.largest_factor());
        self.open.insert(from, 0.0);
        // Within a bucket cells are not in order, so one may be taken again after its cost has fallen.
        while let Some(here) = self.open.pop() {
            let cost = self.nodes[here as usize].cost;
            for_each_step(grid, here, |step| {
                let node = &mut self.nodes[step.to as usize];
                let cost = cost + step.length * grid.factor(step.to);
                if cost < node.cost {
                    *node = FieldNode { cost, predecessor: here };
                    self.open.insert(step.to, cost);
                }
            });
        }
    }

    /// Returns the cost to a cell of the grid of the last computation.
    /// Infinite for a cell that can't be reached.
    pub fn cost(&self, grid: &CostGrid, cell: GridCell) -> f64 {
        let is_passable = grid.is_passable(cell);
        let node = is_passable.then(|| self.nodes.get(grid.index(cell) as usize)).flatten();
        node.map_or(f64::INFINITY, |node| node.cost)
    }

    /// Returns the path to a cell of that grid; `None` if it is not reached.
    pub fn path(&mut self, grid: &CostGrid, cell: GridCell) -> Option<&GridPath> {
        let cost = self.cost(grid, cell);
        if cost == f64::INFINITY {
            return None;
        }
        let nodes = &self.nodes;
        self.path.trace(grid, grid.index(cell), cost, |cell| nodes[cell as usize].predecessor);
        Some(&self.path)
    }
}
