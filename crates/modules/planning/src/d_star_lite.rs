//! D* Lite.

use std::f64::consts::SQRT_2;

use crate::cost_grid::{CostGrid, GridCell};
use crate::grid_path::GridPath;
use crate::indexed_heap::{HeapKey, IndexedHeap};
use crate::neighbors::{for_each_step, octile};

/// Incremental planner D* Lite: repairs a cheapest path as cells change.
/// The path stays up to date while the robot moves (Koenig and Likhachev, 2002, *D\* Lite*, figure 4, the optimized
/// version).
///
/// Each plan is as cheap as one that [`AStar`](crate::AStar) finds anew, but only what a change concerns is searched
/// again.
///
/// ```
/// use slate_planning::{GridCell, CostGrid, DStarLite, LETHAL};
///
/// let free = CostGrid::new(5, 5, |_| 0).unwrap();
/// let mut planner = DStarLite::new(free, GridCell::new(0, 2), GridCell::new(4, 2));
/// assert_eq!(planner.plan().unwrap().cost(), 4.0);
/// planner.set_cost(GridCell::new(2, 2), LETHAL);
/// assert!(planner.plan().unwrap().cost() > 4.0);
/// ```
#[derive(Clone, Debug)]
pub struct DStarLite {
    grid: CostGrid,
    nodes: Vec<RepairNode>,
    open: IndexedHeap,
    start: u32,
    goal: u32,
    /// Robot's cell at the last computation of keys.
    /// `key_modifier` is its travel since the first one.
    last_start: u32,
    key_modifier: f64,
    /// Cells whose steps have changed since the last plan.
    changed: Vec<u32>,
    /// Newest path from the robot to the goal; empty if no path exists.
    path_cells: Vec<u32>,
    path: GridPath,
}

/// Cost to the goal, and that by the best neighbor (one-step lookahead).
#[derive(Clone, Copy, Debug)]
struct RepairNode {
    cost: f64,
    lookahead: f64,
}

/// Bound on rounding differences of sums of the same steps, cells.
const ROUNDING: f64 = 1e-9;

impl DStarLite {
    /// Returns a planner from a cell to a goal.
    /// Cells outside of the grid are impassable.
    pub fn new(grid: CostGrid, start: GridCell, goal: GridCell) -> Self {
        let inside =
            |cell: GridCell| GridCell::new(cell.column.min(grid.width()), cell.row.min(grid.height()));
        let (start, goal) = (grid.index(inside(start)), grid.index(inside(goal)));
        let nothing = RepairNode { cost: f64::INFINITY, lookahead: f64::INFINITY };
        let mut planner = Self {
            nodes: vec![nothing; grid.cells()],
            open: IndexedHeap::default(),
            start,
            goal,
            last_start: start,
            key_modifier: 0.0,
            changed: Vec::new(),
            path_cells: Vec::new(),
            path: GridPath::default(),
            grid,
        };
        planner.open.clear(planner.grid.cells());
        planner.nodes[goal as usize].lookahead = 0.0;
        let key = planner.key(goal);
        planner.open.set(goal, key);
        planner
    }

    /// Returns the grid that the robot knows.
    pub fn grid(&self) -> &CostGrid {
        &self.grid
    }

    /// Sets the robot's cell; returns false for a cell outside of the grid.
    /// Such a cell is ignored. From an impassable cell no path exists.
    pub fn move_to(&mut self, start: GridCell) -> bool {
        let is_inside = start.column < self.grid.width() && start.row < self.grid.height();
        if is_inside {
            self.start = self.grid.index(start);
        }
        is_inside
    }

