//! A* on a grid.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use slate_grid::Geometry;

/// Cost of an impassable cell.
pub(crate) const BLOCKED: u16 = u16::MAX;

/// Cost of a step to a cell of cost 1: along an edge, and diagonally.
const STRAIGHT: u32 = 10;
const DIAGONAL: u32 = 14;

const NONE: u32 = u32::MAX;

/// Buffers of a search, reused so that it allocates only once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Search {
    /// Cost to come of each cell, and its predecessor.
    cost: Vec<u32>,
    predecessor: Vec<u32>,
    /// Open list: estimated total cost, cell, cost to come.
    open: BinaryHeap<Reverse<(u32, u32, u32)>>,
    path: Vec<u32>,
}

impl Search {
    /// Returns the cheapest path, with both ends; empty if no path exists.
    /// A* (Hart, Nilsson and Raphael, 1968).
    ///
    /// Own code: `pathfinding` allocates its maps for each search, and a tick must not.
    pub fn path(&mut self, geometry: &Geometry, costs: &[u16], from: usize, to: usize) -> &[u32] {
        self.cost.clear();
        self.cost.resize(geometry.cells(), u32::MAX);
        self.predecessor.clear();
        self.predecessor.resize(geometry.cells(), NONE);
        // The heuristic is consistent, so each cell is expanded once, to eight neighbors.
        self.open.clear();
        self.open.reserve(8 * geometry.cells());
        self.path.clear();
        self.path.reserve(geometry.cells());
        if costs[to] == BLOCKED {
            return &self.path;
        }
        let place = |cell: usize| (cell % geometry.width, cell / geometry.width);
        let (goal_column, goal_row) = place(to);
        let heuristic = |column: usize, row: usize| {
            let (across, up) = (column.abs_diff(goal_column) as u32, row.abs_diff(goal_row) as u32);
            STRAIGHT * across.abs_diff(up) + DIAGONAL * across.min(up)
        };
        self.cost[from] = 0;
        self.open.push(Reverse((0, from as u32, 0)));
        while let Some(Reverse((_, cell, taken))) = self.open.pop() {
            let here = cell as usize;
            if here == to {
                self.trace(to);
                break;
            }
            if taken > self.cost[here] {
                continue;
            }
            let (column, row) = place(here);
            let neighbors = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];
            for (across, up) in neighbors {
                let (Some(column), Some(row)) =
                    (column.checked_add_signed(across), row.checked_add_signed(up))
                else {
                    continue;
                };
                if column >= geometry.width || row >= geometry.height {
                    continue;
                }
                let next = geometry.index(column, row);
                if costs[next] == BLOCKED {
                    continue;
                }
                let step = if across != 0 && up != 0 { DIAGONAL } else { STRAIGHT };
                let cost = taken.saturating_add(step.saturating_mul(u32::from(costs[next].max(1))));
                if cost < self.cost[next] {
                    self.cost[next] = cost;
                    self.predecessor[next] = cell;
                    self.open.push(Reverse((cost.saturating_add(heuristic(column, row)), next as u32, cost)));
                }
            }
        }
        &self.path
    }

    fn trace(&mut self, to: usize) {
        let mut cell = to as u32;
        while cell != NONE {
            self.path.push(cell);
            cell = self.predecessor[cell as usize];
        }
        self.path.reverse();
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    const SIDE: usize = 12;

    fn total(geometry: &Geometry, costs: &[u16], path: &[u32]) -> u32 {
        let step = |pair: &[u32]| {
            let (a, b) = (pair[0] as usize, pair[1] as usize);
            let apart = (
                (a % geometry.width).abs_diff(b % geometry.width),
                (a / geometry.width).abs_diff(b / geometry.width),
            );
            assert!(apart.0 <= 1 && apart.1 <= 1 && apart != (0, 0), "{path:?}");
            (if apart == (1, 1) { DIAGONAL } else { STRAIGHT }) * u32::from(costs[b])
        };
        path.windows(2).map(step).sum()
    }

    /// Returns the cost of the cheapest path (Bellman-Ford).
    /// It relaxes until no cost changes.
    fn least(geometry: &Geometry, costs: &[u16], from: usize, to: usize) -> Option<u32> {
        let mut taken = vec![None; geometry.cells()];
        taken[from] = Some(0_u32);
        loop {
            let before = taken.clone();
            for a in 0..geometry.cells() {
                for b in 0..geometry.cells() {
                    let (across, up) = ((a % SIDE).abs_diff(b % SIDE), (a / SIDE).abs_diff(b / SIDE));
                    let (true, Some(there)) = (across <= 1 && up <= 1 && a != b, taken[a]) else { continue };
                    if costs[b] != BLOCKED {
                        let step = if across + up == 2 { DIAGONAL } else { STRAIGHT };
                        let cost = there + step * u32::from(costs[b]);
                        taken[b] = Some(taken[b].map_or(cost, |known: u32| known.min(cost)));
                    }
                }
            }
            if taken == before {
                return taken[to];
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_path_is_the_cheapest(
            costs in prop::collection::vec(prop_oneof![3 => 1..6_u16, 1 => Just(BLOCKED)], SIDE * SIDE),
            from in 0..SIDE * SIDE, to in 0..SIDE * SIDE,
        ) {
            let geometry = Geometry::new([0.0, 0.0], [SIDE as f64; 2], 1.0, SIDE * SIDE).unwrap();
            let mut search = Search::default();
            let path = search.path(&geometry, &costs, from, to).to_vec();
            let least = if costs[to] == BLOCKED { None } else { least(&geometry, &costs, from, to) };
            prop_assert_eq!(path.is_empty(), least.is_none());
            if let Some(least) = least {
                prop_assert_eq!((path[0] as usize, *path.last().unwrap() as usize), (from, to));
                prop_assert_eq!(total(&geometry, &costs, &path), least);
            }
        }
    }
}
