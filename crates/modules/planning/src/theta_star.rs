//! Theta*.

use std::f64::consts::SQRT_2;

use crate::bucket_queue::BucketQueue;
use crate::cost_grid::{CostGrid, GridCell};
use crate::grid_path::GridPath;
use crate::line::line_cost;
use crate::neighbors::for_each_step;

/// Lazy Theta*: finds a short path of straight lines of any angle.
/// Nash, Koenig and Tovey, 2010, *Lazy Theta\*: Any-angle path planning and path length analysis in 3D*, for cells of
/// any cost; the path is then smoothed.
///
/// The path is not always the shortest one; on published maps it is less than 1 % longer. No line of it touches an
/// impassable cell.
#[derive(Clone, Debug, Default)]
pub struct ThetaStar {
    nodes: Vec<LazyNode>,
    searches: u32,
    open: BucketQueue,
    path: GridPath,
    /// Path that is being smoothed.
    smoothed: Vec<GridCell>,
}

#[derive(Clone, Copy, Debug, Default)]
struct LazyNode {
    /// Cost from the start.
    /// Until the node is closed, it assumes that the line from its parent is free.
    cost: f64,
    parent: u32,
    search: u32,
    state: LineState,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum LineState {
    /// Assumed cost: the line from its parent is not checked.
    #[default]
    Supposed,
    /// Known cost.
    Known,
    Closed,
}

impl ThetaStar {
    /// Returns a short path.
    /// `None` if no path exists, or the start or the goal is impassable.
    pub fn search(&mut self, grid: &CostGrid, start: GridCell, goal: GridCell) -> Option<&GridPath> {
        if !grid.is_passable(start) || !grid.is_passable(goal) {
            return None;
        }
        self.begin(grid);
        let (from, to) = (grid.index(start), grid.index(goal));
        self.open.clear(grid.cells(), start.distance(goal), 4.0 * SQRT_2 * (grid.largest_factor() + 1.0));
        self.nodes[from as usize] =
            LazyNode { cost: 0.0, parent: from, search: self.searches, state: LineState::Known };
        self.open.insert(from, start.distance(goal));
        while let Some(here) = self.open.pop() {
            let cell = grid.cell(here);
            if self.nodes[here as usize].state == LineState::Supposed && self.settle(grid, here) {
                let cost = self.nodes[here as usize].cost;
                self.open.insert(here, cost + cell.distance(goal));
                continue;
            }
            self.nodes[here as usize].state = LineState::Closed;
            if here == to {
                return Some(self.finish(grid, to));
            }
            self.relax_neighbors(grid, here, goal);
        }
        None
    }

    fn begin(&mut self, grid: &CostGrid) {
        if self.nodes.len() != grid.cells() || self.searches == u32::MAX {
            self.nodes.clear();
            self.nodes.resize(grid.cells(), LazyNode::default());
            self.searches = 0;
        }
        self.searches += 1;
    }

    /// Checks the line from the node's parent; else takes the best closed neighbor.
    /// The neighbor becomes the parent. Returns true if the node's cost has risen, so that others may come first.
    fn settle(&mut self, grid: &CostGrid, here: u32) -> bool {
        let node = self.nodes[here as usize];
        let parent = self.nodes[node.parent as usize];
        let mut best = LazyNode { cost: f64::INFINITY, state: LineState::Known, ..node };
        if let Some(line) = line_cost(grid, grid.cell(node.parent), grid.cell(here)) {
            best.cost = parent.cost + line;
        }
        let factor = grid.factor(here);
        for_each_step(grid, here, |step| {
            let other = &self.nodes[step.to as usize];
            if other.search == self.searches && other.state == LineState::Closed {
                let cost = other.cost + step.length * 0.5 * (factor + grid.factor(step.to));
                if cost < best.cost {
                    (best.cost, best.parent) = (cost, step.to);
                }
            }
        });
        self.nodes[here as usize] = best;
        best.cost > node.cost + 1e-9
    }

    /// Offers each neighbor the parent of a closed node, as if the line were free.
    fn relax_neighbors(&mut self, grid: &CostGrid, here: u32, goal: GridCell) {
        let parent = self.nodes[here as usize].parent;
        let cost = self.nodes[parent as usize].cost;
        let origin = grid.cell(parent);
        for_each_step(grid, here, |step| {
            let cell = grid.cell(step.to);
            let cost = cost + origin.distance(cell);
            let node = &mut self.nodes[step.to as usize];
            if node.search != self.searches || (node.state != LineState::Closed && cost < node.cost - 1e-9) {
                *node = LazyNode { cost, parent, search: self.searches, state: LineState::Supposed };
                self.open.insert(step.to, cost + cell.distance(goal));
            }
        });
    }

    fn finish(&mut self, grid: &CostGrid, to: u32) -> &GridPath {
        let nodes = &self.nodes;
        self.path.trace(grid, to, nodes[to as usize].cost, |cell| nodes[cell as usize].parent);
        smooth(grid, &mut self.path, &mut self.smoothed);
        // The search looks at lines from a few cells only.
        let (start, goal) = (self.path.cells()[0], grid.cell(to));
        if let Some(direct) = line_cost(grid, start, goal).filter(|direct| *direct < self.path.cost()) {
            self.path.set([start, goal].into_iter(), direct);
        }
        &self.path
    }
}

/// Leaves out corners, or moves them by a cell, while the cost falls.
fn smooth(grid: &CostGrid, path: &mut GridPath, smoothed: &mut Vec<GridCell>) {
    let cells = path.cells_mut();
    loop {
        let mut is_better = false;
        smoothed.clear();
        smoothed.push(cells[0]);
        for at in 1..cells.len() {
            let cell = cells[at];
            let Some(next) = cells.get(at + 1) else {
                smoothed.push(cell);
                break;
            };
            // The last one is there: the start.
            let before = smoothed[smoothed.len() - 1];
            match better_corner(grid, before, cell, *next) {
                CornerChange::Kept => smoothed.push(cell),
                CornerChange::Moved(other) => {
                    smoothed.push(other);
                    is_better = true;
                }
                CornerChange::LeftOut => is_better = true,
            }
        }
        std::mem::swap(cells, smoothed);
        if !is_better {
            break;
        }
    }
    let cost = cells.windows(2).filter_map(|pair| line_cost(grid, pair[0], pair[1])).sum();
    path.set_cost(cost);
}

enum CornerChange {
    Kept,
    Moved(GridCell),
    LeftOut,
}

fn better_corner(grid: &CostGrid, before: GridCell, corner: GridCell, next: GridCell) -> CornerChange {
    let through = |cell| Some(line_cost(grid, before, cell)? + line_cost(grid, cell, next)?);
    let Some(mut least) = through(corner) else { return CornerChange::Kept };
    if line_cost(grid, before, next).is_some_and(|direct| direct <= least + 1e-9) {
        return CornerChange::LeftOut;
    }
    let mut best = CornerChange::Kept;
    for_each_step(grid, grid.index(corner), |step| {
        let cell = grid.cell(step.to);
        if let Some(cost) = through(cell).filter(|cost| *cost < least - 1e-9) {
            least = cost;
            best = CornerChange::Moved(cell);
        }
    });
    best
}