    /// Sets the observed cost of a cell.
    pub fn set_cost(&mut self, cell: GridCell, cost: u8) {
        if cell.column >= self.grid.width() || cell.row >= self.grid.height() || self.grid.cost(cell) == cost
        {
            return;
        }
        self.grid.set(cell, cost);
        // Steps from the neighbors lead there, and diagonal ones between them past it.
        let here = self.grid.index(cell);
        let stride = self.grid.stride();
        for middle in [here - stride, here, here + stride] {
            self.changed.extend([middle - 1, middle, middle + 1]);
        }
        if self.changed.len() > 2 * self.grid.cells() {
            self.changed.sort_unstable();
            self.changed.dedup();
        }
    }

    /// Recomputes the lookahead of cells around those changed since the last plan.
    fn take_changes(&mut self) {
        if self.changed.is_empty() {
            return;
        }
        self.key_modifier += self.distance(self.last_start, self.start);
        self.last_start = self.start;
        let mut changed = std::mem::take(&mut self.changed);
        changed.sort_unstable();
        changed.dedup();
        for cell in changed.drain(..) {
            // No step leads to the border.
            let node = self.nodes[cell as usize];
            if self.grid.is_open(cell) || node.cost < f64::INFINITY || node.lookahead < f64::INFINITY {
                self.look_ahead(cell);
            }
        }
        self.changed = changed;
    }

    /// Returns a cheapest path from the robot to the goal in the known grid.
    /// `None` if no path exists.
    pub fn plan(&mut self) -> Option<&GridPath> {
        self.take_changes();
        self.expand();
        // An expansion may invalidate the path followed so far.
        while let Some(ill) = self.follow() {
            self.settle(ill);
            self.expand();
        }
        if self.path_cells.last() != Some(&self.goal) {
            return None;
        }
        let cost = self.nodes[self.start as usize].lookahead;
        let Self { grid, path_cells, path, .. } = self;
        path.set(path_cells.iter().map(|cell| grid.cell(*cell)), cost);
        Some(&self.path)
    }

    /// Expands cells that may change the path's cost (`ComputeShortestPath`).
    ///
    /// Cells of the same key as the robot's are left: of the many paths that cost the same, only the one that is taken
    /// matters, and [`follow`](Self::follow) finds what is wrong there.
    fn expand(&mut self) {
        while let Some((old_key, here)) = self.open.first() {
            let limit = self.nodes[self.start as usize].lookahead + self.key_modifier;
            if old_key.0 >= limit - ROUNDING {
                break;
            }
            let key = self.key(here);
            if old_key < key {
                self.open.set(here, key);
            } else {
                self.settle(here);
            }
        }
    }

    /// Sets the cell's cost to its lookahead, if that is lower.
    /// Otherwise its cost becomes infinite, and the cells that rely on it are updated.
    fn settle(&mut self, here: u32) {
        let node = self.nodes[here as usize];
        if node.cost > node.lookahead {
            self.nodes[here as usize].cost = node.lookahead;
            self.open.remove(here);
            self.lower(here);
        } else {
            self.nodes[here as usize].cost = f64::INFINITY;
            self.look_ahead(here);
            self.raise(here, node.cost);
        }
    }

    /// Follows the cheapest steps to the goal.
    /// It reuses the path of the last plan as far as it is valid. Returns a cell whose cost is inconsistent with its
    /// neighbors, as no path continues from there.
    fn follow(&mut self) -> Option<u32> {
        if self.nodes[self.start as usize].lookahead == f64::INFINITY || !self.grid.is_open(self.start) {
            self.path_cells.clear();
            return None;
        }
        if let Some(at) = self.path_cells.iter().position(|cell| *cell == self.start) {
            self.path_cells.drain(..at);
        } else {
            self.path_cells.clear();
            self.path_cells.push(self.start);
        }
        let mut at = 0;
        loop {
            let here = self.path_cells[at];
            let node = self.nodes[here as usize];
            if at > 0 && node.cost != node.lookahead {
                return Some(here);
            }
            if here == self.goal {
                self.path_cells.truncate(at + 1);
                return None;
            }
            at += 1;
            let is_known =
                self.path_cells.get(at).is_some_and(|next| self.through(here, *next) == Some(node.lookahead));
            if !is_known {
                self.path_cells.truncate(at);
                let mut best = (f64::INFINITY, here);
                for_each_step(&self.grid, here, |step| {
                    let cost = step.length * self.grid.factor(step.to) + self.nodes[step.to as usize].cost;
                    if cost < best.0 {
                        best = (cost, step.to);
                    }
                });
                if best.0 == f64::INFINITY {
                    self.path_cells.clear();
                    return None;
                }
                self.path_cells.push(best.1);
            }
        }
    }

