//! Numbers of unknown cells in rectangles.

use slate_grid::{OccupancyMap, UNKNOWN_CELL};
use slate_planning::GridCell;

/// Summed-area table of unknown cells.
/// It counts those left of and below each corner of a map's cells (Crow, 1984, *Summed-area tables for texture
/// mapping*).
#[derive(Clone, Debug, Default)]
pub(crate) struct UnknownCounts {
    width: usize,
    height: usize,
    sums: Vec<u32>,
}

impl UnknownCounts {
    /// Counts the cells of a map.
    pub fn count(&mut self, map: &OccupancyMap) {
        (self.width, self.height) = (map.geometry.width, map.geometry.height);
        let stride = self.width + 1;
        self.sums.clear();
        self.sums.resize(stride * (self.height + 1), 0);
        for row in 0..self.height {
            let mut in_row = 0;
            for column in 0..self.width {
                in_row += u32::from(map.cells[row * self.width + column] == UNKNOWN_CELL);
                let at = (row + 1) * stride + column + 1;
                self.sums[at] = self.sums[at - stride] + in_row;
            }
        }
    }

    /// Returns the number of unknown cells in a square around a cell.
    /// They are at most `side` columns and rows away.
    pub fn around(&self, middle: GridCell, side: usize) -> u32 {
        let ends = |at: u32, size: usize| {
            let at = at as usize;
            (at.saturating_sub(side).min(size), (at + side + 1).min(size))
        };
        let ((left, right), (low, high)) = (ends(middle.column, self.width), ends(middle.row, self.height));
        let sum = |column: usize, row: usize| self.sums[row * (self.width + 1) + column];
        (sum(right, high) + sum(left, low)) - (sum(left, high) + sum(right, low))
    }
}
