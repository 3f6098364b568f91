//! A* search on grids.

use std::f64::consts::SQRT_2;

use crate::bucket_queue::BucketQueue;
use crate::cost_grid::{CostGrid, GridCell};
use crate::grid_path::GridPath;
use crate::neighbors::{for_each_step, octile};

/// A* search on an 8-connected grid that cuts no corner.
/// Hart, Nilsson and Raphael, 1968, *A formal basis for the heuristic determination of minimum cost paths*.
///
/// The cost is exact: no other path costs less, but for the rounding of its sum.
#[derive(Clone, Debug, Default)]
pub struct AStar {
    nodes: Vec<SearchNode>,
    /// Number of searches, so that nodes of earlier ones need not be wiped.
    searches: u32,
    open: BucketQueue,
    path: GridPath,
}

#[derive(Clone, Copy, Debug, Default)]
struct SearchNode {
    /// Cost from the start.
    cost: f64,
    predecessor: u32,
    search: u32,
}

impl AStar {
    /// Returns a cheapest path.
    /// `None` if no path exists, or the start or the goal is impassable.
    pub fn search(&mut self, grid: &CostGrid, start: GridCell, goal: GridCell) -> Option<&GridPath> {
        if !grid.is_passable(start) || !grid.is_passable(goal) {
            return None;
        }
        self.begin(grid);
        let from = grid.index(start);
        let to = grid.index(goal);
        let away =
            |cell: GridCell| (cell.column as i32 - goal.column as i32, cell.row as i32 - goal.row as i32);
        let (columns, rows) = away(start);
        // The heuristic is consistent: the priority of a neighbor is at most that of a step there and back higher.
        let span = SQRT_2 * (grid.largest_factor() + 1.0);
        self.open.clear(grid.cells(), octile(columns, rows), span);
        self.nodes[from as usize] = SearchNode { cost: 0.0, predecessor: from, search: self.searches };
        self.open.insert(from, octile(columns, rows));
        let mut best = if from == to { 0.0 } else { f64::INFINITY };
        while let Some(here) = self.open.pop() {
            // Within a bucket cells are not in order, so a cell may be taken again after its cost has fallen, and the
            // goal's cost is final when all that is left is dearer.
            if self.open.is_past(best) {
                break;
            }
            let cost = self.nodes[here as usize].cost;
            let (columns, rows) = away(grid.cell(here));
            for_each_step(grid, here, |step| {
                let node = &mut self.nodes[step.to as usize];
                let cost = cost + step.length * grid.factor(step.to);
                if node.search == self.searches && node.cost <= cost {
                    return;
                }
                let total = cost + octile(columns + step.columns, rows + step.rows);
                if total >= best {
                    return;
                }
                *node = SearchNode { cost, predecessor: here, search: self.searches };
                if step.to == to {
                    best = cost;
                } else {
                    self.open.insert(step.to, total);
                }
            });
        }
        if best == f64::INFINITY {
            return None;
        }
        let nodes = &self.nodes;
        self.path.trace(grid, to, best, |cell| nodes[cell as usize].predecessor);
        Some(&self.path)
    }

    fn begin(&mut self, grid: &CostGrid) {
        if self.nodes.len() != grid.cells() || self.searches == u32::MAX {
            self.nodes.clear();
            self.nodes.resize(grid.cells(), SearchNode::default());
            self.searches = 0;
        }
        self.searches += 1;
    }
}
