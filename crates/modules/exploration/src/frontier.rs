//! Frontiers between free and unknown space.

use slate_grid::{OccupancyMap, UNKNOWN_CELL};
use slate_planning::GridCell;
use slate_sorted::SortedSet;

/// Occupancy up to which a cell is free, percent.
pub(crate) const FREE: i8 = 25;

/// Connected free cells beside unknown ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frontier {
    /// Cells, of which each touches another one at a side or corner.
    pub cells: Vec<GridCell>,
}

impl Frontier {
    /// Returns the cell of the frontier that is nearest to the mean of all.
    pub fn middle(&self) -> Option<GridCell> {
        let count = self.cells.len() as f64;
        let mean =
            |of: fn(&GridCell) -> u32| self.cells.iter().map(|cell| f64::from(of(cell))).sum::<f64>() / count;
        let (column, row) = (mean(|cell| cell.column), mean(|cell| cell.row));
        let square = |cell: &GridCell| {
            let (columns, rows) = (f64::from(cell.column) - column, f64::from(cell.row) - row);
            columns * columns + rows * rows
        };
        self.cells.iter().min_by(|a, b| square(a).total_cmp(&square(b))).copied()
    }
}

/// Incremental frontier detector: only changed cells are examined.
/// As in Keidar and Kaminka, 2014, *Efficient frontier detection for robot exploration*.
#[derive(Clone, Debug, Default)]
pub struct FrontierDetector {
    size: [usize; 2],
    /// Cells of the map at the last update.
    seen: Vec<i8>,
    /// Frontier cells in the order of the map.
    frontier_cells: SortedSet<usize>,
}

impl FrontierDetector {
    /// Examines the cells changed since the last call.
    /// Of a map of another size it examines all.
    pub fn update(&mut self, map: &OccupancyMap) {
        let size = [map.geometry.width, map.geometry.height];
        if self.size != size || self.seen.len() != map.cells.len() {
            self.size = size;
            self.seen = vec![UNKNOWN_CELL; map.cells.len()];
            self.frontier_cells.clear();
        }
        for cell in 0..map.cells.len() {
            if std::mem::replace(&mut self.seen[cell], map.cells[cell]) != map.cells[cell] {
                self.visit(map, cell);
                for near in neighbors(size, cell) {
                    self.visit(map, near);
                }
            }
        }
    }

    fn visit(&mut self, map: &OccupancyMap, cell: usize) {
        let is_frontier = is_free(map.cells[cell])
            && neighbors(self.size, cell).any(|near| map.cells[near] == UNKNOWN_CELL);
        if is_frontier {
            self.frontier_cells.insert(cell);
        } else {
            self.frontier_cells.remove(&cell);
        }
    }

    /// Returns the frontiers of at least `min_cells` cells.
    /// They are in the order of their first cells.
    pub fn frontiers(&self, min_cells: usize) -> Vec<Frontier> {
        let mut left = self.frontier_cells.clone();
        let mut frontiers = Vec::new();
        while let Some(first) = left.pop_first() {
            let mut cells = vec![first];
            let mut at = 0;
            while at < cells.len() {
                for near in around(self.size, cells[at]) {
                    if left.remove(&near) {
                        cells.push(near);
                    }
                }
                at += 1;
            }
            if cells.len() >= min_cells {
                let width = self.size[0];
                let cell = |cell: usize| GridCell::new((cell % width) as u32, (cell / width) as u32);
                frontiers.push(Frontier { cells: cells.into_iter().map(cell).collect() });
            }
        }
        frontiers
    }
}

pub(crate) fn is_free(occupancy: i8) -> bool {
    (0..=FREE).contains(&occupancy)
}

/// Cells beside one, at its sides.
fn neighbors(size: [usize; 2], cell: usize) -> impl Iterator<Item = usize> {
    offsets(size, cell, [(1, 0), (0, 1), (-1, 0), (0, -1)])
}

/// Cells beside one, at its sides and corners.
fn around(size: [usize; 2], cell: usize) -> impl Iterator<Item = usize> {
    offsets(size, cell, [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)])
}

fn offsets<const N: usize>(
    [width, height]: [usize; 2],
    cell: usize,
    offsets: [(isize, isize); N],
) -> impl Iterator<Item = usize> {
    let (column, row) = (cell % width, cell / width);
    offsets.into_iter().filter_map(move |(columns, rows)| {
        let column = column.checked_add_signed(columns).filter(|column| *column < width)?;
        let row = row.checked_add_signed(rows).filter(|row| *row < height)?;
        Some(row * width + column)
    })
}