    /// Returns the cost to the goal by that neighbor, if there is a step to it.
    fn through(&self, here: u32, next: u32) -> Option<f64> {
        let stride = self.grid.stride();
        let columns = (next % stride) as i32 - (here % stride) as i32;
        let beside = here.wrapping_add_signed(columns);
        let is_free = self.grid.is_open(next)
            && (beside == here
                || beside == next
                || (self.grid.is_open(beside) && self.grid.is_open(here + next - beside)));
        let length = if beside == here || beside == next { 1.0 } else { SQRT_2 };
        is_free.then(|| length * self.grid.factor(next) + self.nodes[next as usize].cost)
    }

    /// Offers the cell's new cost to those that lead there.
    fn lower(&mut self, here: u32) {
        if !self.grid.is_open(here) {
            return;
        }
        let (cost, factor) = (self.nodes[here as usize].cost, self.grid.factor(here));
        for (cell, length) in self.leading_to(here) {
            let through = length * factor + cost;
            if cell != self.goal && through < self.nodes[cell as usize].lookahead {
                self.nodes[cell as usize].lookahead = through;
                self.update(cell);
            }
        }
    }

    /// Recomputes cells whose cheapest step led to a cell of a cost now outdated.
    /// No step leads to an impassable cell.
    fn raise(&mut self, here: u32, cost: f64) {
        if !self.grid.is_open(here) {
            return;
        }
        let factor = self.grid.factor(here);
        for (cell, length) in self.leading_to(here) {
            if self.nodes[cell as usize].lookahead == length * factor + cost {
                self.look_ahead(cell);
            }
        }
    }

    /// Cells with a step to that one, and its length.
    fn leading_to(&self, here: u32) -> impl Iterator<Item = (u32, f64)> + use<> {
        // Steps lead both ways.
        let mut steps = [(here, 0.0); 8];
        let mut count = 0;
        for_each_step(&self.grid, here, |step| {
            steps[count] = (step.to, step.length);
            count += 1;
        });
        steps.into_iter().take(count)
    }

    /// Recomputes the cell's one-step lookahead.
    fn look_ahead(&mut self, cell: u32) {
        if cell != self.goal {
            let mut lookahead = f64::INFINITY;
            if self.grid.is_open(cell) {
                for_each_step(&self.grid, cell, |step| {
                    let through = step.length * self.grid.factor(step.to) + self.nodes[step.to as usize].cost;
                    if through < lookahead {
                        lookahead = through;
                    }
                });
            }
            self.nodes[cell as usize].lookahead = lookahead;
        }
        self.update(cell);
    }

    /// Queues the cell if it is inconsistent with its neighbors.
    fn update(&mut self, cell: u32) {
        let node = self.nodes[cell as usize];
        if node.cost == node.lookahead {
            self.open.remove(cell);
        } else {
            let key = self.key(cell);
            self.open.set(cell, key);
        }
    }

    fn key(&self, cell: u32) -> HeapKey {
        let node = self.nodes[cell as usize];
        let least = slate_module::math::min(node.cost, node.lookahead);
        (least + self.distance(self.start, cell) + self.key_modifier, least)
    }

    fn distance(&self, a: u32, b: u32) -> f64 {
        let stride = self.grid.stride();
        let place = |cell: u32| ((cell % stride) as i32, (cell / stride) as i32);
        let ((ax, ay), (bx, by)) = (place(a), place(b));
        octile(ax - bx, ay - by)
    }
}
