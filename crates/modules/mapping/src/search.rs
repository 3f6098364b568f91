//! The cheapest way from cell to cell.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::geometry::Geometry;

/// No way goes there.
pub(crate) const BLOCKED: u16 = u16::MAX;

/// What a step to a neighbour costs, of a cell that costs 1: along an edge, and over a corner.
const STRAIGHT: u32 = 10;
const DIAGONAL: u32 = 14;

const NOBODY: u32 = u32::MAX;

/// Memory of a search, so that the next one of that size allocates nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Search {
    /// The least that it takes to a cell, and the cell before it.
    least: Vec<u32>,
    before: Vec<u32>,
    /// What it takes at least to the goal over a cell, the cell, what it takes to that.
    open: BinaryHeap<Reverse<(u32, u32, u32)>>,
    way: Vec<u32>,
}

impl Search {
    /// The cheapest way by what each cell costs (A*), from the first cell to the last; empty when there is none.
    pub fn way(&mut self, geometry: &Geometry, costs: &[u16], from: usize, to: usize) -> &[u32] {
        self.least.clear();
        self.least.resize(geometry.cells(), u32::MAX);
        self.before.clear();
        self.before.resize(geometry.cells(), NOBODY);
        self.open.clear();
        self.way.clear();
        if costs[to] == BLOCKED {
            return &self.way;
        }
        let place = |cell: usize| (cell % geometry.width, cell / geometry.width);
        let (goal_column, goal_row) = place(to);
        let at_least = |column: usize, row: usize| {
            let (across, up) = (column.abs_diff(goal_column) as u32, row.abs_diff(goal_row) as u32);
            STRAIGHT * across.abs_diff(up) + DIAGONAL * across.min(up)
        };
        self.least[from] = 0;
        self.open.push(Reverse((0, from as u32, 0)));
        while let Some(Reverse((_, cell, taken))) = self.open.pop() {
            let here = cell as usize;
            if here == to {
                self.trace(to);
                break;
            }
            if taken > self.least[here] {
                continue;
            }
            let (column, row) = place(here);
            let neighbours = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];
            for (across, up) in neighbours {
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
                if cost < self.least[next] {
                    self.least[next] = cost;
                    self.before[next] = cell;
                    self.open.push(Reverse((cost.saturating_add(at_least(column, row)), next as u32, cost)));
                }
            }
        }
        &self.way
    }

    fn trace(&mut self, to: usize) {
        let mut cell = to as u32;
        while cell != NOBODY {
            self.way.push(cell);
            cell = self.before[cell as usize];
        }
        self.way.reverse();
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    const SIDE: usize = 12;

    fn total(geometry: &Geometry, costs: &[u16], way: &[u32]) -> u32 {
        let step = |pair: &[u32]| {
            let (a, b) = (pair[0] as usize, pair[1] as usize);
            let apart = (
                (a % geometry.width).abs_diff(b % geometry.width),
                (a / geometry.width).abs_diff(b / geometry.width),
            );
            assert!(apart.0 <= 1 && apart.1 <= 1 && apart != (0, 0), "{way:?}");
            (if apart == (1, 1) { DIAGONAL } else { STRAIGHT }) * u32::from(costs[b])
        };
        way.windows(2).map(step).sum()
    }

    /// What the cheapest way takes, by going over all cells until nothing gets cheaper.
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
        fn the_way_is_the_cheapest_there_is(
            costs in prop::collection::vec(prop_oneof![3 => 1..6_u16, 1 => Just(BLOCKED)], SIDE * SIDE),
            from in 0..SIDE * SIDE, to in 0..SIDE * SIDE,
        ) {
            let geometry = Geometry::new([0.0, 0.0], [SIDE as f64; 2], 1.0).unwrap();
            let mut search = Search::default();
            let way = search.way(&geometry, &costs, from, to).to_vec();
            let least = if costs[to] == BLOCKED { None } else { least(&geometry, &costs, from, to) };
            prop_assert_eq!(way.is_empty(), least.is_none());
            if let Some(least) = least {
                prop_assert_eq!((way[0] as usize, *way.last().unwrap() as usize), (from, to));
                prop_assert_eq!(total(&geometry, &costs, &way), least);
            }
        }
    }
}
